#include "tools/view/server/web_socket_session.h"

#include <fmt/format.h>

#include <utility>

#include "tools/view/server/foxglove_protocol.h"

namespace rcs::view {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

void WebSocketSession::run(const Request& request) {
  beast::tcp_stream& stream = beast::get_lowest_layer(ws_);
  stream.expires_never();  // the WebSocket has its own limits of time
  beast::error_code error;
  const auto endpoint = stream.socket().remote_endpoint(error);
  if (!error) peer_ = fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port());
  // The kernel would buffer megabytes for a client that does not read.
  (void)stream.socket().set_option(boost::asio::socket_base::send_buffer_size(256 << 10), error);
  (void)stream.socket().set_option(boost::asio::ip::tcp::no_delay(true), error);
  ws_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
  ws_.set_option(
      websocket::stream_base::decorator([protocol = protocol_](websocket::response_type& response) {
        response.set(beast::http::field::sec_websocket_protocol, protocol);
      }));
  ws_.read_message_max(kMaxRequestBytes);
  ws_.auto_fragment(false);
  ws_.async_accept(request, [self = shared_from_this()](const beast::error_code& failed) {
    if (failed) return;
    self->open_ = true;
    self->owner_->on_open(self.get());
    self->read();
  });
}

void WebSocketSession::read() {
  ws_.async_read(buffer_, [self = shared_from_this()](const beast::error_code& error,
                                                      std::size_t /*n*/) { self->on_read(error); });
}

void WebSocketSession::on_read(const beast::error_code& error) {
  if (error) return close();
  if (!open_) return;
  const auto data = buffer_.cdata();
  owner_->on_text(this, {static_cast<const char*>(data.data()), data.size()});
  buffer_.consume(buffer_.size());
  if (open_) read();
}

void WebSocketSession::send_text(std::string text) {
  if (!open_) return;
  if (!queue_.push_text(std::move(text))) return drop();
  write();
}

void WebSocketSession::send(std::uint32_t subscription, std::uint64_t time_ns, Payload payload) {
  if (!open_) return;
  queue_.push(subscription, time_ns, std::move(payload));
  write();
}

void WebSocketSession::write() {
  if (writing_ || !open_) return;
  std::optional<Outgoing> next = queue_.pop();
  if (!next) return;
  outgoing_ = std::move(*next);
  writing_ = true;
  stalled_ = 0;
  const auto done = [self = shared_from_this()](const beast::error_code& error, std::size_t n) {
    self->writing_ = false;
    self->outgoing_ = {};
    if (error) return self->close();
    ++self->messages_sent_;
    self->bytes_sent_ += static_cast<std::int64_t>(n);
    self->write();
  };
  ws_.text(outgoing_.payload == nullptr);
  if (outgoing_.payload == nullptr) {
    ws_.async_write(boost::asio::buffer(outgoing_.text), done);
    return;
  }
  header_ = message_header(outgoing_.subscription, outgoing_.time_ns);
  const std::array<boost::asio::const_buffer, 2> frame = {boost::asio::buffer(header_),
                                                          boost::asio::buffer(*outgoing_.payload)};
  ws_.async_write(frame, done);
}

int WebSocketSession::stalled_for() {
  if (writing_) ++stalled_;
  return writing_ ? stalled_ : 0;
}

void WebSocketSession::drop() {
  beast::error_code ignored;
  (void)beast::get_lowest_layer(ws_).socket().close(ignored);  // pending operations fail
  close();
}

void WebSocketSession::close() {
  if (!std::exchange(open_, false)) return;
  owner_->on_close(this);
}

}  // namespace rcs::view
