#pragma once
// A picture of the page, made by a headless Chromium.

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "rcs/base/result.h"
#include "tools/view/browser.h"
#include "tools/view/view_options.h"

namespace rcs::view {

/// The bytes of base64 text; line ends are not accepted. nullopt: invalid
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

class PictureJob {
 public:
  /// Longer than the slowest page on a loaded computer.
  static constexpr std::chrono::seconds kLimit{60};
  using Done = std::function<void(const Result<std::string>& png)>;

  PictureJob(boost::asio::io_context* io, std::unique_ptr<Browser> browser, std::string url,
             PictureSize size, Done done);

  void start();

 private:
  void attach(const std::string& target);
  void prepare();
  void open_page();
  void wait_until_shown();
  void capture();
  void fail(const Error& error);
  /// Calls `next` with the result, or fails.
  Browser::Reply then(std::function<void(const Browser::Json&)> next);

  boost::asio::steady_timer timer_;
  std::unique_ptr<Browser> browser_;
  std::string url_;
  PictureSize size_;
  Done done_;
  std::string session_;
  int polls_ = 0;
};

}  // namespace rcs::view
