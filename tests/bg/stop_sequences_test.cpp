// Random command sequences around emergency stops, in lockstep: stops and releases of three
// issuers, kills of BG, power failures, and expired, replayed, forged and future commands. In each
// of them only full brake is commanded from the cycle of a stop on, and once at rest the vehicle
// does not move before a release by the issuer of the stop or by an authority.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tests/bg/bg_life.h"
#include "tests/bg/stop_sequence.h"
#include "tests/support/fresh_folder.h"

namespace rcs::bg {
namespace {

namespace fs = std::filesystem;
using test::DrawnEvent;
using test::kGoto;
using test::kRelease;
using test::Life;
using test::SequenceDraw;
using test::StopLaw;

constexpr int kSequences = 1000;
constexpr int kSteps = 50;
constexpr Duration kCycle = from_milliseconds(50.0);
constexpr Duration kReleaseWithin = from_milliseconds(225.0);  // BG may wait behind a stop
const std::vector<std::string> kIssuers = {"operator", "gateway",
                                           "radio"};  // only the first is an authority

/// Plans less than on a vehicle: the test is about stops.
BgConfig quick() {
  BgConfig config;
  config.plan_period = from_milliseconds(500.0);
  config.grant.cap = 1000;
  return config;
}

/// What all sequences together contain, so that the law is not kept by vehicles that never drive.
struct Seen {
  int stops_in_motion = 0;
  int releases = 0;
  int kills_while_stopped = 0;
};

class RandomSequence {
 public:
  RandomSequence(unsigned seed, const fs::path& folder, Seen* seen)
      : draw_(seed, kIssuers,
              [this](std::int8_t kind, const std::string& issuer) {
                now_ += Duration(1);
                return life_->command(kind, issuer);
              }),
        law_(kIssuers[0], kReleaseWithin),
        file_((folder / "v.stop").string()),
        seen_(seen) {
    start();
  }

  void run() {
    for (int step = 0; step < kSteps && !testing::Test::HasFailure(); ++step) {
      if (step < kSteps / 3 ? draw_.below(4) == 0 : draw_.below(2) == 0) happen();
      cycle();
    }
    if (!testing::Test::HasFailure()) end_well();
  }

 private:
  void start() {
    Result<StopLatch> latch = StopLatch::open(file_);
    ASSERT_TRUE(latch.ok());
    life_ = std::make_unique<Life>(file_, std::move(latch).value(), &now_, boot_, quick());
    life_->world = life_->moves = true;
    life_->speed_mps = speed_mps_;
    life_->x_m = x_m_;
    law_.restarted(boot_, false);  // a command that had not been delivered is lost
  }
  /// The vehicle stops by itself meanwhile.
  void die(int cycles) {
    if (!law_.in_force().empty()) ++seen_->kills_while_stopped;
    speed_mps_ = life_->speed_mps;
    x_m_ = life_->x_m;
    life_.reset();
    for (; cycles > 0; --cycles) {
      now_ += kCycle;
      speed_mps_ -= std::clamp(speed_mps_, -0.2, 0.2);
      x_m_ += 0.05 * speed_mps_;
    }
    start();
  }

  void send(const command_t& m) {
    const std::size_t before = law_.in_force().size();
    law_.take(m, now_);
    if (law_.in_force().size() > before && std::abs(life_->speed_mps) > 0.3) {
      ++seen_->stops_in_motion;
    }
    draw_.remember(m);
    life_->send(m);
  }

  void happen() {
    const DrawnEvent e = draw_.draw(law_.in_force().size());
    if (e.kind == DrawnEvent::Kind::kSend) send(e.command);
    if (e.kind != DrawnEvent::Kind::kKill) return;
    boot_ += draw_.below(2);  // killed, or the computer was restarted
    die(1 + draw_.below(20));
  }

  void cycle() {
    const double before_mps = life_->speed_mps;
    const double before_m = life_->x_m;
    const bool stopped = !law_.in_force().empty();
    life_->cycle();
    if (stopped) {
      EXPECT_TRUE(life_->brakes());
      ASSERT_TRUE(life_->drive);
      EXPECT_EQ(life_->drive->emergency_stop, 1);
      EXPECT_TRUE(before_mps != 0.0 || life_->x_m == before_m) << "moves";
    }
    const int releases = law_.releases();
    law_.take(life_->status, now_, std::abs(before_mps) < 0.15);
    seen_->releases += law_.releases() - releases;
    EXPECT_TRUE(law_.lost().empty());
    for (const auto& [id, stop] : law_.in_force()) EXPECT_TRUE(stop.listed) << stop.issuer;
    if (law_.in_force().empty()) return;
    EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
    EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_PERSISTED);
  }

  /// After all of it an authority can release, and the vehicle drives.
  void end_well() {
    for (int k = 0; k < 60; ++k) cycle();
    now_ += Duration(1);
    send(life_->command(kRelease, kIssuers[0]));
    cycle();
    EXPECT_EQ(life_->status.state, "RELEASED");
    EXPECT_TRUE(law_.in_force().empty());
    for (int k = 0; k < 20; ++k) {
      now_ += Duration(1);
      if (k % 10 == 0) life_->send(life_->command(kGoto, kIssuers[0]));
      cycle();
    }
    EXPECT_NE(life_->speed_mps, 0.0) << life_->status.state << ": " << life_->status.reason;
  }

  Stamp now_{std::chrono::seconds(100)};
  SequenceDraw draw_;
  StopLaw law_;
  std::string file_;
  Seen* seen_;
  std::int64_t boot_ = 1;
  double speed_mps_ = 0.0;
  double x_m_ = 0.0;
  std::unique_ptr<Life> life_;
};

TEST(BgStopSequences, NoMotionBeforeAReleaseByItsIssuerOrAnAuthority) {
  // In memory, where there is such a folder: a sequence synchronizes its file some ten times.
  const fs::path memory("/dev/shm");
  std::error_code error;
  const fs::path folder = fs::exists(memory, error)
                              ? memory / fs::path(rcs::test::fresh_folder()).filename()
                              : rcs::test::fresh_folder();
  Seen seen;
  for (unsigned seed = 0; seed < kSequences; ++seed) {
    fs::remove_all(folder, error);
    RandomSequence sequence(seed, folder, &seen);
    sequence.run();
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  fs::remove_all(folder, error);
  EXPECT_GT(seen.stops_in_motion, kSequences / 10);
  EXPECT_GT(seen.releases, kSequences / 10);
  EXPECT_GT(seen.kills_while_stopped, kSequences / 10);
  std::printf("[ SEQUENCES] %d: %d stops in motion, %d releases, %d kills while stopped\n",
              kSequences, seen.stops_in_motion, seen.releases, seen.kills_while_stopped);
}

}  // namespace
}  // namespace rcs::bg
