// rcs config

#include <fmt/format.h>

#include <string>
#include <vector>

#include "rcs/base/printable.h"
#include "rcs/base/text.h"
#include "rcs/command_line/config_files.h"
#include "rcs/node/params/param_text.h"
#include "tools/base/files.h"
#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/vehicle/configuration.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kConfigName = "config";

std::string range_of(const ParamDescription& p) {
  if (p.range) return fmt::format("[{}, {}]", p.range->min, p.range->max);
  return fmt::format("{}", fmt::join(p.allowed, "|"));
}

report::Json to_json(const ParamDescription& p) {
  report::Json out{{"key", full_key(p.table, p.key)},
                   {"type", p.type},
                   {"default", p.value},
                   {"unit", unit_of(p.key)},
                   {"meaning", p.meaning}};
  if (p.range) out["range"] = {p.range->min, p.range->max};
  if (!p.allowed.empty()) out["allowed"] = p.allowed;
  return out;
}

void print_json(std::string_view command, const std::vector<ParamDescription>& parameters) {
  report::Json out = {{"parameters", report::Json::array()}};
  for (const ParamDescription& p : parameters) out["parameters"].push_back(to_json(p));
  fmt::print("{}", report::json_document(command, out));
}

class List final : public Command {
 public:
  explicit List(CLI::App* config)
      : Command(config->add_subcommand("list",
                                       "List the keys of a configuration with default and range,"
                                       " one per line")) {
    app()
        ->add_option("TABLE", table_, "only this table or key, e.g. sp.icp or gate_m")
        ->type_name("NAME");
    app()->add_flag("--json", json_, "print JSON, including the descriptions");
    app()->footer("Example:\n  rcs config list sp.icp");
  }

  int run() override {
    std::vector<ParamDescription> parameters = default_parameters();
    if (!table_.empty()) {
      parameters = find_parameters(parameters, table_);
      if (parameters.empty()) {
        return wrong_usage(kConfigName, Error{"no key or table " + table_});
      }
    }
    if (json_) {
      print_json("config list", parameters);
      return kExitOk;
    }
    for (const ParamDescription& p : parameters) {
      fmt::print("{:<46} {:<22} {}\n", full_key(p.table, p.key), p.value, range_of(p));
    }
    return kExitOk;
  }

 private:
  std::string table_;
  bool json_ = false;
};

class Explain final : public Command {
 public:
  explicit Explain(CLI::App* config)
      : Command(config->add_subcommand(
            "explain", "Explain a key: meaning, type, unit, range, default, effect of a change")) {
    app()
        ->add_option("KEY", keys_, "full key (sp.icp.gate_m), short key (gate_m) or table")
        ->type_name("NAME")
        ->required();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer("Example:\n  rcs config explain wm.history.bridge_ms");
  }

  int run() override {
    const std::vector<ParamDescription> parameters = default_parameters();
    std::vector<std::string> names;
    for (const ParamDescription& p : parameters) {
      names.push_back(full_key(p.table, p.key));
      names.push_back(p.key);
    }
    int status = kExitOk;
    std::vector<ParamDescription> all;
    for (const std::string& key : keys_) {
      const std::vector<ParamDescription> found = find_parameters(parameters, key);
      if (found.empty()) {
        status = wrong_usage(kConfigName, Error{"no key or table " + key + suggestion(key, names)});
      }
      all.insert(all.end(), found.begin(), found.end());
    }
    if (json_ && status == kExitOk) {
      print_json("config explain", all);
    } else if (!json_) {
      for (const ParamDescription& p : all) print(p);
    }
    return status;
  }

 private:
  static void print(const ParamDescription& p) {
    fmt::print("{}\n{}\n  type     {}{}\n", full_key(p.table, p.key),
               wrapped(fmt::format("  {}", p.meaning), 2), p.type, unit_of(p.key));
    if (const std::string range = range_of(p); !range.empty()) {
      fmt::print("  {:<8} {}\n", p.range ? "range" : "one of", range);
    }
    fmt::print("  default  {}\n\n", p.value);
  }

  std::vector<std::string> keys_;
  bool json_ = false;
};

class Check final : public Command {
 public:
  explicit Check(CLI::App* config)
      : Command(config->add_subcommand(
            "check", "Check vehicle configurations and print all errors with file and line")) {
    app()->add_option("FILE", files_, "configurations of vehicles")->type_name("FILE")->required();
    app()->footer("Example:\n  rcs config check config/demo3.toml config/kitti.toml");
    add_repeated(app(), "--set", &overrides_, "value (TOML) of a key, instead of that of the file")
        ->type_name("TABLE.KEY=VALUE");
    app()->add_flag("--json", json_, "print the results as JSON");
  }

  int run() override {
    bool valid = true;
    report::Json out = {{"files", report::Json::array()}};
    for (const std::string& file : files_) {
      const std::string path = command_line::find_config(file);
      const Result<Configuration> read = read_configuration(path, overrides_);
      if (!read && !tools::read_text(path)) return fail(kConfigName, read.error());
      const std::vector<std::string> problems =
          read ? read->problems : std::vector<std::string>{read.error().message};
      valid = valid && problems.empty();
      out["files"].push_back({{"file", path}, {"problems", problems}});
      if (json_) continue;
      for (const std::string& problem : problems) fmt::print("{}\n", printable(problem));
      if (problems.empty()) fmt::print("{}: no errors\n", path);
    }
    if (json_) fmt::print("{}", report::json_document("config check", out));
    return valid ? kExitOk : kExitNegative;
  }

 private:
  std::vector<std::string> files_;
  std::vector<std::string> overrides_;
  bool json_ = false;
};

class Show final : public Command {
 public:
  explicit Show(CLI::App* config)
      : Command(config->add_subcommand(
            "show", "Show the effective values of a configuration and the source of each")) {
    app()->add_option("FILE", file_, "configuration of a vehicle")->type_name("FILE")->required();
    add_repeated(app(), "--set", &overrides_, "value (TOML) of a key, instead of that of the file")
        ->type_name("TABLE.KEY=VALUE");
    app()->add_flag("--changed", changed_, "only values that the file or --set sets");
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer("Example:\n  rcs config show config/demo3.toml --changed");
  }

  int run() override {
    const Result<Configuration> read =
        read_configuration(command_line::find_config(file_), overrides_);
    if (!read) return fail(kConfigName, read.error());
    for (const std::string& problem : read->problems) {
      fmt::print(stderr, "rcs config: {}\n", problem);
    }
    if (json_) {
      print_json(*read);
    } else {
      fmt::print("{}", to_toml(read->parameters, changed_));
    }
    return read->problems.empty() ? kExitOk : kExitInput;
  }

 private:
  void print_json(const Configuration& configuration) const {
    report::Json out = {{"file", file_},
                        {"problems", configuration.problems},
                        {"parameters", report::Json::array()}};
    for (const ParamDescription& p : configuration.parameters) {
      if ((changed_ && p.origin.empty()) || p.value == "none") continue;
      out["parameters"].push_back({{"key", full_key(p.table, p.key)},
                                   {"value", p.value},
                                   {"source", p.origin.empty() ? "default" : p.origin}});
    }
    fmt::print("{}", report::json_document("config show", out));
  }

  std::string file_;
  std::vector<std::string> overrides_;
  bool changed_ = false;
  bool json_ = false;
};

}  // namespace

void add_config_commands(CLI::App* rcs, Commands* commands) {
  CLI::App* config =
      rcs->add_subcommand("config", "List, explain, check and show the parameters of a vehicle");
  config->require_subcommand(1);
  config->footer(
      "Examples:\n"
      "  rcs config list sp.icp\n"
      "  rcs config explain wm.history.bridge_ms\n"
      "  rcs config check config/*.toml\n"
      "  rcs config show config/demo3.toml --changed");
  commands->push_back(std::make_unique<List>(config));
  commands->push_back(std::make_unique<Explain>(config));
  commands->push_back(std::make_unique<Check>(config));
  commands->push_back(std::make_unique<Show>(config));
}

}  // namespace rcs::cli
