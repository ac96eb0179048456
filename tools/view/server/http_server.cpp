#include "tools/view/server/http_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "tools/view/server/control_protocol.h"
#include "tools/view/server/foxglove_protocol.h"

namespace rcs::view {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = boost::asio::ip::tcp;

constexpr std::chrono::seconds kRequestTime{30};
constexpr std::chrono::milliseconds kRetry{200};
constexpr std::uint32_t kMaxHeaderBytes = 16 << 10;

/// No address but this server: the page works without a network, and nothing leaves the computer.
constexpr char kContentPolicy[] =
    "default-src 'self'; connect-src 'self' {}; img-src 'self' data: blob:; object-src 'none'; "
    "base-uri 'none'; frame-ancestors 'self'";

/// The policy for a page that was requested from `host`. Not every browser counts the WebSocket of
/// the same server as 'self'.
std::string content_policy(std::string_view host) {
  const bool plain = std::all_of(host.begin(), host.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == ':' || c == '-' ||
           c == '[' || c == ']';
  });
  return fmt::format(kContentPolicy, plain ? fmt::format("ws://{}", host) : std::string());
}

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

/// Whether a list "a, b" has the word.
bool has_word(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    std::string_view entry = list.substr(0, list.find(','));
    list.remove_prefix(std::min(list.size(), entry.size() + 1));
    while (!entry.empty() && entry.front() == ' ') entry.remove_prefix(1);
    while (!entry.empty() && entry.back() == ' ') entry.remove_suffix(1);
    if (entry == word) return true;
  }
  return false;
}

/// The connections of the server, counted.
class Counted {
 public:
  explicit Counted(std::shared_ptr<int> count) : count_(std::move(count)) { ++*count_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  ~Counted() { --*count_; }

 private:
  std::shared_ptr<int> count_;
};

class HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(tcp::socket socket, HttpServer* server)
      : stream_(std::move(socket)), server_(server), counted_(server->connections()) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeaderBytes);
    parser_->body_limit(1);
    stream_.expires_after(kRequestTime);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (!error) self->handle();
                     });
  }

 private:
  void handle() {
    const auto& request = parser_->get();
    const std::string_view host = view(request[http::field::host]);
    const RequestPolicy& policy = server_->policy();
    if (!policy.allows_host(host)) {
      return reply(HttpResponse::refused(
          403, "host name not accepted: use an IP address, localhost or the name of --host"));
    }
    if (beast::websocket::is_upgrade(request)) return upgrade();
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return reply(HttpResponse::refused(405, "only GET and HEAD: the viewer receives only"));
    }
    reply(server_->handler()->respond(view(request.target())));
  }

  void upgrade() {
    const auto& request = parser_->get();
    const std::string_view origin = view(request[http::field::origin]);
    if (!server_->policy().allows_origin(origin, view(request[http::field::host]))) {
      return reply(HttpResponse::refused(
          403, "the page of another server; permit it by --allow-origin " + std::string(origin)));
    }
    const std::string_view offered = view(request[http::field::sec_websocket_protocol]);
    for (const char* protocol : {kFoxgloveProtocol, kControlProtocol}) {
      if (!has_word(offered, protocol)) continue;
      stream_.expires_never();
      std::make_shared<WebSocketSession>(std::move(stream_), protocol, server_->owner())
          ->run(request);
      return;
    }
    reply(HttpResponse::refused(
        400, fmt::format("WebSocket without a known subprotocol; known: {}, {}", kFoxgloveProtocol,
                         kControlProtocol)));
  }

  void reply(const HttpResponse& response) {
    const auto& request = parser_->get();
    const bool head = request.method() == http::verb::head;
    body_ = response.body;
    response_.emplace(http::int_to_status(response.status), request.version());
    response_->set(http::field::content_type, response.type);
    response_->set(http::field::cache_control, "no-cache");
    response_->set(http::field::x_frame_options, "SAMEORIGIN");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Content-Security-Policy", content_policy(view(request[http::field::host])));
    response_->content_length(body_->size());
    response_->keep_alive(request.keep_alive() && response.status < 400);
    response_->body().data = head ? nullptr : const_cast<char*>(body_->data());  // only read
    response_->body().size = head ? 0 : body_->size();
    response_->body().more = false;
    serializer_.emplace(*response_);
    serializer_->split(head);
    stream_.expires_after(kRequestTime);
    const auto done = [self = shared_from_this()](const beast::error_code& error, std::size_t) {
      if (error) return;
      if (self->response_->keep_alive()) return self->read();
      beast::error_code ignored;
      (void)self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    };
    if (head) {
      http::async_write_header(stream_, *serializer_, done);
    } else {
      http::async_write(stream_, *serializer_, done);
    }
  }

  beast::tcp_stream stream_;
  HttpServer* server_;
  Counted counted_;
  beast::flat_buffer buffer_{std::size_t{2} * kMaxHeaderBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::buffer_body>> response_;
  std::optional<http::response_serializer<http::buffer_body>> serializer_;
  std::shared_ptr<const std::string> body_;
};

}  // namespace

HttpServer::HttpServer(asio::io_context* io, RequestPolicy policy, HttpHandler* handler,
                       WebSocketOwner* owner)
    : io_(io),
      policy_(std::move(policy)),
      handler_(handler),
      owner_(owner),
      acceptor_(*io),
      retry_(*io) {}

Outcome HttpServer::listen(const std::string& host, std::uint16_t port) {
  boost::system::error_code error;
  tcp::resolver resolver(*io_);
  const auto endpoints = resolver.resolve(host, std::to_string(port), error);
  if (error || endpoints.empty()) {
    return Error{
        fmt::format("--host {}: not an address of this computer ({})", host, error.message())};
  }
  const tcp::endpoint endpoint = *endpoints.begin();
  (void)acceptor_.open(endpoint.protocol(), error);
  if (!error) (void)acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) (void)acceptor_.bind(endpoint, error);
  if (!error) (void)acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use) {
    return Error{fmt::format(
        "port {} of {} is in use, perhaps by another `rcs view`: end it, choose another port by "
        "--port N, or let the system choose one by --port 0",
        port, host)};
  }
  if (error) {
    return Error{fmt::format("cannot listen on {} port {}: {}", host, port, error.message())};
  }
  accept();
  return Done{};
}

std::uint16_t HttpServer::port() const {
  boost::system::error_code error;
  return acceptor_.local_endpoint(error).port();
}

std::string HttpServer::url() const {
  boost::system::error_code error;
  const asio::ip::address address = acceptor_.local_endpoint(error).address();
  const std::string host = address.is_unspecified() ? "localhost"
                           : address.is_v6()        ? "[" + address.to_string() + "]"
                                                    : address.to_string();
  return fmt::format("http://{}:{}/", host, port());
}

void HttpServer::stop() {
  boost::system::error_code ignored;
  (void)acceptor_.close(ignored);
  retry_.cancel();
}

void HttpServer::accept() {
  acceptor_.async_accept([this](const boost::system::error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted || !acceptor_.is_open()) return;
    if (error) {  // out of descriptors
      retry_.expires_after(kRetry);
      retry_.async_wait([this](const boost::system::error_code& stopped) {
        if (!stopped) accept();
      });
      return;
    }
    // Above the limit the connection is closed at once.
    if (*connections_ < kMaxConnections) {
      std::make_shared<HttpSession>(std::move(socket), this)->read();
    }
    accept();
  });
}

}  // namespace rcs::view
