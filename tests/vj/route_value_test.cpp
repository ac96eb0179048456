#include "modules/vj/route_value.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rcs::vj {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(RouteValue, TheRiskIsThatOfARayleighDistributedError) {
  const RouteLimits limits{5.0, 1.0, 600.0};
  EXPECT_NEAR(value_of({1000.0, 200.0, 5.0}, limits).risk, std::exp(-0.5), 1e-12);
  EXPECT_NEAR(value_of({1000.0, 200.0, 5.0 / 3.717}, limits).risk, 0.001, 2e-5);
  EXPECT_EQ(value_of({1000.0, 200.0, 0.0}, limits).risk, 0.0);
  EXPECT_EQ(value_of({1000.0, 200.0, kInfinite}, limits).risk, 1.0);
}

TEST(RouteValue, ALongerRouteIsWorthItWhereTheShortOneExceedsTheLimit) {
  const RouteForecast shorter{1000.0, 200.0, 3.0};
  const RouteForecast longer{1500.0, 300.0, 0.4};
  const RouteLimits with_gps{5.0, 0.05, 600.0};
  const RouteLimits without_gps{5.0, 1.0, 600.0};
  EXPECT_FALSE(value_of(shorter, without_gps).keeps_limit);
  EXPECT_TRUE(value_of(longer, without_gps).keeps_limit);
  EXPECT_LT(value_of(longer, without_gps).cost_s, value_of(shorter, without_gps).cost_s);
  EXPECT_GT(value_of(longer, with_gps).cost_s, value_of(shorter, with_gps).cost_s);
}

TEST(RouteValue, TheLevelContainsUndetectedFaults) {
  RouteLimits limits{5.0, 1.0, 600.0};
  const RouteForecast route{1000.0, 200.0, 1.0};
  EXPECT_TRUE(value_of(route, limits).keeps_limit);
  limits.undetected_m = 1.5;
  EXPECT_NEAR(value_of(route, limits).level_m, 3.717 + 1.5, 1e-3);
  EXPECT_FALSE(value_of(route, limits).keeps_limit);
}

TEST(RouteValue, WithoutAPredictionNoLimitIsKept) {
  const RouteValue v = value_of({1000.0, 200.0, kInfinite}, {5.0, 0.5, 600.0});
  EXPECT_FALSE(v.keeps_limit);
  EXPECT_DOUBLE_EQ(v.cost_s, 500.0);
}

}  // namespace
}  // namespace rcs::vj
