// On a private bus (with_bus.sh): the bg process is killed again and again after an emergency stop,
// while a superior keeps commanding.

#include <gtest/gtest.h>

#include <cstdio>

#include "tests/bg/live_bg.h"

namespace rcs::bg {
namespace {

constexpr int kLives = 50;

class BgStopLive : public test::LiveBg {};

TEST_F(BgStopLive, NoDriveCommandBeforeTheReleaseHoweverOftenBgIsKilled) {
  ASSERT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << bg_->output();
  // Expired, with the maximum serial: it must not disable the stops of this issuer.
  command_t poison{};
  poison.issuer = "operator";
  poison.boot_id = bus_->publisher().boot_id;
  poison.serial = INT64_MAX;
  poison.utime = poison.valid_until_utime = to_utime(timeline_.now());
  raw_.publish(&poison);
  ask(command_t::KIND_EMERGENCY_STOP);
  ASSERT_TRUE(run_until([&] { return operator_.confirmed(); })) << bg_->output();
  int still = 0;
  for (int life = 0; life < kLives; ++life) {
    kill_bg();
    seen_ = {};
    start_bg();
    ASSERT_TRUE(run_until([&] { return seen_.drives >= 10 && seen_.refused > 0; }))
        << "life " << life << ": " << bg_->output();
    if (seen_.unbraked == 0) ++still;
  }
  std::printf("[  STOP    ] %d of %d lives of bg: no motion before the release\n", still, kLives);
  EXPECT_EQ(still, kLives);
  ask(command_t::KIND_RELEASE);
  seen_ = {};
  EXPECT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << "after the release";
  kill_bg();
  start_bg();
  seen_ = {};
  EXPECT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << "and after a restart";
}

}  // namespace
}  // namespace rcs::bg
