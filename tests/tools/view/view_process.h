#pragma once
// The program rcs_view as a child process, and clients of its server.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "rcs/base/check.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {

namespace beast = boost::beast;
namespace http = boost::beast::http;

class ViewProcess {
 public:
  explicit ViewProcess(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), variable("RCS_BIN_DIR") + "/rcs_view");
    std::array<int, 2> out{};
    RCS_CHECK(pipe(out.data()) == 0);
    pid_ = fork();
    if (pid_ == 0) {
      (void)dup2(out[1], STDOUT_FILENO);
      (void)close(out[0]);
      (void)close(out[1]);
      std::vector<char*> argv;
      argv.reserve(arguments.size() + 1);
      for (std::string& a : arguments) argv.push_back(a.data());
      argv.push_back(nullptr);
      execv(argv[0], argv.data());
      _exit(127);
    }
    (void)close(out[1]);
    std::FILE* lines = fdopen(out[0], "r");
    std::array<char, 200> line{};
    if (std::fgets(line.data(), static_cast<int>(line.size()), lines) != nullptr) {
      url_ = line.data();
    }
    (void)std::fclose(lines);
    while (!url_.empty() && url_.back() == '\n') url_.pop_back();
    const std::size_t colon = url_.rfind(':');
    if (colon != std::string::npos) port_ = url_.substr(colon + 1, url_.size() - colon - 2);
  }
  ViewProcess(const ViewProcess&) = delete;
  ViewProcess& operator=(const ViewProcess&) = delete;
  ~ViewProcess() {
    if (pid_ > 0) (void)end(SIGKILL);
  }

  [[nodiscard]] const std::string& url() const { return url_; }
  [[nodiscard]] const std::string& port() const { return port_; }
  /// @return the exit status
  int end(int signal) {
    (void)kill(pid_, signal);
    int status = 0;
    (void)waitpid(std::exchange(pid_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] long resident_kb() const {
    std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
    for (std::string word; status >> word;) {
      long kb = 0;
      if (word == "VmRSS:" && status >> kb) return kb;
    }
    return -1;
  }

  [[nodiscard]] http::response<http::string_body> get(
      const std::string& target, http::verb verb = http::verb::get,
      const std::vector<std::pair<http::field, std::string>>& fields = {}) const {
    boost::asio::io_context io;
    beast::tcp_stream stream(io);
    stream.connect(boost::asio::ip::tcp::resolver(io).resolve("127.0.0.1", port_));
    http::request<http::empty_body> request(verb, target, 11);
    request.set(http::field::host, "127.0.0.1:" + port_);
    request.keep_alive(false);
    for (const auto& [name, value] : fields) request.set(name, value);
    http::write(stream, request);
    beast::flat_buffer buffer;
    http::response_parser<http::string_body> parser;
    parser.skip(verb == http::verb::head);
    parser.body_limit(std::uint64_t{100} << 20U);
    http::read(stream, buffer, parser);
    return parser.release();
  }
  /// The value of a metric without labels.
  [[nodiscard]] double metric(const std::string& name) const {
    const std::string text = get("/metrics").body();
    const std::size_t at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1.0 : std::stod(text.substr(at + name.size() + 2));
  }

 private:
  pid_t pid_ = -1;
  std::string url_;
  std::string port_;
};

class ViewClient {
 public:
  ViewClient(const ViewProcess& process, const std::string& protocol,
             const std::string& origin = "")
      : ws_(io_) {
    boost::asio::connect(ws_.next_layer(),
                         boost::asio::ip::tcp::resolver(io_).resolve("127.0.0.1", process.port()));
    ws_.set_option(beast::websocket::stream_base::decorator(
        [protocol, origin](beast::websocket::request_type& request) {
          request.set(http::field::sec_websocket_protocol, protocol);
          if (!origin.empty()) request.set(http::field::origin, origin);
        }));
    ws_.read_message_max(0);
    ws_.handshake("127.0.0.1:" + process.port(), "/", error_);
  }

  [[nodiscard]] const beast::error_code& error() const { return error_; }
  void send(const nlohmann::json& json) { ws_.write(boost::asio::buffer(json.dump())); }
  /// The next message. @return false: the server has closed the connection
  bool read() {
    buffer_.clear();
    ws_.read(buffer_, error_);
    return !error_;
  }
  [[nodiscard]] bool is_text() const { return ws_.got_text(); }
  [[nodiscard]] nlohmann::json json() const {
    return nlohmann::json::parse(beast::buffers_to_string(buffer_.data()), nullptr, false);
  }
  [[nodiscard]] const std::uint8_t* data() const {
    return static_cast<const std::uint8_t*>(buffer_.data().data());
  }
  [[nodiscard]] std::size_t size() const { return buffer_.size(); }
  /// The next text with this "op".
  nlohmann::json wait_for(const std::string& op) {
    while (read()) {
      if (!is_text()) continue;
      nlohmann::json message = json();
      if (message.value("op", "") == op) return message;
    }
    return nullptr;
  }
  /// Subscribes to a topic with the id of its channel.
  std::uint32_t subscribe(const nlohmann::json& advertised, const std::string& topic) {
    for (const nlohmann::json& channel : advertised["channels"]) {
      if (channel["topic"] != topic) continue;
      const auto id = channel["id"].get<std::uint32_t>();
      send({{"op", "subscribe"},
            {"subscriptions", nlohmann::json::array({{{"id", id}, {"channelId", id}}})}});
      return id;
    }
    ADD_FAILURE() << topic << " is not advertised";
    return 0;
  }

 private:
  boost::asio::io_context io_;
  beast::websocket::stream<boost::asio::ip::tcp::socket> ws_;
  beast::flat_buffer buffer_;
  beast::error_code error_;
};

}  // namespace rcs::test
