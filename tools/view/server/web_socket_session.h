#pragma once
// One WebSocket of one client. It never waits for the client: what the client does not read in
// time is replaced by newer messages, and a client that does not read at all is dropped.

#include <array>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "tools/view/server/send_queue.h"

namespace rcs::view {

class WebSocketSession;

/// Receives what the clients send. All calls come from the loop of the server.
class WebSocketOwner {
 public:
  virtual void on_open(WebSocketSession* session) = 0;
  virtual void on_text(WebSocketSession* session, std::string_view text) = 0;
  /// The session is not used afterwards.
  virtual void on_close(WebSocketSession* session) = 0;

 protected:
  ~WebSocketOwner() = default;
};

class WebSocketSession : public std::enable_shared_from_this<WebSocketSession> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  static constexpr std::size_t kMaxWaitingBytes = std::size_t{16} << 20;
  static constexpr std::size_t kMaxRequestBytes = std::size_t{256} << 10;

  /// @param owner  outlives the session
  WebSocketSession(boost::beast::tcp_stream stream, std::string protocol, WebSocketOwner* owner)
      : ws_(std::move(stream)), protocol_(std::move(protocol)), owner_(owner) {}

  /// Completes the handshake of the request.
  void run(const Request& request);

  [[nodiscard]] const std::string& protocol() const { return protocol_; }
  [[nodiscard]] const std::string& peer() const { return peer_; }
  [[nodiscard]] const SendQueue& queue() const { return queue_; }
  [[nodiscard]] std::int64_t messages_sent() const { return messages_sent_; }
  [[nodiscard]] std::int64_t bytes_sent() const { return bytes_sent_; }

  /// A client for which texts alone exceed the bytes is dropped.
  void send_text(std::string text);
  void send(std::uint32_t subscription, std::uint64_t time_ns, Payload payload);
  void forget(std::uint32_t subscription) { queue_.forget(subscription); }
  /// Ends the connection at once, without waiting for the client.
  void drop();
  /// Counts calls during which the same message was being sent. @return the count
  [[nodiscard]] int stalled_for();

 private:
  void read();
  void on_read(const boost::beast::error_code& error);
  void write();
  void close();

  boost::beast::websocket::stream<boost::beast::tcp_stream> ws_;
  std::string protocol_;
  std::string peer_;
  WebSocketOwner* owner_;
  boost::beast::flat_buffer buffer_;
  SendQueue queue_{kMaxWaitingBytes};
  bool open_ = false;
  bool writing_ = false;
  int stalled_ = 0;
  Outgoing outgoing_;  // that is being written
  std::array<std::uint8_t, 13> header_{};
  std::int64_t messages_sent_ = 0;
  std::int64_t bytes_sent_ = 0;
};

}  // namespace rcs::view
