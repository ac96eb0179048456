#include "tools/view/picture.h"

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

namespace rcs::view {
namespace {

using Json = Browser::Json;

constexpr std::chrono::milliseconds kPoll{100};

}  // namespace

std::optional<std::string> from_base64(std::string_view text) {
  static const std::array<int, 256> kValues = [] {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<int, 256> values{};
    values.fill(-1);
    for (std::size_t i = 0; i < kDigits.size(); ++i) {
      values[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
    }
    return values;
  }();
  if (text.size() % 4 != 0) return std::nullopt;
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() * 3 / 4);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = kValues[static_cast<unsigned char>(c)];
    if (value < 0) return std::nullopt;
    bits = bits << 6U | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes.push_back(static_cast<char>(bits >> static_cast<unsigned>(count) & 0xFFU));
    }
  }
  return bytes;
}

PictureJob::PictureJob(boost::asio::io_context* io, std::unique_ptr<Browser> browser,
                       std::string url, PictureSize size, Done done)
    : timer_(*io),
      browser_(std::move(browser)),
      url_(std::move(url)),
      size_(size),
      done_(std::move(done)) {}

Browser::Reply PictureJob::then(std::function<void(const Json&)> next) {
  return [this, next = std::move(next)](const Result<Json>& result) {
    if (result) {
      next(*result);
    } else {
      fail(result.error());
    }
  };
}

void PictureJob::start() {
  browser_->call(
      "Target.createTarget", {{"url", "about:blank"}}, "",
      then([this](const Json& result) { attach(result.value("targetId", std::string())); }));
}

void PictureJob::attach(const std::string& target) {
  browser_->call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}}, "",
                 then([this](const Json& result) {
                   session_ = result.value("sessionId", std::string());
                   prepare();
                 }));
}

void PictureJob::prepare() {
  browser_->call("Emulation.setDeviceMetricsOverride",
                 {{"width", size_.width},
                  {"height", size_.height},
                  {"deviceScaleFactor", 1},
                  {"mobile", false}},
                 session_, then([this](const Json& /*result*/) { open_page(); }));
}

void PictureJob::open_page() {
  browser_->call("Page.navigate", {{"url", url_}}, session_, then([this](const Json& result) {
                   if (result.contains("errorText")) {
                     return fail({"chromium cannot open the page: " +
                                  result.value("errorText", std::string())});
                   }
                   wait_until_shown();
                 }));
}

void PictureJob::wait_until_shown() {
  if (++polls_ * kPoll > kLimit) {
    return fail({"the page showed nothing within 60 s"});
  }
  browser_->call(
      "Runtime.evaluate",
      {{"expression", "window.rcsView ? window.rcsView.shotState() : 'loading'"}}, session_,
      then([this](const Json& result) {
        const std::string state =
            result.value("result", Json::object()).value("value", std::string("loading"));
        if (state == "ready") return capture();
        if (state != "loading") return fail({state});
        timer_.expires_after(kPoll);
        timer_.async_wait([this](const boost::system::error_code& error) {
          if (!error) wait_until_shown();
        });
      }));
}

void PictureJob::capture() {
  browser_->call(
      "Page.captureScreenshot", {{"format", "png"}}, session_, then([this](const Json& result) {
        const std::optional<std::string> png = from_base64(result.value("data", std::string()));
        if (!png || png->empty()) return fail({"chromium returned no picture"});
        done_(*png);
      }));
}

void PictureJob::fail(const Error& error) { done_(error); }

}  // namespace rcs::view
