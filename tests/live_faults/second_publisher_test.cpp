// A second program publishes plausible lies on a channel of a driving vehicle: each message of the
// channel follows again, with other values. RCS_DRILL_TIMES: drives for each channel, default 5.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "rcs/node/bus/outbox.h"
#include "tests/live_faults/live_fault.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kLies = from_seconds(6.0);
constexpr Duration kNamedWithin = from_milliseconds(100.0);
constexpr double kRest_mps = 0.15;

/// Repeats the messages of a channel with other values, as another publisher.
template <class T>
class Liar {
 public:
  using Lie = std::function<void(T*)>;
  Liar(Bus* bus, const char* channel, Lie lie)
      : me_(bus->publisher().publisher_id),
        outbox_(bus, channel),
        lie_(std::move(lie)),
        tap_(bus, channel, [this](const T& m, Stamp at) { repeat(m, at); }) {}

  void begin() { lying_ = true; }
  void end() { lying_ = false; }
  [[nodiscard]] std::optional<Stamp> first() const { return first_; }

 private:
  void repeat(const T& m, Stamp at) {
    if (!lying_ || m.publisher_id == me_) return;
    if (!first_) first_ = at;
    copy_ = m;
    lie_(&copy_);
    outbox_.publish(&copy_);
  }

  std::int64_t me_;
  bool lying_ = false;
  std::optional<Stamp> first_;
  T copy_{};
  Outbox<T> outbox_;
  Lie lie_;
  Tap<T> tap_;
};

struct Outcome {
  std::optional<Duration> named;  ///< until the first event
  double speed_mps = 0.0;         ///< largest in the last second of the lies
  std::string breaches;
};

template <class T>
Outcome drive_with_liar(const char* channel, const typename Liar<T>::Lie& lie) {
  Outcome out;
  LiveFault live;
  if (live.run.bus() == nullptr) {
    ADD_FAILURE() << live.run.trouble();
    return out;
  }
  Bus* const bus = live.run.bus();
  Liar<T> liar(bus, channel, lie);
  double speed_mps = 0.0;
  Stamp last_second = Stamp::max();
  Tap<truth_t> truth(bus, channel::kSimTruth, [&](const truth_t& m, Stamp at) {
    const auto& v = m.v_world_mps;
    speed_mps = std::hypot(v[0], v[1]);
    if (at > last_second) out.speed_mps = std::max(out.speed_mps, speed_mps);
  });
  const auto receive = [&](const event_t& m, Stamp at) {
    const bool names = m.code == event::kPublisherRejected.code &&
                       m.text.find(channel) != std::string::npos && liar.first();
    if (names && !out.named) out.named = at - *liar.first();
  };
  Tap<event_t> sp(bus, channel::kSpEvent, receive);
  Tap<event_t> wm(bus, channel::kWmEvent, receive);
  Tap<event_t> bg(bus, channel::kBgEvent, receive);
  EXPECT_TRUE(live.run_until_well(kPatience)) << live.run.trouble();
  EXPECT_TRUE(live.run.run_until(live.run.now() + kPatience, [&] { return speed_mps > 2.0; }));
  liar.begin();
  last_second = live.run.now() + kLies - from_seconds(1.0);
  live.run_for(kLies);
  liar.end();
  last_second = Stamp::max();  // the vehicle drives again
  EXPECT_TRUE(live.run_until_well(kPatience)) << "after the lies: " << live.run.trouble();
  // The other judges count the lies as messages of the nodes.
  for (const std::string& text : live.safety.breaches()) out.breaches += text + "\n";
  return out;
}

/// @param drives_by  BG drives by the channel
template <class T>
void expect_named(const char* channel, bool drives_by, const typename Liar<T>::Lie& lie) {
  const int times = number_from("RCS_DRILL_TIMES", 5);
  Duration latest{};
  for (int i = 0; i < times; ++i) {
    const Outcome out = drive_with_liar<T>(channel, lie);
    ASSERT_TRUE(out.named) << channel << ": no event";
    latest = std::max(latest, *out.named);
    EXPECT_LE(*out.named, kNamedWithin) << channel;
    EXPECT_EQ(out.breaches, "") << channel;
    EXPECT_TRUE(!drives_by || out.speed_mps < kRest_mps)
        << channel << ": not at rest, " << out.speed_mps << " m/s";
  }
  fmt::print("{}: {} drives, named after at most {:.0f} ms\n", channel, times,
             milliseconds(latest));
}

TEST(SecondPublisher, OfNavStateThreeMetresBeside) {
  expect_named<nav_state_t>(channel::kWmNavState, true, [](nav_state_t* m) {
    m->p_world_vehicle_m[1] += 3.0;
    m->p_local_vehicle_m[1] += 3.0;
  });
}

TEST(SecondPublisher, OfIntegrityThatClaimsTooMuch) {
  expect_named<integrity_t>(channel::kWmIntegrity, true, [](integrity_t* m) {
    m->protection_horizontal_m = m->protection_vertical_m = 0.1;
    m->alerts = 0;
  });
}

TEST(SecondPublisher, OfAMapPatchWithoutObstacles) {
  expect_named<map_patch_t>(channel::kWmMapPatch, true, [](map_patch_t* m) {
    std::fill(m->step_cm.begin(), m->step_cm.end(), std::int16_t{0});
    std::fill(m->slope_deg.begin(), m->slope_deg.end(), std::int8_t{0});
  });
}

TEST(SecondPublisher, OfDriveCommands) {
  expect_named<drive_t>(channel::kBgDrive, true, [](drive_t* m) {
    m->utime += 1'000;
    m->speed_mps = 3.0;
    m->brake = m->emergency_stop = 0;
  });
}

TEST(SecondPublisher, OfRegistrationsThatAreShifted) {
  expect_named<registration_t>(channel::kSpRegistration, false,
                               [](registration_t* m) { m->p_target_vehicle_m[1] += 0.5; });
}

TEST(SecondPublisher, OfAnIns) {
  expect_named<ins_t>(channel::kIns, false, [](ins_t* m) {
    m->utime += m->interval_us / 2;
    m->delta_angle_rad[2] += 2e-4;
  });
}

TEST(SecondPublisher, OfGpsFixes) {
  expect_named<gps_fix_t>(channel::kGpsFix, false, [](gps_fix_t* m) {
    m->utime += 10'000;
    m->lat_deg += 3e-5;
  });
}

TEST(SecondPublisher, OfOdometry) {
  expect_named<odometry_t>(channel::kOdometry, false, [](odometry_t* m) {
    m->utime += 5'000;
    m->speed_mps += 0.5;
  });
}

TEST(SecondPublisher, OfRangesWithoutObstacles) {
  expect_named<ladar_ranges_t>(channel::kLadarRanges, false, [](ladar_ranges_t* m) {
    for (float& range_m : m->range_m) range_m *= 1.1F;
  });
}

}  // namespace
}  // namespace rcs::live_faults
