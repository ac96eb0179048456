#pragma once
// The configurations that are installed with the program: found from any working directory.

#include <CLI/CLI.hpp>
#include <string>

namespace rcs::cli {

/// A relative path that the working directory lacks is searched in the folders above the program,
/// and in their share/rcs: the source tree of a build, and the data of an installation.
/// @return the path itself if it exists, or is found nowhere
[[nodiscard]] std::string find_config(const std::string& path);

/// For options that name a configuration: replaces the value as find_config() does.
/// The value must exist then.
[[nodiscard]] CLI::Validator config_file();

}  // namespace rcs::cli
