#pragma once
// The configurations that are installed with the programs: found from any working directory.

#include <CLI/CLI.hpp>
#include <string>

namespace rcs::command_line {

/// A relative path that the working directory lacks is searched in the folders above the program,
/// and in their share/rcs: the source tree of a build, and the data of an installation.
/// @return the path itself if it exists, or is found nowhere
[[nodiscard]] std::string find_config(const std::string& path);

/// For arguments that name a configuration: replaces the value as find_config() does. Whoever reads
/// the file reports that it does not exist.
[[nodiscard]] CLI::Validator config_path();

/// As config_path(); the file must exist.
[[nodiscard]] CLI::Validator config_file();

}  // namespace rcs::command_line
