// On a private bus (with_bus.sh): the gateway as a process, a vehicle around it, and programs that
// use DDS over loopback.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>

#include "modules/gateway/operator_commands.h"
#include "tests/gateway/gateway_live.h"
#include "tools/rcs/vehicle/key_folder.h"

namespace rcs::gateway {
namespace {

namespace fs = std::filesystem;
using rcs::test::Program;
using rcs::test::program_path;
using test::GatewayLive;
using test::kPatience;
using test::kUnsecured;
using test::kWatch;

TEST_F(GatewayLive, StateAndNodeStatusArePublishedAtTheirRates) {
  start_gateway(kUnsecured);
  const auto watch = client({"watch", "4"});
  ASSERT_TRUE(ends(watch.get()));
  const std::string& seen = watch->output();
  EXPECT_NE(seen.find("datum 39.125000 -77.250000"), std::string::npos) << seen;
  EXPECT_NE(seen.find("node demo3 wm alive 1 overruns 3 state \"running\""), std::string::npos)
      << seen;
  EXPECT_NE(seen.find("node demo3 bg alive 1 overruns 0 state \"at rest\""), std::string::npos);
  EXPECT_NE(seen.find("node demo3 sp alive 0"), std::string::npos);
  EXPECT_NE(seen.find("node demo3 gateway alive 1 overruns 0 state \"unsecured; idle\""),
            std::string::npos);
  const std::size_t at = seen.find(" rate ");
  ASSERT_NE(at, std::string::npos) << seen;
  const double rate_hz = std::stod(seen.substr(at + 6));
  std::printf("[  RATE    ] VehicleState %.2f Hz of 10\n", rate_hz);
  EXPECT_LT(rate_hz, 15.0);
  // On a loaded computer cycles are lost, but no additional states: every second cycle publishes.
  gateway_->signal(SIGTERM);
  ASSERT_TRUE(ends(gateway_.get()));
  EXPECT_EQ(gateway_->status(), 0) << gateway_->output();
  const std::string& account = gateway_->output();
  const double cycles = std::stod(account.substr(account.rfind("gateway: ") + 9));
  const double states = std::stod(seen.substr(seen.rfind(" seq ") + 5));
  EXPECT_GT(states, 0.3 * cycles) << account;
  EXPECT_TRUE(gateway_->has_said("dds.unsecured")) << gateway_->output();
}

TEST_F(GatewayLive, AnInvalidPoseIsNotPublished) {
  start_gateway(kUnsecured);
  const auto before = client({"watch", "2"});
  ASSERT_TRUE(ends(before.get()));
  EXPECT_FALSE(before->has_said("states 0 ")) << before->output();
  vehicle_.set_pose_valid(false);
  vehicle_.run_for(from_seconds(1.0));
  const auto after = client({"watch", "2"});
  ASSERT_TRUE(ends(after.get()));
  EXPECT_TRUE(after->has_said("states 0 ")) << after->output();
}

TEST_F(GatewayLive, AWaypointCommandArrivesIsRefreshedAndEndsWithItsOperator) {
  start_gateway(kUnsecured);
  auto alice = client({"-s", "4", "goto", "7", "60", "10", "0", "20", "5"});
  ASSERT_TRUE(takes(command_t::KIND_GOTO)) << gateway_->output();
  const command_t first = vehicle_.commands().front();
  EXPECT_EQ(first.issuer, "gateway");
  EXPECT_EQ(first.frame, +command_t::FRAME_WORLD);
  ASSERT_EQ(first.n, 2);
  EXPECT_EQ(first.waypoint[1].p_m[0], 20.0);
  EXPECT_EQ(first.waypoint[1].p_m[1], 5.0);
  EXPECT_EQ(first.waypoint[0].speed_mps, 4.0);

  ASSERT_TRUE(vehicle_.run_until([&] { return vehicle_.commands().size() >= 4; }, kPatience));
  std::int64_t last_serial = 0;
  for (const command_t& c : vehicle_.commands()) {
    EXPECT_GT(c.serial, last_serial);
    EXPECT_LE(c.valid_until_utime - c.utime, 2'500'000);
    EXPECT_EQ(c.waypoint.size(), 2U);
    last_serial = c.serial;
  }

  alice->signal(SIGKILL);
  ASSERT_TRUE(vehicle_.run_until([&] { return !vehicle_.commanded(); }, kPatience));
  const std::size_t taken = vehicle_.commands().size();
  vehicle_.run_for(kWatch);
  EXPECT_EQ(vehicle_.commands().size(), taken) << "commands of a silent operator are not refreshed";
  EXPECT_TRUE(gateway_->has_said("operator.silent")) << gateway_->output();
}

TEST_F(GatewayLive, AnEmergencyStopIsLatchedUntilItsReleaseAndOutlivesItsSender) {
  start_gateway(kUnsecured);
  const auto bobs = client({"-o", "bob", "goto", "1", "60", "10", "0"});
  ASSERT_TRUE(takes(command_t::KIND_GOTO));
  const auto stop = client({"stop", "1", "0.5"});
  ASSERT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
  ASSERT_TRUE(ends(stop.get()));
  EXPECT_EQ(stop->status(), 0) << stop->output();

  const auto other = client({"-o", "carol", "release", "9", "1"});
  const auto more = client({"-o", "bob", "goto", "2", "2", "10", "0"});
  ASSERT_TRUE(ends(other.get()) && ends(more.get()));
  EXPECT_FALSE(vehicle_.has_taken(command_t::KIND_RELEASE)) << "carol has not engaged a stop";
  EXPECT_EQ(vehicle_.commands().back().kind, +command_t::KIND_EMERGENCY_STOP);
  EXPECT_TRUE(vehicle_.stopped());

  const auto release = client({"release", "2", "1"});
  ASSERT_TRUE(takes(command_t::KIND_RELEASE)) << gateway_->output();
  ASSERT_TRUE(ends(release.get()));
  vehicle_.run_for(from_seconds(1.0));
  EXPECT_EQ(vehicle_.commands().back().kind, +command_t::KIND_RELEASE)
      << "bob's old command, still repeated, must not resume by itself";
  EXPECT_FALSE(vehicle_.stopped()) << "the release names the stop of the gateway";
  const auto again = client({"-o", "bob", "goto", "3", "60", "10", "0"});
  EXPECT_TRUE(vehicle_.run_until(
      [&] { return vehicle_.commands().back().kind == command_t::KIND_GOTO; }, kPatience));
}

TEST_F(GatewayLive, TasksGoToTheMissionAndStopsToBg) {
  start_gateway("[gateway]\nunsecured = true\ntasks = true\nnodes = [\"bg\", \"mission\"]\n");
  const auto last_task = [&] {
    return vehicle_.tasks().empty() ? -1 : static_cast<int>(vehicle_.tasks().back().kind);
  };
  const auto gets_task = [&](std::int8_t kind) {
    return vehicle_.run_until([&] { return last_task() == kind; }, kPatience);
  };
  const auto follow = client({"follow", "1", "60", "10", "0", "20", "5"});
  ASSERT_TRUE(gets_task(command_t::KIND_FOLLOW)) << gateway_->output();
  EXPECT_EQ(vehicle_.tasks().back().waypoint.size(), 2U);
  EXPECT_EQ(vehicle_.tasks().back().task, 1);
  EXPECT_TRUE(vehicle_.commands().empty()) << "BG is commanded by the mission";
  const auto watch = client({"watch", "2"});
  ASSERT_TRUE(ends(watch.get()));
  EXPECT_TRUE(watch->has_said("node demo3 mission alive 1 overruns 0 state \"DRIVING\""))
      << watch->output();

  follow->signal(SIGKILL);
  const auto halt = client({"halt", "2", "1"});
  ASSERT_TRUE(gets_task(command_t::KIND_HALT)) << gateway_->output();
  EXPECT_TRUE(takes(command_t::KIND_HALT)) << "BG halts without waiting for the mission";
  const auto back = client({"return", "3", "60"});
  ASSERT_TRUE(gets_task(command_t::KIND_RETURN)) << gateway_->output();

  const auto stop = client({"-o", "bob", "stop", "1", "0.5"});
  ASSERT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
  EXPECT_TRUE(gets_task(command_t::KIND_EMERGENCY_STOP)) << "the mission holds, too";
  const auto release = client({"-o", "bob", "release", "2", "1"});
  ASSERT_TRUE(takes(command_t::KIND_RELEASE)) << gateway_->output();
  vehicle_.run_for(kWatch);
  EXPECT_NE(last_task(), +command_t::KIND_RETURN) << "the old task must not resume by itself";
}

TEST_F(GatewayLive, ATaskForAVehicleWithoutMissionIsRejected) {
  start_gateway(kUnsecured);
  const auto back = client({"return", "1", "2"});
  EXPECT_TRUE(says(gateway_.get(), std::string(text(Refusal::kNoMission)))) << gateway_->output();
}

TEST_F(GatewayLive, AStopEngagedWhileTheGatewayWasDownTakesEffect) {
  const auto stop = client({"stop", "1", "60"});
  start_gateway(kUnsecured);
  EXPECT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
}

TEST_F(GatewayLive, AfterARestartTheStopsInForceAreThoseOfTheirOperators) {
  start_gateway(kUnsecured);
  const auto stop = client({"stop", "1", "0.5"});
  ASSERT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
  EXPECT_EQ(vehicle_.commands().back().issuer, "gateway:alice");
  ASSERT_TRUE(ends(stop.get()));
  gateway_->signal(SIGKILL);
  ASSERT_TRUE(ends(gateway_.get()));
  start_gateway(kUnsecured);
  const auto bobs = client({"-o", "bob", "stop", "1", "0.5"});
  ASSERT_TRUE(ends(bobs.get()));
  const auto release = client({"-o", "bob", "release", "2", "2"});
  ASSERT_TRUE(ends(release.get()));
  vehicle_.run_for(from_seconds(1.0));
  EXPECT_TRUE(vehicle_.stopped()) << "alice has not released it";
  EXPECT_FALSE(vehicle_.has_taken(command_t::KIND_RELEASE));
  const auto by_alice = client({"release", "2", "2"});
  ASSERT_TRUE(takes(command_t::KIND_RELEASE)) << gateway_->output();
  vehicle_.run_for(from_seconds(1.0));
  EXPECT_FALSE(vehicle_.stopped());
}

// Its samples would displace those of the operator that have not been read.
TEST_F(GatewayLive, AWriterInTheNameOfAnotherIsRefusedBeforeItsSamplesAreStored) {
  start_gateway(kUnsecured);
  const auto watch = client({"watch", "60"});
  const auto forger = client({"-o", "alice", "-p", "mallory", "release", "10", "60"});
  EXPECT_TRUE(says(watch.get(), "EmergencyStop 0 of an unauthorized operator")) << watch->output();
  const auto stop = client({"stop", "1", "0.5"});
  EXPECT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
  EXPECT_EQ(vehicle_.commands().back().issuer, "gateway:alice");
}

TEST_F(GatewayLive, HostileCommandsAreRejectedAndCounted) {
  start_gateway(kUnsecured);
  const auto watch = client({"watch", "120"});
  struct Case {
    std::vector<std::string> args;
    Refusal refusal;
    int status = 0;
  };
  const Case cases[] = {
      {{"goto", "1", "1", "nan", "0"}, Refusal::kNotFinite},
      {{"goto", "2", "1", "1e300", "0"}, Refusal::kPosition},
      {{"-n", "250", "goto", "3", "1", "10", "0"}, Refusal::kCount},
      {{"-f", "-2000", "goto", "4", "1", "10", "0"}, Refusal::kValidFor},
      {{"-f", "2000000000", "goto", "5", "1", "10", "0"}, Refusal::kValidFor},
      {{"-s", "400", "goto", "6", "1", "10", "0"}, Refusal::kSpeed},
      {{"goto", "-7", "1", "10", "0"}, Refusal::kCommandId},
      {{"-p", "mallory", "goto", "8", "1", "10", "0"}, Refusal::kOperator},
      // Two patterns do not match: no reader receives it.
      {{"-p", "*", "goto", "9", "1", "10", "0"}, Refusal::kOperator, 1},
      {{"-p", "mallory", "release", "10", "1"}, Refusal::kOperator},
  };
  for (const Case& c : cases) {
    const auto hostile = client(c.args);
    EXPECT_TRUE(says(watch.get(), std::string(text(c.refusal)))) << watch->output();
    ASSERT_TRUE(ends(hostile.get()));
    EXPECT_EQ(hostile->status(), c.status) << hostile->output();
  }
  EXPECT_TRUE(vehicle_.commands().empty());
  EXPECT_TRUE(gateway_->has_said("command.rejected")) << gateway_->output();
  EXPECT_LT(gateway_->status(), 0) << "it still runs";
}

TEST_F(GatewayLive, AFloodOfCommandsBlocksNoStop) {
  // More operators than the reader of the commands keeps: a reliable reader would delay the stops
  // behind them.
  start_gateway(kUnsecured);
  const auto flood = client({"-o", "mallory", "flood", "60"});
  ASSERT_TRUE(says(gateway_.get(), "command.rejected")) << "the flood has arrived";
  vehicle_.run_for(from_seconds(1.0));
  const double before_mb = gateway_->memory_mb();
  vehicle_.run_for(from_seconds(5.0));
  const Stamp begin = vehicle_.now();
  const auto stop = client({"stop", "1", "60"});
  EXPECT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
  const double after_mb = gateway_->memory_mb();
  std::printf(
      "[  FLOOD   ] stop after %.2f s, start of its program included; memory %.1f -> %.1f MB\n",
      seconds(vehicle_.now() - begin), before_mb, after_mb);
  // A release of an ever new operator is no instance of the gateway's reader.
  EXPECT_LT(after_mb, before_mb + 10.0);
  gateway_->signal(SIGTERM);
  ASSERT_TRUE(ends(gateway_.get()));
  EXPECT_EQ(gateway_->status(), 0) << gateway_->output();
  const std::string& account = gateway_->output();
  std::printf("[  FLOOD   ] %s\n",
              account.substr(account.find("gateway: ", account.find("command.rejected"))).c_str());
}

TEST_F(GatewayLive, WithKeysEachIdentityHasItsRightsAndNoMore) {
  const fs::path keys = folder_ / "keys";
  const fs::path foreign = folder_ / "foreign";
  for (const fs::path& authority : {keys, foreign}) {
    const Result<cli::KeyFolder> made = cli::KeyFolder::open(authority.string());
    ASSERT_TRUE(made.ok()) << made.error().message;
    ASSERT_TRUE(made->add("demo3", cli::KeyRole::kVehicle).ok());
    ASSERT_TRUE(made->add("alice", cli::KeyRole::kOperator).ok());
    ASSERT_TRUE(made->add("bob", cli::KeyRole::kOperator).ok());
    ASSERT_TRUE(made->add("museum", cli::KeyRole::kObserver).ok());
    ASSERT_TRUE(made->add("mallory", cli::KeyRole::kOperator).ok());
    // A revoked participant does not use a list that names itself.
    const fs::path list = authority / "mallory/crl.pem";
    const fs::path former = authority.string() + "_former_crl.pem";
    fs::copy_file(list, former);
    ASSERT_TRUE(made->revoke("mallory").ok());
    fs::copy_file(former, list, fs::copy_options::overwrite_existing);
  }
  fs::copy(keys / "museum", folder_ / "tampered", fs::copy_options::recursive);
  fs::remove(folder_ / "tampered/permissions.p7s");
  {
    std::ifstream in(keys / "museum/permissions.p7s");
    std::string rights((std::istreambuf_iterator<char>(in)), {});
    rights.replace(rights.find("<subscribe>"), 11, "<publish>  ");
    std::ofstream(folder_ / "tampered/permissions.p7s") << rights;
  }
  start_gateway("[gateway.security]\ndirectory = \"keys/demo3\"\n");
  EXPECT_TRUE(says(gateway_.get(), "1 revoked in crl.pem; valid until")) << gateway_->output();

  // Identities without rights run next to one with rights, so that a silent network cannot hide a
  // failure.
  const auto plain_watch = client({"watch", "6"});
  const auto plain_goto = client({"goto", "1", "6", "111", "0"});
  const auto plain_stop = client({"stop", "1", "6"});
  const auto foreign_watch = client({"watch", "6"}, foreign / "alice");
  const auto foreign_goto = client({"goto", "1", "6", "112", "0"}, foreign / "alice");
  const auto observer_watch = client({"watch", "60"}, keys / "museum");
  const auto observer_goto = client({"goto", "1", "6", "113", "0"}, keys / "museum");
  const auto bob_as_alice = client({"-o", "alice", "goto", "9", "6", "114", "0"}, keys / "bob");
  const auto revoked_goto =
      client({"-o", "mallory", "goto", "1", "6", "115", "0"}, keys / "mallory");
  const auto tampered = client({"watch", "1"}, folder_ / "tampered");
  const auto alice_watch = client({"watch", "60"}, keys / "alice");
  EXPECT_TRUE(says(alice_watch.get(), "state demo3")) << alice_watch->output();
  EXPECT_TRUE(says(observer_watch.get(), "state demo3")) << observer_watch->output();
  for (Program* const p : {plain_watch.get(), plain_goto.get(), plain_stop.get(),
                           foreign_watch.get(), foreign_goto.get(), observer_goto.get(),
                           bob_as_alice.get(), revoked_goto.get(), tampered.get()}) {
    ASSERT_TRUE(ends(p)) << p->output();
  }
  EXPECT_TRUE(vehicle_.commands().empty());
  EXPECT_TRUE(plain_watch->has_said("states 0 ")) << plain_watch->output();
  EXPECT_FALSE(plain_watch->has_said("node "));
  EXPECT_TRUE(plain_goto->has_said("readers 0")) << plain_goto->output();
  EXPECT_FALSE(plain_goto->has_said("readers 1"));
  EXPECT_FALSE(plain_stop->has_said("readers 1"));
  EXPECT_TRUE(foreign_watch->has_said("states 0 ")) << foreign_watch->output();
  EXPECT_FALSE(foreign_watch->has_said("node "));
  EXPECT_FALSE(foreign_goto->has_said("readers 1")) << foreign_goto->output();
  EXPECT_FALSE(revoked_goto->has_said("readers 1")) << revoked_goto->output();
  EXPECT_TRUE(revoked_goto->has_said("was revoked")) << revoked_goto->output();
  EXPECT_EQ(revoked_goto->status(), 1) << "no vehicle has received it";
  EXPECT_TRUE(observer_goto->has_said("Not Allowed By Security")) << observer_goto->output();
  EXPECT_TRUE(bob_as_alice->has_said("Not Allowed By Security")) << bob_as_alice->output();
  EXPECT_TRUE(tampered->has_said("refused: no participant")) << tampered->output();
  EXPECT_TRUE(alice_watch->has_said("secured; idle")) << alice_watch->output();

  const auto alice = client({"goto", "1", "60", "10", "0"}, keys / "alice");
  EXPECT_TRUE(takes(command_t::KIND_GOTO)) << gateway_->output();
  const auto bob = client({"-o", "bob", "stop", "1", "60"}, keys / "bob");
  EXPECT_TRUE(takes(command_t::KIND_EMERGENCY_STOP)) << gateway_->output();
}

TEST_F(GatewayLive, ARevokedVehicleIsRejectedByOperatorsWithTheNewList) {
  const fs::path keys = folder_ / "keys";
  const Result<cli::KeyFolder> made = cli::KeyFolder::open(keys.string());
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_TRUE(made->add("demo3", cli::KeyRole::kVehicle).ok());
  ASSERT_TRUE(made->add("alice", cli::KeyRole::kOperator).ok());
  fs::copy(keys / "alice", folder_ / "former", fs::copy_options::recursive);
  fs::remove(keys / "demo3/crl.pem");
  start_gateway("[gateway.security]\ndirectory = \"keys/demo3\"\n");
  EXPECT_TRUE(says(gateway_.get(), "no revocation list")) << gateway_->output();
  ASSERT_TRUE(made->revoke("demo3").ok());
  const auto watch = client({"watch", "10"}, keys / "alice");
  const auto former = client({"watch", "10"}, folder_ / "former");
  EXPECT_TRUE(says(former.get(), "state demo3")) << former->output();
  ASSERT_TRUE(ends(watch.get()));
  EXPECT_TRUE(watch->has_said("states 0 ")) << watch->output();
  EXPECT_FALSE(watch->has_said("node "));
}

TEST_F(GatewayLive, WithoutKeysAndNotUnsecuredItDoesNotStart) {
  const std::string config = (folder_ / "vehicle.toml").string();
  std::ofstream(config) << "[vehicle]\nname = \"demo3\"\n[gateway]\n";
  Program gateway({program_path("gateway"), config}, {});
  ASSERT_TRUE(ends(&gateway));
  EXPECT_EQ(gateway.status(), 3);
  EXPECT_TRUE(gateway.has_said("unsecured = true")) << gateway.output();

  std::ofstream(config) << "[vehicle]\nname = \"demo3\"\n"
                           "[gateway.security]\ndirectory = \"nowhere\"\n";
  Program keyless({program_path("gateway"), config}, {});
  ASSERT_TRUE(ends(&keyless));
  EXPECT_EQ(keyless.status(), 3);
  EXPECT_TRUE(keyless.has_said("identity_ca.pem: missing or not readable")) << keyless.output();
}

TEST_F(GatewayLive, APrivateKeyThatOthersCanReadIsRefused) {
  const Result<cli::KeyFolder> made = cli::KeyFolder::open((folder_ / "keys").string());
  ASSERT_TRUE(made.ok()) << made.error().message;
  ASSERT_TRUE(made->add("demo3", cli::KeyRole::kVehicle).ok());
  const fs::path key = folder_ / "keys/demo3/key.pem";
  fs::permissions(key, fs::perms(0644));
  const std::string config = (folder_ / "vehicle.toml").string();
  std::ofstream(config) << "[vehicle]\nname = \"demo3\"\n"
                           "[gateway.security]\ndirectory = \"keys/demo3\"\n";
  Program gateway({program_path("gateway"), config}, {});
  ASSERT_TRUE(ends(&gateway));
  EXPECT_EQ(gateway.status(), 3);
  EXPECT_TRUE(gateway.has_said("key.pem: mode 0644 allows others to read")) << gateway.output();
}

}  // namespace
}  // namespace rcs::gateway
