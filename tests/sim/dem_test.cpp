#include "sim/terrain/dem.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "sim/terrain/relief.h"

namespace rcs::sim {
namespace {

constexpr char kGrid[] =
    "ncols 4\nnrows 4\nxllcorner 500000\nyllcorner 4000000\ncellsize 10\nNODATA_value -9999\n"
    "13 14 15 16\n9 10 11 12\n5 6 -9999 8\n1 2 3 4\n";

TEST(Dem, FirstRowIsNorth) {
  const Result<Dem> dem = parse_esri_ascii(kGrid, "x.asc");
  ASSERT_TRUE(dem) << dem.error().message;
  EXPECT_EQ(dem->z_m[0], 1.0F);
  EXPECT_EQ(dem->z_m[3], 4.0F);
  EXPECT_EQ(dem->z_m[15], 16.0F);
  EXPECT_EQ(dem->cell_x_m, 10.0);
  EXPECT_NEAR(dem->z_m[6], 129.0 / 15.0, 1e-5);  // unknown: the mean of the others
}

TEST(Dem, BadFilesAreNamed) {
  const std::string grid = kGrid;
  for (const std::string& bad :
       {std::string(), std::string("hello"), grid.substr(0, grid.size() - 3),
        std::string("ncols 4\nnrows x\n"), std::string("ncols 1e9\nnrows 4\ncellsize 1\n1 2 3"),
        std::string("ncols 4\nnrows 4\ncellsize -1\n")}) {
    const Result<Dem> dem = parse_esri_ascii(bad, "x.asc");
    ASSERT_FALSE(dem) << bad;
    EXPECT_NE(dem.error().message.find("x.asc"), std::string::npos);
  }
}

TEST(Dem, ReliefGoesThroughItsNodes) {
  const Result<Dem> dem = parse_esri_ascii(kGrid, "x.asc");
  ASSERT_TRUE(dem);
  const Relief relief(1, {}, *dem);
  // The middle of the grid is at 0, its mean height at 0.
  EXPECT_NEAR(relief.height(-15.0, -15.0) - relief.height(15.0, 15.0), 1.0 - 16.0, 1e-4);
}

TEST(Dem, RealAppalachians) {
  const char* const data = std::getenv("RCS_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "RCS_DATA_DIR is not set: no real DEM";
  std::ifstream file(std::string(data) + "/terrain_dem/jacksboro_fault_dem.asc");
  ASSERT_TRUE(file);
  std::ostringstream text;
  text << file.rdbuf();
  const Result<Dem> dem = parse_esri_ascii(text.str(), "jacksboro_fault_dem.asc");
  ASSERT_TRUE(dem) << dem.error().message;
  EXPECT_NEAR(dem->cell_y_m, 92.7, 1.0);  // 3 seconds of arc
  EXPECT_LT(dem->cell_x_m, dem->cell_y_m);
  const Relief relief(1, {}, *dem);
  EXPECT_LT(relief.height(0.0, 0.0), 600.0);
}

}  // namespace
}  // namespace rcs::sim
