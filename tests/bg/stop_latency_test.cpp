// On a private bus (with_bus.sh), on an idle computer: the time from an emergency stop on BG_STOP
// to the first full brake on BG_DRIVE. RCS_STOP_TRIALS: number of stops, default 200.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "tests/bg/live_bg.h"

namespace rcs::bg {
namespace {

constexpr Duration kLimit = from_milliseconds(50.0 + 10.0);  // a period of BG, and 10 ms

class BgStopLatency : public test::LiveBg {};

TEST_F(BgStopLatency, FromTheStopToFullBrake) {
  const char* const given = std::getenv("RCS_STOP_TRIALS");      // NOLINT(concurrency-mt-unsafe)
  const int trials = given == nullptr ? 200 : std::atoi(given);  // NOLINT(cert-err34-c)
  std::mt19937 random(1);
  std::vector<double> latency_ms;
  for (int k = 0; k < trials; ++k) {
    seen_ = {};
    ASSERT_TRUE(run_until([&] { return seen_.unbraked > 0; })) << bg_->output();
    // At any phase of BG's period.
    const Stamp when =
        timeline_.now() + Duration(std::uniform_int_distribution<>(0, 50'000)(random));
    while (timeline_.advance(when) == Timeline::Step::kDelivered) {
    }
    seen_ = {};
    const Stamp sent = timeline_.now();
    ask(command_t::KIND_EMERGENCY_STOP);
    ASSERT_TRUE(run_until([&] { return seen_.stopped && operator_.confirmed(); })) << bg_->output();
    latency_ms.push_back(milliseconds(*seen_.stopped - sent));
    ask(command_t::KIND_RELEASE);
    ASSERT_TRUE(run_until([&] {
      return operator_.progress(timeline_.now()).state == CommandProgress::State::kDone;
    })) << bg_->output();
  }
  std::sort(latency_ms.begin(), latency_ms.end());
  const auto quantile = [&](double q) {
    return latency_ms[static_cast<std::size_t>(q * static_cast<double>(latency_ms.size() - 1))];
  };
  std::printf("[  STOP    ] %d stops to full brake: p50 %.1f ms, p99 %.1f ms, max %.1f ms\n",
              trials, quantile(0.5), quantile(0.99), latency_ms.back());
  EXPECT_LE(quantile(0.99), milliseconds(kLimit));
}

}  // namespace
}  // namespace rcs::bg
