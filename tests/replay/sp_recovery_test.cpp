// SP with an INS that predicts a pose where the scan matches nothing.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "tests/registration/ray_scenes.h"
#include "tests/replay/point_scans.h"
#include "tests/replay/sp_run.h"

namespace rcs::test {
namespace {

constexpr Duration kInterval = from_milliseconds(100.0);
constexpr Duration kInsInterval = from_milliseconds(10.0);

template <class Message>
void encode(const char* channel, const Message& m, SourceEvent* event) {
  event->channel = channel;
  event->data.resize(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(event->data.data(), 0, m.getEncodedSize());
}

/// Scans, and an INS that is at rest whatever the scans show.
class WithInsAtRest final : public EventSource {
 public:
  explicit WithInsAtRest(std::vector<Points> scans, Duration lasts = {})
      : scans_(std::move(scans), kInterval, 1, lasts) {}

  /// Without INS from then on.
  void silent_from(Stamp stamp) { silent_from_ = stamp; }
  /// From then on WM does not use the INS.
  void excluded_from(Stamp stamp) { excluded_from_ = stamp; }

  Stamp peek() override {
    return scans_.peek() == Stamp::max() ? Stamp::max() : std::min(scans_.peek(), next_);
  }
  void take(SourceEvent* event) override {
    if (scans_.peek() < next_) {
      scans_.take(event);
      return;
    }
    if (next_ >= excluded_from_) {
      nav_state_t state{};
      state.utime = to_utime(next_);
      state.q_world_vehicle[0] = state.q_rolling_vehicle[0] = state.q_local_vehicle[0] = 1.0;
      state.mode = nav_state_t::MODE_LADAR;
      encode(channel::kWmNavState, state, event);
      excluded_from_ = Stamp::max();
      return;
    }
    ins_t m{};
    m.utime = to_utime(next_);
    m.seq = ++seq_;
    m.interval_us = static_cast<std::int32_t>(kInsInterval.count());
    m.delta_angle_rad[2] = 1e-6 * static_cast<double>(seq_ % 7);  // not a sensor that is stuck
    m.delta_v_mps[2] = 9.81 * seconds(kInsInterval) + 1e-5 * static_cast<double>(seq_ % 5);
    m.valid = 1;
    encode(channel::kIns, m, event);
    next_ += kInsInterval;
    if (next_ >= silent_from_) next_ = Stamp::max();
  }

 private:
  PointScans scans_;
  Stamp next_ = Stamp() + kInsInterval;
  Stamp silent_from_ = Stamp::max(), excluded_from_ = Stamp::max();
  std::int64_t seq_ = 0;
};

std::vector<registration_t> registered(std::vector<Points> scans) {
  WithInsAtRest source(std::move(scans));
  return registrations_of(&source, "");
}

Pose turned(double x_m, double yaw_rad) {
  return {exp_so3(Vec3(0.0, 0.0, yaw_rad)), Vec3(x_m, 0.0, 1.8)};
}

constexpr int kBefore = 25;
constexpr int kAfter = 15;

std::size_t number_of_drives() {
  const char* text = std::getenv("RCS_SEEDS");
  return text != nullptr ? static_cast<std::size_t>(std::atoi(text)) : 20;
}

/// What SP says of the scans after the vehicle has been moved.
struct Outcome {
  int right = 0, wrong = 0, rejected = 0, of_another_map = 0;
  std::size_t first_right = kAfter;
};

Outcome outcome(const std::vector<registration_t>& found, const Pose& moved) {
  Outcome out;
  for (std::size_t k = kBefore; k < found.size(); ++k) {
    if (found[k].map_epoch != found[0].map_epoch) {
      ++out.of_another_map;
    } else if (!is_usable(found[k])) {
      ++out.rejected;
    } else {
      const Pose off = moved.inverse() * pose_of(found[k]);
      const bool right = off.p.norm() < 0.15 && log_so3(off.q).norm() < radians(1.0);
      ++(right ? out.right : out.wrong);
      if (right) out.first_right = std::min(out.first_right, k - kBefore);
    }
  }
  return out;
}

TEST(SpRecovery, AVehicleThatTheInsHasLostIsFoundInTheSameMap) {
  std::mt19937 rng(3);
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(rng);
  };
  std::size_t found_at_once = 0;
  std::size_t wrong = 0;
  for (std::size_t drive = 0; drive < number_of_drives(); ++drive) {
    // Turned by 180 deg a street looks much the same.
    const double turn_rad = uniform(radians(-120.0), radians(120.0));
    const RayScene scene = street(true);
    const Pose first = turned(uniform(-5.0, 5.0), 0.0);
    const Pose there = turned(first.p.x() + uniform(-4.0, 4.0), turn_rad);
    std::vector<Points> scans;
    scans.reserve(kBefore + kAfter);
    for (int k = 0; k < kBefore + kAfter; ++k) {
      scans.push_back(scan(scene, scan_patterns()[1], k < kBefore ? first : there, &rng));
    }
    const Outcome seen = outcome(registered(std::move(scans)), first.inverse() * there);
    if (seen.wrong > 0) {
      ++wrong;
      std::printf("drive %zu, turned by %.1f deg and moved by %.2f m: not noticed\n", drive,
                  degrees(turn_rad), there.p.x() - first.p.x());
    }
    found_at_once += seen.first_right <= 3 ? 1 : 0;
  }
  std::printf("found within 3 scans: %zu of %zu\n", found_at_once, number_of_drives());
  EXPECT_GE(10 * found_at_once, 9 * number_of_drives());
  EXPECT_LE(20 * wrong, number_of_drives());
}

/// A new view that nothing of the map explains is not a fault.
TEST(SpRecovery, ABlindedLadarIsRejectedAndComesBack) {
  std::mt19937 rng(11);
  const RayScene scene = street(true);
  const Pose pose = turned(0.0, 0.0);
  for (const std::size_t left : {0U, 30U, 700U}) {
    std::vector<Points> scans;
    scans.reserve(kBefore + kAfter);
    constexpr int kBlind = 4;  // later its place is unknown without WM
    for (int k = 0; k < kBefore + kAfter; ++k) {
      Points points = scan(scene, scan_patterns()[1], pose, &rng);
      if (k >= kBefore && k < kBefore + kBlind) {
        // Dust and leaves close to the sensor.
        points = Points();
        std::uniform_real_distribution<float> near(-4.0F, 4.0F);
        while (points.size() < left) points.push_back(Vec3f(near(rng), near(rng), near(rng)));
      }
      scans.push_back(std::move(points));
    }
    const std::vector<registration_t> found = registered(std::move(scans));
    const Outcome seen = outcome(found, Pose{});
    EXPECT_EQ(seen.wrong, 0) << left;
    EXPECT_TRUE(is_usable(found.back())) << left;
    EXPECT_EQ(found.back().map_epoch, found.front().map_epoch) << left;
  }
}

/// At the middle of a scan an error of the velocity moves no pose (ADR 111).
TEST(SpRecovery, WithoutInsAScanRefersToItsMiddle) {
  const Stamp gone = Stamp() + from_seconds(2.0);
  for (const bool excluded : {false, true}) {
    std::mt19937 rng(11);
    std::vector<Points> scans;
    scans.reserve(40);
    for (int k = 0; k < 40; ++k) {
      scans.push_back(scan(street(true), scan_patterns()[1], turned(0.0, 0.0), &rng));
    }
    WithInsAtRest source(std::move(scans), kInterval);
    if (excluded) source.excluded_from(gone);
    if (!excluded) source.silent_from(gone);
    const std::vector<registration_t> found = registrations_of(&source, "");
    int without_ins = 0;
    for (const registration_t& r : found) {
      const Stamp end = Stamp() + static_cast<int>(r.scan_id) * kInterval;
      const Duration before = end - from_utime(r.utime);
      if (end <= gone) {
        EXPECT_LE(before, from_milliseconds(30.0)) << excluded << ", scan " << r.scan_id;
      } else if (end > gone + kInterval) {
        EXPECT_NEAR(milliseconds(before), 50.0, 0.1) << excluded << ", scan " << r.scan_id;
        EXPECT_TRUE(is_usable(r)) << excluded << ", scan " << r.scan_id;
        ++without_ins;
      }
    }
    EXPECT_GT(without_ins, 15) << excluded;
  }
}

}  // namespace
}  // namespace rcs::test
