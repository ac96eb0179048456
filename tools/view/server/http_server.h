#pragma once
// The server: HTTP (GET and HEAD only) and WebSockets, in the loop of one thread.

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "rcs/base/result.h"
#include "tools/view/server/request_policy.h"
#include "tools/view/server/web_socket_session.h"

namespace rcs::view {

struct HttpResponse {
  unsigned status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body = std::make_shared<const std::string>();

  static HttpResponse of(std::string type, std::string body) {
    return {200, std::move(type), std::make_shared<const std::string>(std::move(body))};
  }
  static HttpResponse refused(unsigned status, std::string reason) {
    return {status, "text/plain; charset=utf-8",
            std::make_shared<const std::string>(std::move(reason) + "\n")};
  }
};

/// Serves what is not a WebSocket.
class HttpHandler {
 public:
  /// @param target  path and query, e.g. "/api/why?t=97.5"
  virtual HttpResponse respond(std::string_view target) = 0;

 protected:
  ~HttpHandler() = default;
};

class HttpServer {
 public:
  static constexpr int kMaxConnections = 100;

  /// The handler and the owner outlive the server.
  HttpServer(boost::asio::io_context* io, RequestPolicy policy, HttpHandler* handler,
             WebSocketOwner* owner);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  ~HttpServer() = default;

  /// @param port  0: any that is free
  /// @return an error that names address and port, and a remedy
  [[nodiscard]] Outcome listen(const std::string& host, std::uint16_t port);
  [[nodiscard]] std::uint16_t port() const;
  /// "http://127.0.0.1:8765/"
  [[nodiscard]] std::string url() const;
  void stop();

  [[nodiscard]] const RequestPolicy& policy() const { return policy_; }
  [[nodiscard]] HttpHandler* handler() const { return handler_; }
  [[nodiscard]] WebSocketOwner* owner() const { return owner_; }
  /// Counts the connections, so that they are bounded.
  std::shared_ptr<int> connections() { return connections_; }

 private:
  void accept();

  boost::asio::io_context* io_;
  RequestPolicy policy_;
  HttpHandler* handler_;
  WebSocketOwner* owner_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::shared_ptr<int> connections_ = std::make_shared<int>(0);
};

}  // namespace rcs::view
