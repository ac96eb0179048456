#pragma once
// All parameters of a vehicle's configuration, from the parsers of the nodes that read it.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/params/params.h"

namespace rcs::cli {

/// A configuration as every program reads it.
struct Configuration {
  std::vector<ParamDescription> parameters;  ///< in the order of the parsers, each once
  std::vector<std::string> problems;  ///< "file.toml:12: [sp.icp] gate_m: ..."; sorted by line
};

/// @param overrides  as of ParamFile::load()
/// @return an error if the file cannot be read or is not valid TOML
[[nodiscard]] Result<Configuration> read_configuration(const std::string& path,
                                                       const std::vector<std::string>& overrides);

/// The parameters with their defaults. [process.NODE] stands for the table of any node.
[[nodiscard]] std::vector<ParamDescription> default_parameters();

/// Parameters that match a name: a full key, a table ("sp.icp"), or the end of a key ("gate_m").
[[nodiscard]] std::vector<ParamDescription> find_parameters(
    const std::vector<ParamDescription>& parameters, const std::string& name);

/// The effective values as a valid configuration, with the source of each value in a comment.
/// @param changed_only  omit values equal to their defaults
[[nodiscard]] std::string to_toml(const std::vector<ParamDescription>& parameters,
                                  bool changed_only);

}  // namespace rcs::cli
