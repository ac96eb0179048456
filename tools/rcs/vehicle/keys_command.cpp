// rcs keys

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "tools/rcs/command.h"
#include "tools/rcs/list_option.h"
#include "tools/rcs/vehicle/key_folder.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

constexpr std::string_view kKeysName = "keys";

class Keys final : public Command {
 public:
  explicit Keys(CLI::App* rcs)
      : Command(rcs->add_subcommand(
            "keys", "Create keys and signed permissions for DDS between vehicles and operators")) {
    app()
        ->add_option("DIR", directory_, "folder of keys; created if missing")
        ->type_name("FOLDER")
        ->required();
    add_repeated(app(), "--vehicle", &vehicles_,
                 "create an identity for the gateway of this vehicle")
        ->type_name("NAME");
    add_repeated(app(), "--operator", &operators_, "create an identity that may command vehicles")
        ->type_name("NAME");
    add_repeated(app(), "--observer", &observers_, "create an identity that may only receive")
        ->type_name("NAME");
    add_repeated(app(), "--renew", &renewed_,
                 "issue a new certificate and new permissions for the key of this identity")
        ->type_name("NAME");
    add_repeated(app(), "--revoke", &revoked_,
                 "reject this identity: its certificate is added to crl.pem")
        ->type_name("NAME");
    app()
        ->add_option("--days", days_, "validity of new certificates and permissions from now")
        ->check(CLI::Range(1, 3650))
        ->capture_default_str();
    app()->add_flag("--json", json_, "print the results as JSON");
    app()->footer(
        "The name of a vehicle is [vehicle] name in its configuration, the name of an operator is\n"
        "its operator_id. Existing identities are kept, new ones added.\n"
        "Give the complete folder DIR/NAME to its owner. DIR/ca creates new identities: keep it\n"
        "private. All identities are listed with the end of their validity; status 1 if one has\n"
        "expired. A renewed identity needs its files on its computer. A revoked one is rejected "
        "by\n"
        "the vehicles and operators that have the new crl.pem and were restarted.\n"
        "Example:\n"
        "  rcs keys keys --vehicle demo3 --operator alice --observer museum\n"
        "  rcs keys keys                    # who expires when\n"
        "  rcs keys keys --renew demo3 --days 180\n"
        "  rcs keys keys --revoke alice");
  }

  int run() override {
    const bool creates = !vehicles_.empty() || !operators_.empty() || !observers_.empty();
    const Result<KeyFolder> keys =
        creates ? KeyFolder::open(directory_) : KeyFolder::open_existing(directory_);
    if (!keys) return fail(kKeysName, keys.error());
    if (keys->authorities_made() && !json_) fmt::print("made  {}/ca\n", directory_);
    const bool all = add(*keys, vehicles_, KeyRole::kVehicle) &&
                     add(*keys, operators_, KeyRole::kOperator) &&
                     add(*keys, observers_, KeyRole::kObserver) && change(*keys);
    if (!all) return kExitInput;
    const Result<std::vector<KeyIdentity>> identities = keys->identities();
    if (!identities) return fail(kKeysName, identities.error());
    if (json_) {
      print_json(keys->authorities_made(), *identities);
    } else {
      print_table(*identities);
    }
    const bool expired = std::any_of(identities->begin(), identities->end(), [](const auto& i) {
      return i.days_left <= 0.0 && !i.revoked;
    });
    return expired ? kExitNegative : kExitOk;
  }

 private:
  bool add(const KeyFolder& keys, const std::vector<std::string>& names, KeyRole role) {
    for (const std::string& name : names) {
      const Result<bool> made = keys.add(name, role, days_);
      if (!made) {
        (void)fail(kKeysName, made.error());
        return false;
      }
      if (*made) created_.insert(name);
      if (json_) continue;
      fmt::print("{}  {}/{}  {}\n", *made ? "made" : "kept", directory_, name, text(role));
    }
    return true;
  }

  bool change(const KeyFolder& keys) {
    for (const std::string& name : renewed_) {
      if (const Outcome done = keys.renew(name, days_); !done) {
        (void)fail(kKeysName, done.error());
        return false;
      }
    }
    for (const std::string& name : revoked_) {
      if (const Outcome done = keys.revoke(name); !done) {
        (void)fail(kKeysName, done.error());
        return false;
      }
    }
    if (!revoked_.empty() && !json_) {
      fmt::print(
          "copy crl.pem to each vehicle, operator and observer, and restart their programs: until "
          "then they accept the revoked identities\n");
    }
    return true;
  }

  static void print_table(const std::vector<KeyIdentity>& identities) {
    constexpr double kSoon_days = 30.0;
    report::Table table;
    table.header = {"identity", "role", "valid until (UTC)", "days", ""};
    for (const KeyIdentity& i : identities) {
      const char* const note = i.revoked                   ? "revoked"
                               : i.days_left <= 0.0        ? "EXPIRED: --renew"
                               : i.days_left <= kSoon_days ? "expires soon: --renew"
                                                           : "";
      table.rows.push_back(
          {i.name, i.role, i.valid_until, fmt::format("{:.0f}", i.days_left), note});
    }
    fmt::print("{}", report::to_text(table));
  }

  void print_json(bool authorities_made, const std::vector<KeyIdentity>& identities) const {
    report::Json list = report::Json::array();
    for (const KeyIdentity& i : identities) {
      list.push_back({{"name", i.name},
                      {"role", i.role},
                      {"created", created_.count(i.name) > 0},
                      {"valid_until", i.valid_until},
                      {"days_left", i.days_left},
                      {"revoked", i.revoked}});
    }
    const report::Json json = {
        {"folder", directory_}, {"authorities_created", authorities_made}, {"identities", list}};
    fmt::print("{}", report::json_document(kKeysName, json));
  }

  std::string directory_;
  std::vector<std::string> renewed_;
  std::vector<std::string> revoked_;
  std::set<std::string> created_;
  int days_ = KeyFolder::kDays;
  std::vector<std::string> vehicles_;
  std::vector<std::string> operators_;
  std::vector<std::string> observers_;
  bool json_ = false;
};

}  // namespace

void add_keys_command(CLI::App* rcs, Commands* commands) {
  commands->push_back(std::make_unique<Keys>(rcs));
}

}  // namespace rcs::cli
