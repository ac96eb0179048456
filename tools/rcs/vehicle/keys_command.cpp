// rcs keys

#include <fmt/format.h>

#include <string>
#include <vector>

#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/vehicle/key_folder.h"
#include "tools/report/json_document.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kKeysName = "keys";

class Keys final : public Command {
 public:
  explicit Keys(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "keys", "Create keys and signed permissions for DDS between vehicles and operators")) {
    app()->add_option("DIR", directory_, "folder of keys; created if missing")->required();
    add_repeated(app(), "--vehicle", &vehicles_, "an identity for the gateway of this vehicle");
    add_repeated(app(), "--operator", &operators_, "an identity that may command vehicles");
    add_repeated(app(), "--observer", &observers_, "an identity that may only receive");
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The name of a vehicle is [vehicle] name in its configuration, the name of an operator is\n"
        "its operator_id. Existing identities are kept, new ones added.\n"
        "Give the complete folder DIR/NAME to its owner. DIR/ca creates new identities: keep it\n"
        "private.\n"
        "Example:\n"
        "  rcs keys keys --vehicle demo3 --operator alice --observer museum");
  }

  int run() override {
    const Result<KeyFolder> keys = KeyFolder::open(directory_);
    if (!keys) return fail(kKeysName, keys.error());
    if (keys->authorities_made() && !json_) fmt::print("made  {}/ca\n", directory_);
    const bool all = add(*keys, vehicles_, KeyRole::kVehicle) &&
                     add(*keys, operators_, KeyRole::kOperator) &&
                     add(*keys, observers_, KeyRole::kObserver);
    if (!all) return kExitInput;
    if (json_) {
      const report::Json json = {{"folder", directory_},
                                 {"authorities_created", keys->authorities_made()},
                                 {"identities", identities_}};
      fmt::print("{}", report::json_document(kKeysName, json));
    }
    return kExitOk;
  }

 private:
  bool add(const KeyFolder& keys, const std::vector<std::string>& names, KeyRole role) {
    for (const std::string& name : names) {
      const Result<bool> made = keys.add(name, role);
      if (!made) {
        (void)fail(kKeysName, made.error());
        return false;
      }
      identities_.push_back({{"name", name}, {"role", text(role)}, {"created", *made}});
      if (json_) continue;
      fmt::print("{}  {}/{}  {}\n", *made ? "made" : "kept", directory_, name, text(role));
    }
    return true;
  }

  std::string directory_;
  std::vector<std::string> vehicles_;
  std::vector<std::string> operators_;
  std::vector<std::string> observers_;
  bool json_ = false;
  report::Json identities_ = report::Json::array();
};

}  // namespace

void add_keys_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Keys>(rcs));
}

}  // namespace rcs::cli
