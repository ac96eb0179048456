#pragma once
// A headless Chromium, commanded by the DevTools protocol over two pipes
// (--remote-debugging-pipe): JSON texts, each followed by a zero byte.

#include <sys/types.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/streambuf.hpp>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "rcs/base/result.h"

namespace rcs::view {

class Browser {
 public:
  using Json = nlohmann::json;
  using Reply = std::function<void(const Result<Json>&)>;

  /// @return an error if no Chromium is installed, or if it cannot be started
  static Result<std::unique_ptr<Browser>> start(boost::asio::io_context* io);
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;
  ~Browser();  ///< ends the browser and removes its profile

  /// @param session  empty: the browser itself
  /// @param reply  called with the result, or with an error when the browser has ended
  void call(const std::string& method, const Json& parameters, const std::string& session,
            Reply reply);

 private:
  Browser(boost::asio::io_context* io, pid_t pid, int to, int from, std::string profile);
  void write();
  void read();
  void take(const std::string& text);
  void fail(const std::string& reason);

  pid_t pid_;
  std::string profile_;
  boost::asio::posix::stream_descriptor to_;
  boost::asio::posix::stream_descriptor from_;
  boost::asio::streambuf input_;
  std::deque<std::string> waiting_;
  bool writing_ = false;
  int next_id_ = 1;
  std::map<int, Reply> replies_;
};

}  // namespace rcs::view
