#include "rcs/zones/zones.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/heap_guard.h"
#include "tests/zones/random_zones.h"

namespace rcs {
namespace {

Zone square(ZoneKind kind, const char* name, double x_m, double y_m, double half_m) {
  Zone zone;
  zone.kind = kind;
  zone.name = name;
  zone.polygons.push_back({{{x_m - half_m, y_m - half_m},
                            {x_m + half_m, y_m - half_m},
                            {x_m + half_m, y_m + half_m},
                            {x_m - half_m, y_m + half_m}},
                           {}});
  return zone;
}

TEST(Zones, ClearanceIsTheDistanceToWhatIsForbidden) {
  const Zones zones({square(ZoneKind::kFence, "site", 0.0, 0.0, 100.0),
                     square(ZoneKind::kKeepOut, "pond", 20.0, 0.0, 5.0)});
  EXPECT_DOUBLE_EQ(zones.clearance({0.0, 0.0}).m, 15.0);
  EXPECT_EQ(zones.clearance({0.0, 0.0}).zone->name, "pond");
  EXPECT_DOUBLE_EQ(zones.clearance({-90.0, 0.0}).m, 10.0);
  EXPECT_EQ(zones.clearance({-90.0, 0.0}).zone->name, "site");
  EXPECT_DOUBLE_EQ(zones.clearance({18.0, 0.0}).m, -3.0);
  EXPECT_EQ(zones.clearance({18.0, 0.0}).zone->name, "pond");
  EXPECT_DOUBLE_EQ(zones.clearance({0.0, 104.0}).m, -4.0);
  EXPECT_EQ(zones.clearance({0.0, 104.0}).zone->name, "site");
  EXPECT_EQ(Zones().clearance({0.0, 0.0}).zone, nullptr);
  EXPECT_EQ(Zones().clearance({0.0, 0.0}).m, test::kNoBorder);
}

TEST(Zones, APositionInsideAnyFenceIsAllowed) {
  const Zones zones({square(ZoneKind::kFence, "west", -9.0, 0.0, 10.0),
                     square(ZoneKind::kFence, "east", 9.0, 0.0, 10.0)});
  EXPECT_GT(zones.clearance({-5.0, 0.0}).m, 0.0);
  EXPECT_GT(zones.clearance({5.0, 0.0}).m, 0.0);
  EXPECT_LT(zones.clearance({0.0, 12.0}).m, 0.0);
  // Through the overlap of 2 m, with less than half of it as margin.
  EXPECT_EQ(zones.conflict({-15.0, 0.0}, {15.0, 0.0}, 0.9), nullptr);
  EXPECT_NE(zones.conflict({-15.0, 0.0}, {15.0, 0.0}, 1.1), nullptr);
}

TEST(Zones, ClearanceAgreesWithBruteForce) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> at(-130.0, 130.0);
  int forbidden = 0;
  for (int scene = 0; scene < 60; ++scene) {
    const std::vector<Zone> drawn = test::random_zones(1 + scene % 9, &rng);
    const Zones zones(drawn);
    for (int k = 0; k < 300; ++k) {
      const Vec2 p(at(rng), at(rng));
      const double expected = test::brute_clearance(drawn, p);
      const ZoneClearance found = zones.clearance(p);
      ASSERT_NEAR(found.m, expected, 1e-9) << "scene " << scene << " at " << p.transpose();
      ASSERT_EQ(found.zone == nullptr, std::isinf(expected));
      forbidden += expected < 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(forbidden, 3000);
}

// A segment conflicts exactly if one of its points has less clearance than the margin.
TEST(Zones, ConflictsOfSegmentsAgreeWithTheClearanceOfTheirPoints) {
  std::mt19937 rng(8);
  std::uniform_real_distribution<double> at(-60.0, 60.0);
  std::uniform_real_distribution<double> margin(0.0, 4.0);
  int conflicts = 0;
  int free = 0;
  for (int scene = 0; scene < 80; ++scene) {
    const Zones zones(test::random_zones(1 + scene % 7, &rng));
    for (int k = 0; k < 100; ++k) {
      const Vec2 from(at(rng), at(rng));
      const Vec2 to = from + Vec2(at(rng), at(rng)) / 3.0;
      const double margin_m = k % 10 == 0 ? 0.0 : margin(rng);
      double least = test::kNoBorder;
      constexpr int kSteps = 400;
      for (int n = 0; n <= kSteps; ++n) {
        const Vec2 p = from + (static_cast<double>(n) / kSteps) * (to - from);
        least = std::min(least, zones.clearance(p).m);
      }
      // The clearance changes by no more than the distance: between two samples by this much.
      const double step_m = (to - from).norm() / kSteps;
      const Zone* const zone = zones.conflict(from, to, margin_m);
      if (least < margin_m - 1e-5) {
        ASSERT_NE(zone, nullptr) << "scene " << scene << ", " << least << " < " << margin_m;
        ++conflicts;
      } else if (least > margin_m + step_m) {
        ASSERT_EQ(zone, nullptr) << "scene " << scene << ", " << least << " > " << margin_m;
        ++free;
      }
    }
  }
  EXPECT_GT(conflicts, 1000);
  EXPECT_GT(free, 300);
}

TEST(Zones, TheLowestLimitOfTheSpeedZonesApplies) {
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> at(-100.0, 100.0);
  for (int scene = 0; scene < 30; ++scene) {
    const std::vector<Zone> drawn = test::random_zones(9, &rng);
    const Zones zones(drawn);
    for (int k = 0; k < 100; ++k) {
      const Vec2 p(at(rng), at(rng));
      const double margin_m = k % 2 == 0 ? 0.0 : 3.0;
      double expected = test::kNoBorder;
      for (const Zone& zone : drawn) {
        if (test::deepest({zone}, ZoneKind::kSpeed, p) >= -margin_m) {
          expected = std::min(expected, zone.speed_mps);
        }
      }
      ASSERT_EQ(zones.speed_limit_mps(p, margin_m), expected);
    }
    // Without a bound of the position error all limits apply.
    EXPECT_EQ(zones.speed_limit_mps({0.0, 0.0}, test::kNoBorder), drawn[2].speed_mps);
  }
}

TEST(Zones, ARoadCountsWhereThePositionIsCertainlyOnIt) {
  const auto road = [](double south_m, double north_m, double speed_mps) {
    return Zone{ZoneKind::kRoad,
                "road",
                speed_mps,
                {{{{-50.0, south_m}, {50.0, south_m}, {50.0, north_m}, {-50.0, north_m}}, {}}}};
  };
  const Zones zones({road(-3.0, 3.0, 8.0), road(-1.0, 9.0, 12.0)});
  EXPECT_FALSE(zones.forbids());
  EXPECT_EQ(zones.road_speed_mps({0.0, 0.0}, 2.9), 8.0);
  EXPECT_EQ(zones.road_speed_mps({0.0, 0.0}, 0.9), 12.0) << "the faster of two";
  EXPECT_EQ(zones.road_speed_mps({0.0, 0.0}, 3.1), 0.0);
  EXPECT_EQ(zones.road_speed_mps({0.0, 4.0}, 4.5), 12.0);
  EXPECT_EQ(zones.road_speed_mps({49.0, 0.0}, 2.0), 0.0) << "its end is a border";
  EXPECT_EQ(zones.road_speed_mps({0.0, 0.0}, std::numeric_limits<double>::infinity()), 0.0);
  EXPECT_EQ(zones.speed_limit_mps({0.0, 0.0}, 1.0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(zones.clearance({0.0, 0.0}).zone, nullptr);
}

TEST(Zones, QueriesAllocateNothing) {
  if (!test::HeapGuard::available()) GTEST_SKIP() << "SKIPPED: a sanitizer owns malloc";
  std::mt19937 rng(10);
  const Zones zones(test::random_zones(9, &rng));
  const test::HeapGuard guard;
  double sum = 0.0;
  for (int k = 0; k < 100; ++k) {
    const Vec2 p(k - 50.0, 0.5 * k);
    sum += zones.clearance(p).m + zones.speed_limit_mps(p, 1.0);
    sum += zones.conflict(p, {0.0, 0.0}, 1.0) != nullptr ? 1.0 : 0.0;
  }
  EXPECT_EQ(guard.allocations(), 0) << sum;
}

}  // namespace
}  // namespace rcs
