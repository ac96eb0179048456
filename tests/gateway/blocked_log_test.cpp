// On a private bus (with_bus.sh): the gateway, whose stderr is full, while DDS reports programs
// without a valid identity.

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "tests/gateway/gateway_live.h"
#include "tests/support/full_pipe.h"
#include "tools/rcs/vehicle/key_folder.h"

namespace rcs::gateway {
namespace {

using rcs::test::Program;
using rcs::test::program_path;

class BlockedLog : public test::GatewayLive {};

TEST_F(BlockedLog, DelaysNoStop) {
  const Result<cli::KeyFolder> own = cli::KeyFolder::open((folder_ / "keys").string());
  const Result<cli::KeyFolder> foreign = cli::KeyFolder::open((folder_ / "foreign").string());
  ASSERT_TRUE(own.ok() && foreign.ok());
  ASSERT_TRUE(own->add("demo3", cli::KeyRole::kVehicle).ok());
  ASSERT_TRUE(own->add("alice", cli::KeyRole::kOperator).ok());
  const std::string config = (folder_ / "vehicle.toml").string();
  std::ofstream(config) << "[vehicle]\nname = \"demo3\"\n"
                           "[gateway.security]\ndirectory = \"keys/demo3\"\n"
                           "[gateway.commands]\nbg_silence_ms = 20000\n";
  const rcs::test::FullPipe pipe(folder_ / "full");
  gateway_ = std::make_unique<Program>(
      std::vector<std::string>{"/bin/sh", "-c", "exec \"$0\" \"$1\" >>\"$2\" 2>&1",
                               program_path("gateway"), config, pipe.path().string()},
      std::vector<std::string>{});
  const auto watch = client({"watch", "90"}, folder_ / "keys/alice");
  ASSERT_TRUE(says(watch.get(), "state demo3")) << watch->output();
  // Which side begins the handshake that fails, so that the other one reports it, depends on the
  // names.
  std::vector<std::unique_ptr<Program>> intruders;
  for (const char* name : {"bob", "carol", "dave", "erin", "frank", "grace"}) {
    ASSERT_TRUE(foreign->add(name, cli::KeyRole::kOperator).ok());
    intruders.push_back(
        client({"-o", name, "goto", "1", "4", "111", "0"}, folder_ / "foreign" / name));
  }
  for (const auto& intruder : intruders) ASSERT_TRUE(ends(intruder.get())) << intruder->output();
  const auto stop = client({"stop", "1", "60"}, folder_ / "keys/alice");
  EXPECT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << stop->output();
  EXPECT_TRUE(pipe.full());
  gateway_->signal(SIGTERM);
  ASSERT_TRUE(ends(gateway_.get()));
  EXPECT_EQ(gateway_->status(), 0);
}

}  // namespace
}  // namespace rcs::gateway
