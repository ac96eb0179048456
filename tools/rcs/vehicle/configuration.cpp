#include "tools/rcs/vehicle/configuration.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "modules/bg/bg_config.h"
#include "modules/gateway/gateway_config.h"
#include "modules/mission/mission_config.h"
#include "modules/ros2_bridge/ros2_bridge_config.h"
#include "modules/sp/sp_config.h"
#include "modules/wm/wm_config.h"
#include "rcs/node/params/param_text.h"
#include "rcs/node/process/process.h"
#include "tools/evaluation/budget_metrics.h"

namespace rcs::cli {
namespace {

/// Reads a file with the parser of one program; parameters and problems are stored in the
/// ParamFile.
using Parser = std::function<void(const ParamFile&)>;

std::vector<Parser> parsers(bool with_gateway, bool with_ros2_bridge) {
  std::vector<Parser> all{
      [](const ParamFile& file) { (void)sp::load_sp_config(file); },
      [](const ParamFile& file) { (void)wm::load_wm_config(file); },
      [](const ParamFile& file) { (void)bg::load_bg_config(file); },
      [](const ParamFile& file) { (void)mission::load_mission_config(file); },
      [](const ParamFile& file) { (void)read_process_tables(file); },
      [](const ParamFile& file) { (void)evaluation::read_budget_limits(file); },
  };
  if (with_gateway) {
    all.emplace_back([](const ParamFile& file) { (void)gateway::load_gateway_config(file); });
  }
  if (with_ros2_bridge) {
    all.emplace_back(
        [](const ParamFile& file) { (void)ros2_bridge::load_ros2_bridge_config(file); });
  }
  return all;
}

bool same_key(const ParamDescription& a, const ParamDescription& b) {
  return a.key == b.key && a.table == b.table;
}

/// Several programs read the same tables: problems already found are not reported again.
void add(const ParamFile& file, Configuration* out) {
  for (const ParamDescription& d : file.described()) {
    const auto same = [&](const ParamDescription& other) { return same_key(d, other); };
    if (std::none_of(out->parameters.begin(), out->parameters.end(), same)) {
      out->parameters.push_back(d);
    }
  }
  // Each parser suggests its own keys for the same unknown one.
  const auto cause = [](const std::string& problem) {
    return problem.substr(0, problem.find("; did you mean"));
  };
  for (const std::string& problem : file.problems()) {
    const auto same = [&](const std::string& other) { return cause(other) == cause(problem); };
    if (std::none_of(out->problems.begin(), out->problems.end(), same)) {
      out->problems.push_back(problem);
    }
  }
}

/// The line number in "file.toml:12: ..."; 0 if absent.
int line_of(const std::string& problem, const std::string& path) {
  if (problem.compare(0, path.size() + 1, path + ":") != 0) return 0;
  return std::atoi(problem.c_str() + path.size() + 1);
}

}  // namespace

Result<Configuration> read_configuration(const std::string& path,
                                         const std::vector<std::string>& overrides) {
  Configuration out;
  // A process without a table is not used, and its mandatory keys would be reported as missing.
  Result<ParamFile> first = ParamFile::load(path, overrides);
  if (!first) return first.error();
  const bool with_gateway = first->root().has("gateway");
  const bool with_ros2_bridge = first->root().has("ros2_bridge");
  for (const Parser& parse : parsers(with_gateway, with_ros2_bridge)) {
    const Result<ParamFile> file = ParamFile::load(path, overrides);
    if (!file) return file.error();
    parse(*file);
    add(*file, &out);
  }
  std::stable_sort(out.problems.begin(), out.problems.end(),
                   [&](const std::string& a, const std::string& b) {
                     return line_of(a, path) < line_of(b, path);
                   });
  return out;
}

std::vector<ParamDescription> default_parameters() {
  Configuration out;
  for (const Parser& parse : parsers(true, true)) {
    const Result<ParamFile> file = ParamFile::parse("[process.NODE]\n[start]\n", "");
    RCS_CHECK(file);
    parse(*file);
    add(*file, &out);
  }
  return std::move(out.parameters);
}

std::vector<ParamDescription> find_parameters(const std::vector<ParamDescription>& parameters,
                                              const std::string& name) {
  std::vector<ParamDescription> exact;
  std::vector<ParamDescription> below;
  std::vector<ParamDescription> ending;
  for (const ParamDescription& p : parameters) {
    const std::string full = full_key(p.table, p.key);
    if (full == name) exact.push_back(p);
    if (full.compare(0, name.size() + 1, name + ".") == 0) below.push_back(p);
    if (ends_with(full, "." + name)) ending.push_back(p);
  }
  if (!exact.empty()) return exact;
  return below.empty() ? ending : below;
}

std::string to_toml(const std::vector<ParamDescription>& parameters, bool changed_only) {
  // Tables in the order in which they were first read; a parser may read one twice.
  std::vector<std::string> tables;
  for (const ParamDescription& p : parameters) {
    if (std::find(tables.begin(), tables.end(), p.table) == tables.end()) tables.push_back(p.table);
  }
  std::string text;
  for (const std::string& table : tables) {
    std::string keys;
    for (const ParamDescription& p : parameters) {
      if (p.table != table || (changed_only && p.origin.empty()) || p.value == "none") continue;
      keys += fmt::format("{:<44} # {}\n", fmt::format("{} = {}", p.key, p.value),
                          p.origin.empty() ? "default" : p.origin);
    }
    if (!keys.empty()) text += fmt::format("{}[{}]\n{}", text.empty() ? "" : "\n", table, keys);
  }
  return text;
}

}  // namespace rcs::cli
