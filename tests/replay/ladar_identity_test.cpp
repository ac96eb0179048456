// Facets of a LADAR that is not the configured one are rejected.

#include <gtest/gtest.h>

#include "modules/sp/sp_messages_node.h"

namespace rcs::test {
namespace {

TEST(LadarIdentity, FacetsOfAnotherSensorAreRejected) {
  sp::LadarParams ladar;
  ladar.sensor_id = 2;
  ladar_points_t points{};
  points.facet_count = 1;
  points.sensor_id = 2;
  EXPECT_TRUE(sp::identify(points, ladar).has_value());
  points.sensor_id = 0;
  EXPECT_FALSE(sp::identify(points, ladar).has_value());

  ladar_ranges_t ranges{};
  ranges.facet_count = 1;
  ranges.rows = static_cast<std::int16_t>(ladar.rows);
  ranges.cols = static_cast<std::int16_t>(ladar.cols);
  ranges.sensor_id = 2;
  EXPECT_TRUE(sp::identify(ranges, ladar).has_value());
  ranges.sensor_id = 1;
  EXPECT_FALSE(sp::identify(ranges, ladar).has_value());
}

}  // namespace
}  // namespace rcs::test
