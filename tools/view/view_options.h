#pragma once
// The command line of the viewer, for the program rcs_view and for `rcs view`, which runs it.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::view {

struct ViewOptions {
  std::string log;  ///< empty: the bus
  std::string config;
  std::string lcm_url;
  std::string host = "127.0.0.1";
  std::uint16_t port = 8765;
  std::vector<std::string> allowed_origins;
  std::string shot;  ///< "t=97.5"; empty: serve
  std::string panel = "all";
  std::string out;
  std::string size = "1280x800";
  bool dark = false;
};

void add_view_options(CLI::App* app, ViewOptions* options);

/// Values of the options that depend on one another or have a form of their own.
/// @return an error that names the option
[[nodiscard]] Outcome check(const ViewOptions& options);

/// The command line that gives these options.
[[nodiscard]] std::vector<std::string> to_arguments(const ViewOptions& options);

/// Seconds of "t=97.5" or "97.5"; the option must have passed check().
[[nodiscard]] double shot_time_s(const ViewOptions& options);

struct PictureSize {
  int width = 0;
  int height = 0;
};
/// Of "1280x800".
[[nodiscard]] Result<PictureSize> picture_size(const std::string& text);

}  // namespace rcs::view
