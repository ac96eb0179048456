#pragma once
// All parameters of a vehicle's configuration, from the parsers of the nodes that read it.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/params/params.h"

namespace rcs::cli {

/// A configuration as every program reads it.
struct Configuration {
  std::vector<ParamDescription> parameters;  ///< by the order of the parsers, each once
  std::vector<std::string> problems;         ///< "file.toml:12: [sp.icp] gate_m: ..."; by line
};

/// @param overrides  as of ParamFile::load()
/// @return an error where the file cannot be read or is no TOML
[[nodiscard]] Result<Configuration> read_configuration(const std::string& path,
                                                       const std::vector<std::string>& overrides);

/// The parameters with their defaults. [process.NODE] stands for the table of any node.
[[nodiscard]] std::vector<ParamDescription> default_parameters();

/// "sp.icp.gate_m".
[[nodiscard]] std::string full_key(const ParamDescription& parameter);

/// Those of the name: one by its full key, all of a table ("sp.icp"), or all whose key ends in it
/// ("gate_m").
[[nodiscard]] std::vector<ParamDescription> find_parameters(
    const std::vector<ParamDescription>& parameters, const std::string& name);

/// What is in force, as a configuration that can be used: a comment after each value says where it
/// is from.
/// @param changed_only  without what has its default
[[nodiscard]] std::string to_toml(const std::vector<ParamDescription>& parameters,
                                  bool changed_only);

}  // namespace rcs::cli
