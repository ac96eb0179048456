#include "tools/view/view_options.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "rcs/command_line/config_files.h"
#include "rcs/node/bus/bus_options.h"

namespace rcs::view {
namespace {

constexpr int kMinPixels = 100;
constexpr int kMaxPixels = 8000;

std::optional<double> seconds_of(std::string_view text) {
  if (text.substr(0, 2) == "t=") text.remove_prefix(2);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && std::isfinite(value) && value >= 0.0 ? std::optional(value) : std::nullopt;
}

}  // namespace

Result<PictureSize> picture_size(const std::string& text) {
  PictureSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  const bool times = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  const auto height = times ? std::from_chars(width.ptr + 1, end, size.height) : width;
  const auto in_range = [](int n) { return n >= kMinPixels && n <= kMaxPixels; };
  if (!times || height.ec != std::errc() || height.ptr != end || !in_range(size.width) ||
      !in_range(size.height)) {
    return Error{
        fmt::format("--size {}: expected WIDTHxHEIGHT, {} to {} pixels each, e.g. 1280x800", text,
                    kMinPixels, kMaxPixels)};
  }
  return size;
}

void add_view_options(CLI::App* app, ViewOptions* options) {
  app->add_option("LOG", options->log, "log of a run; without it the bus is shown live")
      ->check(CLI::ExistingFile);
  app->add_option("--config", options->config,
                  "configuration of the vehicle: the calibration makes points of LADAR_RANGES")
      ->transform(command_line::config_file());
  add_bus_option(app, &options->lcm_url);
  app->add_option("--host", options->host,
                  "address at which the page is served; another one than a loopback address shows\n"
                  "the run to everyone who reaches it")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app->add_option("--port", options->port, "port of the page; 0: the system chooses a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  app->add_option("--allow-origin", options->allowed_origins,
                  "origin of a web page that may connect, e.g. https://app.example.org; pages of\n"
                  "this computer and desktop programs may always; may be repeated")
      ->type_name("ORIGIN")
      ->allow_extra_args(false);
  app->add_option("--shot", options->shot,
                  "write a picture of this moment of LOG and end; needs Chromium")
      ->type_name("t=SECONDS");
  app->add_option("--panel", options->panel, "with --shot: what the picture shows")
      ->check(CLI::IsMember({"all", "3d", "timeline", "status", "pairs"}))
      ->capture_default_str();
  app->add_option("-o,--out", options->out, "with --shot: the picture, e.g. picture.png")
      ->type_name("FILE");
  app->add_option("--size", options->size, "with --shot: size of the picture in pixels")
      ->type_name("WIDTHxHEIGHT")
      ->capture_default_str();
  app->add_flag("--dark", options->dark, "with --shot: dark colors");
  app->footer(
      "Serves a page with the scan in 3D, the path, the terrain, the vehicle with its covariance\n"
      "and protection level, the modes and events over time, and the state of the nodes. The\n"
      "first line of the output is the address of the page; open it in a browser. `?` on the page\n"
      "shows its keys, and ADDRESS#t=97.5&log=run.log opens a moment of this log.\n"
      "docs/user/viewer.md explains the colors.\n"
      "Lichtblick and Foxglove connect to the same port (Foxglove WebSocket, "
      "ws://127.0.0.1:8765).\n"
      "/metrics has the state for Prometheus. The viewer only receives: it has no means to "
      "publish\n"
      "on the bus. A client that reads slowly receives only the newest message of each topic, and\n"
      "one that reads nothing is dropped. Ctrl-C ends the viewer (status 0; 130 during --shot).\n"
      "Examples:\n"
      "  rcs view\n"
      "  rcs view result.log --config config/demo3.toml\n"
      "  rcs view result.log --port 0\n"
      "  rcs view result.log --shot t=97.5 --panel 3d -o picture.png --dark");
}

Outcome check(const ViewOptions& options) {
  if (options.shot.empty()) {
    const ViewOptions standard;
    const bool picture = !options.out.empty() || options.dark || options.size != standard.size ||
                         options.panel != standard.panel;
    if (picture) return Error{"--out, --size, --panel and --dark need --shot t=SECONDS"};
    return Done{};
  }
  if (!seconds_of(options.shot)) {
    return Error{fmt::format(
        "--shot {}: expected t=SECONDS after the begin of the log, e.g. t=97.5", options.shot)};
  }
  if (options.log.empty()) return Error{"--shot needs a LOG"};
  if (options.out.empty()) return Error{"--shot needs --out FILE, e.g. -o picture.png"};
  const Result<PictureSize> size = picture_size(options.size);
  return size ? Outcome(Done{}) : Outcome(size.error());
}

double shot_time_s(const ViewOptions& options) { return seconds_of(options.shot).value_or(0.0); }

std::vector<std::string> to_arguments(const ViewOptions& options) {
  const ViewOptions standard;
  std::vector<std::string> arguments;
  const auto add = [&](const char* name, const std::string& value, const std::string& usual) {
    if (value != usual) arguments.push_back(fmt::format("{}={}", name, value));
  };
  add("--config", options.config, standard.config);
  add("--lcm-url", options.lcm_url, standard.lcm_url);
  add("--host", options.host, standard.host);
  add("--port", std::to_string(options.port), std::to_string(standard.port));
  for (const std::string& origin : options.allowed_origins) {
    arguments.push_back("--allow-origin=" + origin);
  }
  add("--shot", options.shot, standard.shot);
  add("--panel", options.panel, standard.panel);
  add("--out", options.out, standard.out);
  add("--size", options.size, standard.size);
  if (options.dark) arguments.emplace_back("--dark");
  if (!options.log.empty()) {
    arguments.emplace_back("--");
    arguments.push_back(options.log);
  }
  return arguments;
}

}  // namespace rcs::view
