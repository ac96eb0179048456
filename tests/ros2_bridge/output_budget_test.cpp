#include "modules/ros2_bridge/output_budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>
#include <utility>

namespace rcs::ros2_bridge {
namespace {

Stamp at_ms(std::int64_t ms) { return Stamp(std::chrono::milliseconds(ms)); }

TEST(Decimator, TheMeanRateIsThatOfThePeriod) {
  struct Case {
    int interval_ms;
    int period_ms;
    int expected;  // of 10 s
  };
  for (const Case& c : {Case{20, 50, 200}, Case{20, 0, 500}, Case{100, 50, 100}, Case{20, 1000, 10},
                        Case{33, 100, 100}}) {
    Decimator decimator{std::chrono::milliseconds(c.period_ms)};
    int admitted = 0;
    for (int t = 0; t < 10'000; t += c.interval_ms) admitted += decimator.admit(at_ms(t)) ? 1 : 0;
    EXPECT_NEAR(admitted, c.expected, 1) << c.interval_ms << " ms in, " << c.period_ms << " ms out";
  }
}

TEST(Decimator, ASilenceIsNotMadeUpFor) {
  Decimator decimator{std::chrono::milliseconds(100)};
  EXPECT_TRUE(decimator.admit(at_ms(0)));
  int admitted = 0;
  for (int t = 5000; t < 5500; t += 10) admitted += decimator.admit(at_ms(t)) ? 1 : 0;
  EXPECT_EQ(admitted, 5);
}

TEST(ByteBudget, NoSecondHasMoreThanTheBudget) {
  constexpr std::size_t kBudget = 100'000;
  std::mt19937 random(1);
  ByteBudget budget(kBudget);
  std::deque<std::pair<std::int64_t, std::size_t>> second;  // granted within the last second
  std::size_t sum = 0;
  std::size_t most = 0;
  std::size_t all = 0;
  std::int64_t us = 7;
  for (int i = 0; i < 200'000; ++i) {
    us += static_cast<std::int64_t>(random() % 2000);
    if (random() % 5000 == 0) us += 3'000'000;
    const std::size_t bytes = random() % 3 == 0 ? random() % 40'000 : random() % 500;
    if (budget.take(bytes, from_utime(us)) != ByteBudget::Verdict::kGranted) continue;
    second.emplace_back(us, bytes);
    sum += bytes;
    all += bytes;
    for (; second.front().first <= us - 1'000'000; second.pop_front()) {
      sum -= second.front().second;
    }
    most = std::max(most, sum);
  }
  EXPECT_LE(most, kBudget);
  EXPECT_GT(most, kBudget * 9 / 10) << "the budget can be used";
  EXPECT_GT(static_cast<double>(all), 0.7 * kBudget * 1e-6 * static_cast<double>(us - 120'000'000));
}

TEST(ByteBudget, LargeMessagesDoNotDisplaceSmallOnes) {
  ByteBudget budget(100'000);
  int small = 0;
  int large = 0;
  for (int t = 0; t < 10'000; t += 10) {
    if (budget.take(20'000, at_ms(t)) == ByteBudget::Verdict::kGranted) ++large;
    if (budget.take(150, at_ms(t)) == ByteBudget::Verdict::kGranted) ++small;
  }
  EXPECT_EQ(small, 1000) << "15 kB of the 20 kB that large messages leave";
  EXPECT_GT(large, 20);
}

TEST(ByteBudget, AMessageThatNeverFitsIsNamed) {
  ByteBudget budget(100'000);
  EXPECT_EQ(budget.take(80'001, at_ms(0)), ByteBudget::Verdict::kTooLarge);
  EXPECT_EQ(budget.take(80'000, at_ms(0)), ByteBudget::Verdict::kGranted);
  EXPECT_EQ(budget.take(80'000, at_ms(500)), ByteBudget::Verdict::kExhausted);
  EXPECT_EQ(budget.take(80'000, at_ms(1100)), ByteBudget::Verdict::kGranted);
}

}  // namespace
}  // namespace rcs::ros2_bridge
