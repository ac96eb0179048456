// On a private bus (with_bus.sh): another program publishes the navigation state of a running BG.

#include <gtest/gtest.h>

#include <cstdio>
#include <optional>
#include <string>

#include "lcmtypes/events.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "tests/bg/live_bg.h"

namespace rcs::bg {
namespace {

class BgSecondPublisherLive : public test::LiveBg {
 protected:
  /// A message of another process of the same run, 3 m from the vehicle.
  void lie() {
    nav_state_t m{};
    m.utime = m.publish_utime = to_utime(timeline_.now());
    m.mode = nav_state_t::MODE_GPS_INS_LADAR;
    m.pose_valid = 1;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
    m.rolling_valid = 1;
    m.p_local_vehicle_m[1] = 3.0;
    lies_.publish(&m);
    if (!first_lie_) first_lie_ = timeline_.now();
  }

  std::unique_ptr<LcmBus> other_ = test::open_bus();
  Outbox<nav_state_t> lies_{other_.get(), channel::kWmNavState};
  std::optional<Stamp> first_lie_;
  std::optional<Stamp> named_;
  std::string state_;
  Tap<event_t> events_{bus_.get(), channel::kBgEvent, [this](const event_t& m, Stamp at) {
                         const bool names = m.code == event::kPublisherRejected.code &&
                                            m.text.find(channel::kWmNavState) != std::string::npos;
                         if (names && !named_) named_ = at;
                       }};
  Tap<status_t> states_{bus_.get(), channel::kBgStatus,
                        [this](const status_t& m, Stamp) { state_ = m.state; }};
};

TEST_F(BgSecondPublisherLive, IsNamedAndTheVehicleBrakesUntilItIsGone) {
  ASSERT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << bg_->output();
  EXPECT_FALSE(named_) << bg_->output();
  EXPECT_TRUE(run_until([&] {
    lie();
    return named_ && state_ == "SECOND_PUBLISHER";
  })) << bg_->output();
  seen_ = {};
  EXPECT_TRUE(run_until([&] {
    lie();
    return seen_.drives >= 20;
  }));
  EXPECT_EQ(seen_.unbraked, 0);
  EXPECT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << "when it is gone: " << state_;
  if (named_) {
    std::printf("[  PUBLISHER ] named after %.0f ms\n", milliseconds(*named_ - *first_lie_));
  }
}

}  // namespace
}  // namespace rcs::bg
