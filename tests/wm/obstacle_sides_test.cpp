#include "modules/wm/terrain/obstacle_sides.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace rcs::wm {
namespace {

/// A row of cells in the middle of a patch: '#' an obstacle, 'H' a hidden one, 'v' vegetation,
/// digits the height [dm], '?' unknown. @return the row with its sides
std::string joined(const std::string& row, double side_m = 0.15) {
  const int width = static_cast<int>(row.size());
  std::vector<TerrainAnswer> answers(3 * row.size());
  for (TerrainAnswer& a : answers) a.known = true;
  for (std::size_t i = 0; i < row.size(); ++i) {
    TerrainAnswer& a = answers[row.size() + i];
    a.known = row[i] != '?';
    a.hidden = row[i] == 'H';
    a.obstacle = row[i] == '#' || a.hidden;
    a.vegetation = row[i] == 'v';
    a.low_m = row[i] >= '0' && row[i] <= '9' ? 0.1F * static_cast<float>(row[i] - '0') : 0.3F;
  }
  join_sides(width, side_m, &answers);
  std::string out = row;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const TerrainAnswer& a = answers[row.size() + i];
    if (a.obstacle && !a.hidden) out[i] = '#';
    EXPECT_FALSE(a.side);
  }
  return out;
}

TEST(ObstacleSides, RaisedGroundBesideAnObstacleIsAPartOfIt) {
  EXPECT_EQ(joined("0002#2000"), "000###000");
  EXPECT_EQ(joined("0022#2200"), "00#####00") << "the next cells, too";
  EXPECT_EQ(joined("0222#2220"), "02#####20") << "no farther: a slope is no rock";
}

TEST(ObstacleSides, OtherGroundIsNot) {
  EXPECT_EQ(joined("0001#1000"), "0001#1000") << "too low";
  EXPECT_EQ(joined("0020200#0"), "0020200#0") << "apart";
  EXPECT_EQ(joined("002H20000"), "002H20000") << "an edge has no sides";
  EXPECT_EQ(joined("00v#v?000"), "00v#v?000") << "vegetation gives way; unknown ground stays so";
  EXPECT_EQ(joined("0002#2000", 0.0), "0002#2000") << "off";
}

TEST(ObstacleSides, SmallPatchesAreLeftAlone) {
  std::vector<TerrainAnswer> none;
  join_sides(128, 0.15, &none);
  join_sides(0, 0.15, &none);
  std::vector<TerrainAnswer> one(1);
  join_sides(1, 0.15, &one);
  EXPECT_FALSE(one[0].obstacle);
}

}  // namespace
}  // namespace rcs::wm
