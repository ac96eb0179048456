// The judge of stop sequences detects the violations that it is written for.

#include "tests/live_faults/stop_judge.h"

#include <gtest/gtest.h>

namespace rcs::live_faults {
namespace {

constexpr std::int64_t kBoot = 7;

class StopJudgeTest : public testing::Test {
 protected:
  static constexpr Duration kCycle = from_milliseconds(50.0);

  command_t command(std::int8_t kind, const std::string& issuer, std::vector<std::int64_t> stops) {
    now_ += Duration(1000);
    command_t m{};
    m.kind = kind;
    m.issuer = issuer;
    m.boot_id = kBoot;
    m.utime = m.serial = to_utime(now_);
    m.valid_until_utime = m.utime + 2'500'000;
    m.stop_id = std::move(stops);
    m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
    return m;
  }
  void send(std::int8_t kind, const std::string& issuer, std::vector<std::int64_t> stops) {
    judge_.take(command(kind, issuer, std::move(stops)), now_);
  }
  /// A cycle of BG.
  void cycle(bool brakes, const std::vector<std::int64_t>& listed) {
    now_ += kCycle;
    drive_t d{};
    d.publisher_id = bg_;
    d.utime = to_utime(now_);
    d.brake = d.emergency_stop = brakes ? 1 : 0;
    d.speed_mps = brakes ? 0.0 : 3.0;
    judge_.take(d, now_);
    status_t s{};
    s.publisher_id = bg_;
    for (const std::int64_t id : listed) s.stop.push_back({id, "radio"});
    s.emergency_stop = persisted_ ? status_t::STOP_PERSISTED : status_t::STOP_LATCHED;
    judge_.take(s, now_);
  }
  void moves(double speed_mps, double x_m) {
    truth_t t{};
    t.v_world_mps[0] = speed_mps;
    t.p_world_vehicle_m[0] = x_m;
    judge_.take(t);
  }
  void stop() {
    moves(3.0, 0.0);
    send(command_t::KIND_EMERGENCY_STOP, "radio", {5});
    cycle(true, {5});
    moves(0.0, 1.0);
  }
  [[nodiscard]] std::size_t breaches() const { return judge_.breaches().size(); }

  StopJudge judge_{"operator", kBoot};
  Stamp now_{std::chrono::seconds(100)};
  std::int64_t bg_ = 1;
  bool persisted_ = true;
};

TEST_F(StopJudgeTest, AStopAndItsReleaseByTheIssuerOrAnAuthorityAreInOrder) {
  for (const char* issuer : {"radio", "operator"}) {
    stop();
    cycle(true, {5});
    send(command_t::KIND_RELEASE, issuer, {5});
    cycle(true, {});
    EXPECT_FALSE(judge_.stopped());
    cycle(false, {});
    moves(3.0, 9.0);
    EXPECT_EQ(breaches(), 0U) << judge_.breaches().front();
    ++bg_;  // so that the same id is another stop
    cycle(false, {});
  }
  EXPECT_EQ(judge_.law().releases(), 2);
  EXPECT_EQ(judge_.stops_in_motion(), 2);
  EXPECT_EQ(judge_.latencies_ms().size(), 2U);
}

TEST_F(StopJudgeTest, ADriveCommandAfterTheBrake) {
  stop();
  cycle(false, {5});
  EXPECT_EQ(breaches(), 1U);
}

TEST_F(StopJudgeTest, NoBrakeWithinASecond) {
  send(command_t::KIND_EMERGENCY_STOP, "radio", {5});
  for (int k = 0; k < 19; ++k) cycle(false, {});
  EXPECT_EQ(breaches(), 0U);
  for (int k = 0; k < 5; ++k) cycle(false, {});
  EXPECT_GT(breaches(), 0U);
}

TEST_F(StopJudgeTest, MotionBeforeTheRelease) {
  stop();
  moves(0.01, 1.05);
  EXPECT_EQ(breaches(), 0U);
  moves(0.5, 1.2);
  EXPECT_EQ(breaches(), 1U);
}

TEST_F(StopJudgeTest, AStopThatEndsWithoutAValidReleaseOfItsIssuer) {
  const auto expect_breach = [this](const char* issuer, std::int64_t id, std::int64_t boot_id,
                                    std::int64_t valid_us) {
    judge_ = StopJudge("operator", kBoot);
    stop();
    command_t m = command(command_t::KIND_RELEASE, issuer, {id});
    m.boot_id = boot_id;
    m.valid_until_utime = m.utime + valid_us;
    judge_.take(m, now_);
    cycle(true, {});
    EXPECT_EQ(breaches(), 1U) << issuer << " " << id;
  };
  expect_breach("tablet", 5, kBoot, 2'500'000);
  expect_breach("radio", 6, kBoot, 2'500'000);
  expect_breach("radio", 5, kBoot + 1, 2'500'000);
  expect_breach("radio", 5, kBoot, 0);
}

TEST_F(StopJudgeTest, AStopThatWasReleasedInMotion) {
  stop();
  moves(2.0, 1.05);
  send(command_t::KIND_RELEASE, "operator", {5});
  cycle(true, {});
  EXPECT_EQ(breaches(), 1U);
}

TEST_F(StopJudgeTest, ARestartLosesAStopThatWasNotPersistedAndNoOther) {
  persisted_ = false;
  stop();
  ++bg_;
  cycle(false, {});
  EXPECT_EQ(breaches(), 0U);
  EXPECT_FALSE(judge_.stopped());
  persisted_ = true;
  stop();
  ++bg_;
  cycle(false, {});
  EXPECT_EQ(breaches(), 2U) << "a drive command, and the stop is not listed";
}

}  // namespace
}  // namespace rcs::live_faults
