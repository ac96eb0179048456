#pragma once
// A gateway as a process on a private bus (with_bus.sh), a vehicle around it, and programs that use
// DDS over loopback.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "tests/gateway/fake_vehicle.h"
#include "tests/gateway/program.h"
#include "tests/support/fresh_folder.h"

namespace rcs::gateway::test {

namespace fs = std::filesystem;
using rcs::test::fresh_folder;
using rcs::test::Program;
using rcs::test::program_path;

/// For expected messages; a loaded computer is slow.
inline constexpr Duration kPatience = from_seconds(30.0);
/// For messages that must not arrive.
inline constexpr Duration kWatch = from_seconds(3.0);

/// A vehicle with its gateway.
class GatewayLive : public testing::Test {
 protected:
  GatewayLive() : folder_(fresh_folder()) {}

  void start_gateway(const std::string& gateway_table) {
    const std::string config = (folder_ / "vehicle.toml").string();
    // A BG that is starved on a loaded computer is not tested here.
    std::ofstream(config) << "[vehicle]\nname = \"demo3\"\n"
                          << gateway_table << "[gateway.commands]\nbg_silence_ms = 20000\n";
    gateway_ = std::make_unique<Program>(std::vector<std::string>{program_path("gateway"), config},
                                         std::vector<std::string>{});
    ASSERT_TRUE(vehicle_.run_until([&] { return gateway_->has_said("running on"); }, kPatience))
        << gateway_->output();
  }

  /// An off-board program. @param keys  folder of its identity; empty: none
  static std::unique_ptr<Program> client(std::vector<std::string> args, const fs::path& keys) {
    const std::string profiles =
        std::string("file://") + std::getenv("RCS_SOURCE_DIR") + "/config/dds/";
    std::vector<std::string> environment = {"CYCLONEDDS_URI=" + profiles + "loopback.xml"};
    if (!keys.empty()) {
      environment[0] += "," + profiles + "security.xml";
      environment.push_back("RCS_KEYS=" + keys.string());
    }
    args.insert(args.begin(), {program_path("dds_client"), "-v", "demo3"});
    return std::make_unique<Program>(args, environment);
  }
  static std::unique_ptr<Program> client(std::vector<std::string> args) {
    return client(std::move(args), {});
  }

  bool takes(std::int8_t kind) {
    return vehicle_.run_until([&] { return vehicle_.has_taken(kind); }, kPatience);
  }
  bool says(Program* program, const std::string& text) {
    return vehicle_.run_until([&] { return program->has_said(text); }, kPatience);
  }
  bool ends(Program* program) {
    return vehicle_.run_until([&] { return program->status() >= 0; }, kPatience);
  }

  fs::path folder_;
  FakeVehicle vehicle_;
  std::unique_ptr<Program> gateway_;
};

inline constexpr char kUnsecured[] = "[gateway]\nunsecured = true\n";

}  // namespace rcs::gateway::test
