// rcs_view: the viewer. `rcs view` runs it.

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "modules/sp/sp_config.h"
#include "rcs/base/exit_status.h"
#include "rcs/base/input_files.h"
#include "rcs/command_line/parse.h"
#include "rcs/node/params/params.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tools/base/files.h"
#include "tools/view/picture.h"
#include "tools/view/server/http_server.h"
#include "tools/view/source/bus_reception.h"
#include "tools/view/source/log_playback.h"
#include "tools/view/view_options.h"
#include "tools/view/viewer.h"

namespace rcs::view {
namespace {

constexpr char kPrefix[] = "rcs view: ";

int fail(int status, const std::string& message) {
  fmt::print(stderr, "{}{}\n", kPrefix, message);
  return status;
}

Result<std::optional<sp::LadarParams>> ladar_of(const std::string& path) {
  if (path.empty()) return std::optional<sp::LadarParams>();
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  const Result<sp::SpConfig> config = sp::load_sp_config(*file);
  if (!config) return config.error();
  return std::optional(config->ladar);
}

/// The process, from its options to its exit status.
class Program {
 public:
  explicit Program(const ViewOptions& options)
      : options_(options), stop_(io_, dup(signals_.fd())) {}

  int run() {
    const Result<std::optional<sp::LadarParams>> ladar = ladar_of(options_.config);
    if (!ladar) return fail(kExitInput, ladar.error().message);
    if (!options_.shot.empty()) {
      const Outcome writable = tools::OutputFile(options_.out).check();
      if (!writable) return fail(kExitInput, writable.error().message);
    }
    if (const Outcome opened = open_source(); !opened) {
      return interrupted() ? kExitInterrupted : fail(kExitInput, opened.error().message);
    }
    Viewer::Options viewer_options;
    viewer_options.version = RCS_VERSION;
    viewer_options.ladar = *ladar;
    viewer_options.report = [](const std::string& line) { (void)fail(kExitOk, line); };
    viewer_options.failed = [this](const std::string& reason) { end(fail(kExitInput, reason)); };
    Viewer viewer(&io_, source_.get(), &timeline_, std::move(viewer_options));
    HttpServer server(&io_, {options_.host, options_.allowed_origins}, &viewer, &viewer);
    const bool serves = options_.shot.empty();
    const Outcome listening =
        serves ? server.listen(options_.host, options_.port) : server.listen("127.0.0.1", 0);
    if (!listening) return fail(kExitInput, listening.error().message);
    viewer.start();
    if (serves) {
      announce(server);
    } else if (const Outcome begun = begin_shot(server.url()); !begun) {
      return fail(kExitInput, begun.error().message);
    }
    wait_for_signal(serves ? kExitOk : kExitInterrupted);
    io_.run();
    viewer.stop();
    server.stop();
    job_.reset();
    return status_;
  }

 private:
  Outcome open_source() {
    if (options_.log.empty()) {
      Result<std::unique_ptr<BusReception>> bus =
          BusReception::open(options_.lcm_url, &signals_, &io_, &timeline_);
      if (!bus) return bus.error();
      source_ = std::move(bus).value();
      return Done{};
    }
    Result<std::unique_ptr<LogPlayback>> log = LogPlayback::open(
        options_.log, &io_, &timeline_, [this](double /*share*/) { return !interrupted(); });
    if (!log) return log.error();
    const LogIndex& index = (*log)->index();
    if (!index.damage().empty()) {
      (void)fail(kExitOk, fmt::format("{}: {}", options_.log, index.damage()));
    }
    source_ = std::move(log).value();
    return Done{};
  }

  /// True after Ctrl-C or SIGTERM, which are blocked and wait in their descriptor.
  [[nodiscard]] bool interrupted() const {
    pollfd waiting{signals_.fd(), POLLIN, 0};
    return poll(&waiting, 1, 0) == 1;
  }

  void announce(const HttpServer& server) const {
    fmt::print("{}\n", server.url());
    (void)std::fflush(stdout);
    std::string what = source_->live() ? "live: " + source_->name()
                                       : fmt::format("{}, {:.1f} s", source_->name(),
                                                     seconds(source_->duration()));
    fmt::print(stderr, "{}{}\n{}open the address above in a browser; Ctrl-C ends\n", kPrefix, what,
               kPrefix);
  }

  Outcome begin_shot(const std::string& url) {
    const double t = shot_time_s(options_);
    if (t > seconds(source_->duration())) {
      return Error{fmt::format("--shot {}: {} ends after {:.1f} s", options_.shot, options_.log,
                               seconds(source_->duration()))};
    }
    const Result<PictureSize> size = picture_size(options_.size);
    if (!size) return size.error();
    Result<std::unique_ptr<Browser>> browser = Browser::start(&io_);
    if (!browser) return browser.error();
    const std::string address = fmt::format("{}?shot=1&panel={}&theme={}#t={}", url, options_.panel,
                                            options_.dark ? "dark" : "light", t);
    job_ = std::make_unique<PictureJob>(&io_, std::move(browser).value(), address, *size,
                                        [this](const Result<std::string>& png) { finish(png); });
    job_->start();
    return Done{};
  }

  void finish(const Result<std::string>& png) {
    if (!png) return end(fail(kExitInput, "--shot: " + png.error().message));
    const tools::OutputFile out(options_.out);
    Outcome written = out.write(*png);
    if (written) written = out.commit();
    if (!written) return end(fail(kExitInput, written.error().message));
    fmt::print(stderr, "{}{}\n", kPrefix, options_.out);
    end(kExitOk);
  }

  void wait_for_signal(int status) {
    stop_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [this, status](const boost::system::error_code& error) {
                       if (!error) end(status);
                     });
  }

  void end(int status) {
    status_ = status;
    io_.stop();
  }

  ViewOptions options_;
  StopSignals signals_;
  boost::asio::io_context io_{1};
  boost::asio::posix::stream_descriptor stop_;
  RunTimeline timeline_;
  std::unique_ptr<Source> source_;
  std::unique_ptr<PictureJob> job_;
  int status_ = kExitOk;
};

int view_main(int argc, char** argv) {
  CLI::App app("Show a run or the bus in a browser", "rcs view");
  ViewOptions options;
  add_view_options(&app, &options);
  if (const auto ended = command_line::parse(&app, argc, argv)) {
    return command_line::print(*ended);
  }
  if (const Outcome checked = check(options); !checked) {
    return fail(kExitUsage, checked.error().message);
  }
  return Program(options).run();
}

}  // namespace
}  // namespace rcs::view

int main(int argc, char** argv) {
  try {
    rcs::observe_inputs(rcs::tools::note_input);
    return rcs::view::view_main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "rcs view: %s\n", e.what());
    return rcs::kExitInput;
  }
}
