#include "modules/gateway/identity_watch.h"

#include <gtest/gtest.h>

namespace rcs::gateway {
namespace {

using std::chrono::hours;
using State = IdentityWatch::State;

constexpr std::int64_t kEnd = 1'800'000'000'000'000;
constexpr Stamp kStart = from_utime(5'000'000);

std::int64_t before_end(Duration d) { return kEnd - d.count(); }

TEST(IdentityWatch, TheStateFollowsTheWallClock) {
  const IdentityWatch watch(kEnd);
  EXPECT_EQ(watch.state(before_end(hours(24 * 30) + Duration(1))), State::kValid);
  EXPECT_EQ(watch.state(before_end(hours(24 * 30))), State::kEndsSoon);
  EXPECT_EQ(watch.state(before_end(Duration(1))), State::kEndsSoon);
  EXPECT_EQ(watch.state(kEnd), State::kExpired);
  EXPECT_EQ(watch.state(kEnd + 1'000'000), State::kExpired);
  EXPECT_EQ(watch.days_left(before_end(hours(24 * 12 + 23))), 12);
}

TEST(IdentityWatch, AValidIdentityIsNotReported) {
  IdentityWatch watch(kEnd);
  for (int day = 0; day < 100; ++day) {
    EXPECT_FALSE(watch.take_due(before_end(hours(24 * (200 - day))), kStart + hours(24 * day)));
  }
}

TEST(IdentityWatch, EachWorseStateIsReportedAtOnceAndThenOnceADay) {
  IdentityWatch watch(kEnd);
  int reports = 0;
  Stamp now = kStart;
  for (int h = 0; h <= 24 * 40; ++h, now += hours(1)) {
    const std::int64_t wall = before_end(hours(24 * 35 - h));  // from 35 days before to 5 after
    const bool due = watch.take_due(wall, now);
    reports += due ? 1 : 0;
    EXPECT_FALSE(watch.take_due(wall, now + Duration(1)));
    EXPECT_EQ(due, h >= 24 * 5 && (h - 24 * 5) % 24 == 0) << h;
  }
  EXPECT_EQ(reports, 36);
}

// The clock of a computer without a battery is set after its start.
TEST(IdentityWatch, AClockThatIsSetIsFollowedInBothDirections) {
  IdentityWatch watch(kEnd);
  EXPECT_TRUE(watch.take_due(kEnd, kStart));
  EXPECT_FALSE(watch.take_due(before_end(hours(24 * 300)), kStart + hours(1)));
  EXPECT_TRUE(watch.take_due(before_end(hours(1)), kStart + hours(2)));
  EXPECT_TRUE(watch.take_due(kEnd, kStart + hours(3)));
}

}  // namespace
}  // namespace rcs::gateway
