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
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "rcs/node/stop_receiver.h"
#include "tests/bg/bg_life.h"
#include "tests/support/fresh_folder.h"

namespace rcs::bg {
namespace {

namespace fs = std::filesystem;
using test::kGoto;
using test::kRelease;
using test::kStop;
using test::Life;

constexpr int kStories = 1000;
constexpr int kSteps = 50;
constexpr Duration kCycle = from_milliseconds(50.0);
const char* const kIssuers[] = {"operator", "gateway", "radio"};  // only the first is an authority

/// Plans less than on a vehicle: the test is about stops.
BgConfig quick() {
  BgConfig config;
  config.plan_period = from_milliseconds(500.0);
  config.grant.cap = 1000;
  return config;
}

/// What all stories together contain, so that the law is not kept by vehicles that never drive.
struct Seen {
  int stops_in_motion = 0;
  int releases = 0;
  int kills_while_stopped = 0;
};

class Story {
 public:
  Story(unsigned seed, const fs::path& folder, Seen* seen)
      : random_(seed), file_((folder / "v.stop").string()), seen_(seen) {
    start();
  }

  void run() {
    for (int step = 0; step < kSteps && !testing::Test::HasFailure(); ++step) {
      if (step < kSteps / 3 ? below(4) == 0 : below(2) == 0) happen();
      cycle();
    }
    if (!testing::Test::HasFailure()) end_well();
  }

 private:
  int below(int n) { return std::uniform_int_distribution<>(0, n - 1)(random_); }
  std::string issuer() { return kIssuers[below(3)]; }

  void start() {
    Result<StopLatch> latch = StopLatch::open(file_);
    ASSERT_TRUE(latch.ok());
    life_ = std::make_unique<Life>(file_, std::move(latch).value(), &now_, boot_, quick());
    life_->world = life_->moves = true;
    life_->speed_mps = speed_mps_;
    life_->x_m = x_m_;
    released_here_.clear();
    releases_.clear();
    arriving_.clear();  // what had not been delivered is lost
  }
  /// The vehicle stops by itself meanwhile.
  void die(int cycles) {
    if (!in_force_.empty()) ++seen_->kills_while_stopped;
    keep_vehicle();
    life_.reset();
    for (; cycles > 0; --cycles) {
      now_ += kCycle;
      speed_mps_ -= std::clamp(speed_mps_, -0.2, 0.2);
      x_m_ += 0.05 * speed_mps_;
    }
    start();
  }
  void keep_vehicle() {
    speed_mps_ = life_->speed_mps;
    x_m_ = life_->x_m;
  }

  command_t fresh(std::int8_t kind) {
    now_ += Duration(1);
    command_t m = life_->command(kind, issuer());
    if (kind == kStop && below(4) > 0) {
      m.n_stops = 1;
      m.stop_id = {std::uniform_int_distribution<std::int64_t>(1)(random_)};
    }
    if (kind == kRelease && !m.stop_id.empty() && below(4) == 0) {
      m.stop_id.erase(m.stop_id.begin() + below(static_cast<int>(m.stop_id.size())));
      m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
    }
    return m;
  }
  std::int8_t any_kind() {
    constexpr std::int8_t kKinds[] = {kGoto, kStop, kRelease, command_t::KIND_HALT};
    return kKinds[below(4)];
  }
  void send(const command_t& m, bool legal) {
    if (m.kind == kStop) arriving_[stop_id_of(m)] = m.issuer;
    if (m.kind == kRelease && legal) releases_.push_back({m, 4});
    sent_.push_back(m);
    life_->send(m);
  }

  void happen() {
    switch (below(12)) {
      case 0:
      case 1:
      case 2:
      case 3:
        return send(fresh(kGoto), true);
      case 4:
        return arriving_.size() + in_force_.size() < 10 ? send(fresh(kStop), true) : void();
      case 5:
      case 6:
        return send(fresh(kRelease), true);
      case 7:  // killed, or the computer was restarted
        if (below(3) > 0) return;
        boot_ += below(2);
        return die(1 + below(20));
      case 8: {
        command_t m = fresh(below(2) == 0 ? kGoto : kRelease);
        m.valid_until_utime = m.utime - below(3);
        return send(m, false);
      }
      case 9:  // of a recording, or delayed
        if (sent_.empty()) return;
        return send(
            command_t(sent_[static_cast<std::size_t>(below(static_cast<int>(sent_.size())))]),
            false);
      case 10: {
        command_t m = fresh(below(2) == 0 ? kGoto : kRelease);
        m.boot_id += 1 + below(5);
        return send(m, false);
      }
      case 11: {
        command_t m = fresh(any_kind());
        if (m.kind == kStop && in_force_.size() >= 10) return;
        m.serial += below(2) == 0 ? 900'000 : 5'000'000;
        if (below(4) == 0) m.serial = INT64_MAX;
        return send(m, m.serial <= m.utime + 1'000'000);
      }
    }
  }

  void cycle() {
    const double before_mps = life_->speed_mps;
    const double before_m = life_->x_m;
    for (const auto& [id, issuer] : arriving_) {
      if (released_here_.count(id) != 0) continue;
      if (in_force_.emplace(id, issuer).second && std::abs(before_mps) > 0.3)
        ++seen_->stops_in_motion;
    }
    arriving_.clear();
    const bool stopped = !in_force_.empty();
    life_->cycle();
    if (stopped) {
      EXPECT_TRUE(life_->brakes());
      ASSERT_TRUE(life_->drive);
      EXPECT_EQ(life_->drive->emergency_stop, 1);
      EXPECT_TRUE(before_mps != 0.0 || life_->x_m == before_m) << "moves";
    }
    end_stops(std::abs(before_mps) < 0.15);
    if (!in_force_.empty()) {
      EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
      EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_PERSISTED);
      for (const auto& [id, issuer] : in_force_) {
        const auto& listed = life_->status.stop;
        EXPECT_TRUE(std::any_of(listed.begin(), listed.end(),
                                [id = id](const stop_t& s) { return s.id == id; }));
      }
    }
  }

  /// BG may act on a release in the cycles in which it waits behind a stop.
  void end_stops(bool at_rest) {
    for (Pending& p : releases_) {
      --p.cycles;
      const command_t& m = p.message;
      if (!at_rest || m.boot_id != boot_ || to_utime(now_) >= m.valid_until_utime) continue;
      const auto& listed = life_->status.stop;
      for (const std::int64_t id : m.stop_id) {
        const auto stop = in_force_.find(id);
        if (stop == in_force_.end()) continue;
        if (stop->second != m.issuer && m.issuer != kIssuers[0]) continue;
        const bool ended = std::none_of(listed.begin(), listed.end(),
                                        [id](const stop_t& s) { return s.id == id; });
        if (!ended) continue;
        in_force_.erase(stop);
        released_here_.insert(id);
        ++seen_->releases;
      }
    }
    releases_.erase(std::remove_if(releases_.begin(), releases_.end(),
                                   [](const Pending& p) { return p.cycles <= 0; }),
                    releases_.end());
  }

  /// After all of it an authority can release, and the vehicle drives.
  void end_well() {
    for (int k = 0; k < 60; ++k) cycle();
    now_ += Duration(1);
    command_t release = life_->command(kRelease, "operator");
    send(release, true);
    cycle();
    EXPECT_EQ(life_->status.state, "RELEASED");
    EXPECT_TRUE(in_force_.empty());
    for (int k = 0; k < 20; ++k) {
      now_ += Duration(1);
      if (k % 10 == 0) life_->send(life_->command(kGoto, "operator"));
      cycle();
    }
    EXPECT_NE(life_->speed_mps, 0.0) << life_->status.state << ": " << life_->status.reason;
  }

  struct Pending {
    command_t message;
    int cycles = 0;
  };

  std::mt19937 random_;
  std::string file_;
  Seen* seen_;
  Stamp now_{std::chrono::seconds(100)};
  std::int64_t boot_ = 1;
  double speed_mps_ = 0.0;
  double x_m_ = 0.0;
  std::map<std::int64_t, std::string> arriving_;  // stops, by id, with their issuers
  std::map<std::int64_t, std::string> in_force_;
  std::set<std::int64_t> released_here_;  // in this life of BG
  std::vector<Pending> releases_;
  std::vector<command_t> sent_;
  std::unique_ptr<Life> life_;
};

TEST(BgStopStories, NoMotionBeforeAReleaseByItsIssuerOrAnAuthority) {
  // In memory, where there is such a folder: a story synchronizes its file some ten times.
  const fs::path memory("/dev/shm");
  std::error_code error;
  const fs::path folder = fs::exists(memory, error)
                              ? memory / fs::path(rcs::test::fresh_folder()).filename()
                              : rcs::test::fresh_folder();
  Seen seen;
  for (unsigned seed = 0; seed < kStories; ++seed) {
    fs::remove_all(folder, error);
    Story story(seed, folder, &seen);
    story.run();
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  fs::remove_all(folder, error);
  EXPECT_GT(seen.stops_in_motion, kStories / 10);
  EXPECT_GT(seen.releases, kStories / 10);
  EXPECT_GT(seen.kills_while_stopped, kStories / 10);
  std::printf("[  STORIES ] %d: %d stops in motion, %d releases, %d kills while stopped\n",
              kStories, seen.stops_in_motion, seen.releases, seen.kills_while_stopped);
}

}  // namespace
}  // namespace rcs::bg
