// Logs as MCAP files and back.

#include "tools/mcap/log_export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "lcmtypes/channel_types.h"
#include "rcs/cdr/cdr_message.h"
#include "tests/support/random_message.h"
#include "tools/mcap/ladar_facets.h"
#include "tools/mcap/log_import.h"

namespace rcs::mcap {
namespace {

TEST(ToLcm, DamagedMessagesGiveLcmMessagesOrNone) {
  // encode() of LCM reads as many elements as the length fields state: a message whose arrays are
  // shorter must not reach it.
  std::mt19937 random(3);
  std::vector<std::uint8_t> cdr;
  std::vector<std::uint8_t> lcm;
  int accepted = 0;
  int cases = 0;
  for (const channel::Info& c : channel::kAll) {
    channel::with_type_of(c.name, [&](const auto* type) {
      using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
      cdr::write_message(test::RandomMessage(2).make<T>(), &cdr);
      ASSERT_TRUE(to_lcm(c.name, cdr.data(), cdr.size(), &lcm)) << c.name;
      for (int i = 0; i < 300; ++i, ++cases) {
        std::vector<std::uint8_t> damaged = test::mutated(cdr, &random);
        damaged.shrink_to_fit();
        if (!to_lcm(c.name, damaged.data(), damaged.size(), &lcm)) continue;
        ++accepted;
        T message{};
        const int size = static_cast<int>(lcm.size());
        EXPECT_EQ(message.decode(lcm.data(), 0, size), size) << c.name;
      }
    });
  }
  EXPECT_GT(cases, 10'000);
  EXPECT_GT(accepted, 1000);
}

TEST(ToLcm, AShorterArrayThanItsLengthIsRejected) {
  plan_t m{};
  m.n = 2;
  m.point.resize(1);
  std::vector<std::uint8_t> cdr;
  cdr::write_message(m, &cdr);
  std::vector<std::uint8_t> lcm;
  EXPECT_FALSE(to_lcm("BG_PLAN", cdr.data(), cdr.size(), &lcm));
  m.n = 1;
  cdr::write_message(m, &cdr);
  EXPECT_TRUE(to_lcm("BG_PLAN", cdr.data(), cdr.size(), &lcm));
  EXPECT_FALSE(to_lcm("CAMERA", cdr.data(), cdr.size(), &lcm));
}

TEST(FacetPoints, AFacetOfRangesHasRowsAndTimes) {
  sp::LadarParams ladar;
  ladar.rows = 4;
  ladar.cols = 3;
  ladar.T_vehicle_mount.p = {5.0, 0.0, 0.0};
  ladar_ranges_t m{};
  m.rows = 4;
  m.cols = 3;
  m.first_row = 2;
  m.facet_rows = 2;
  m.facet_count = 2;
  m.facet = 1;
  m.scan_id = 9;
  m.utime = 1'000'000;
  m.reference_utime = 1'050'000;
  m.duration_us = 30'000;
  m.n = 6;
  m.range_m = {10.0F, 0.0F, 10.0F, 10.0F, 10.0F, 10.0F};
  const std::optional<ros2::CloudPart> part = FacetPoints(ladar)(m);
  ASSERT_TRUE(part.has_value());
  EXPECT_EQ(part->scan_id, 9);
  EXPECT_EQ(part->part, 1);
  EXPECT_THAT(part->ring, testing::ElementsAre(2, 2, 3, 3, 3));
  EXPECT_THAT(part->utime,
              testing::ElementsAre(1'000'000, 1'020'000, 1'000'000, 1'010'000, 1'020'000));
  for (std::size_t i = 0; i < part->x_m.size(); ++i) {
    EXPECT_NEAR(Vec3f(part->x_m[i], part->y_m[i], part->z_m[i]).norm(), 10.0F, 1e-4F)
        << "in the frame of the mount";
  }
  m.sensor_id = 1;
  EXPECT_FALSE(FacetPoints(ladar)(m).has_value());
}

}  // namespace
}  // namespace rcs::mcap
