// Ground that an edge hides: profiles of the ground, and scans of ditches, drops and crests as an
// imager with rows of 0.625 deg, 1.8 m above the ground, sees them.

#include "modules/wm/terrain/hidden_gap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "modules/wm/terrain/terrain_grid.h"
#include "tests/wm/imager.h"

namespace rcs::wm {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

HiddenGap gap_of(const std::vector<float>& z_m) {
  return hidden_gap(
      [&](int k) {
        return k < static_cast<int>(z_m.size()) ? z_m[static_cast<std::size_t>(k)] : kNone;
      },
      0.2, HiddenGapParams{});
}

TEST(HiddenGap, TableOfProfiles) {
  struct Row {
    const char* what;
    std::vector<float> z_m;  // from the far place towards the LADAR, every 0.2 m
    int cells;
    bool hidden;
  };
  const std::vector<Row> rows = {
      {"level ground, seen without gaps", {0, 0, 0, 0, 0, 0}, 0, false},
      {"level ground between rows", {0, kNone, kNone, 0, 0, kNone, 0, 0}, 2, false},
      {"a uniform slope between rows", {-0.3F, kNone, kNone, 0, 0.1F, 0.2F, 0.3F, 0.4F}, 2, false},
      {"the far wall of a ditch", {-0.25F, kNone, kNone, kNone, 0, 0, 0, kNone, 0}, 3, true},
      {"the far wall of a ditch in a slope up",
       {-0.05F, kNone, kNone, kNone, 0, -0.05F, -0.1F, -0.15F, -0.2F},
       3,
       true},
      {"the foot of a slope", {0.0F, kNone, kNone, kNone, 0, 0.05F, 0.1F, 0.15F, 0.2F}, 3, false},
      {"a step down of 0.1 m", {-0.1F, kNone, kNone, 0, 0, 0, 0, 0}, 2, false},
      {"a gap of one cell", {-0.3F, kNone, 0, 0, 0, 0, 0}, 1, false},
      {"a crest with a radius of 25 m",
       {-0.0784F, kNone, kNone, kNone, kNone, -0.0196F, -0.0096F, -0.0036F, 0, 0, 0},
       4,
       false},
      {"below a drop of 2 m",
       {-2, kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone, 0, 0, 0, 0},
       9,
       true},
      {"0.25 m lower, behind even ground", {-0.25F, kNone, kNone, kNone, 0, 0, 0, 0, 0}, 3, true},
      {"0.25 m lower, behind bumps or grass",
       {-0.25F, kNone, kNone, kNone, 0, 0.06F, -0.06F, 0.06F, -0.04F, 0.02F, 0},
       3,
       false},
      {"a single place on the near side", {-0.3F, kNone, kNone, kNone, 0, kNone, kNone}, 0, false},
      {"nothing on the near side", {-0.3F, kNone, kNone, kNone}, 0, false},
      {"higher ground behind a hollow", {0.4F, kNone, kNone, kNone, 0, 0, 0, 0}, 3, false},
  };
  for (const Row& row : rows) {
    const HiddenGap gap = gap_of(row.z_m);
    EXPECT_EQ(gap.cells, row.cells) << row.what;
    EXPECT_EQ(gap.hidden, row.hidden) << row.what;
  }
}

using Ground = std::function<double(double x_m)>;

/// The vehicle approaches along x from -25 m and stops where the patch shows hidden ground.
class Approach {
 public:
  /// @param ground_from_far  what scans from more than 14 m show, because their poses are wrong
  explicit Approach(const Ground& ground, const Ground& ground_from_far)
      : ground_(ground), from_far_(ground_from_far), grid_(params()) {}

  /// @return distance of the LADAR before x = 0 where the first hidden cell in its way is known, or
  /// 0 if none is
  double detect() {
    for (double x = -25.0; x < -2.0; x += 0.3) {
      const Pose T{Quat::Identity(), Vec3(x, 0.0, ground_(x) + 0.9)};
      scan(T);
      if (sees_hidden(T)) return -(x + 0.9);
    }
    return 0.0;
  }

 private:
  static TerrainParams params() {
    TerrainParams p;
    p.edge_range_m = 10.0;
    p.p_vehicle_ladar = kImager;
    return p;
  }
  void scan(const Pose& T) {
    const Ground& seen = T.p.x() < -14.0 ? from_far_ : ground_;
    grid_.insert(imager_scan(
                     T,
                     [&seen](const Vec3& from, const Vec3& ray) {
                       return first_inside(from, ray,
                                           [&seen](const Vec3& p) { return p.z() <= seen(p.x()); });
                     },
                     &rng_),
                 T);
  }
  bool sees_hidden(const Pose& T) {
    const Cell first = grid_.patch(T, &answers_);
    const int side = grid_.params().patch;
    for (std::size_t k = 0; k < answers_.size(); ++k) {
      const int row = first.j + static_cast<int>(k) / side;
      const double y = 0.4 * (row + 0.5);
      if (std::abs(y) < 1.0 && answers_[k].hidden) {
        EXPECT_TRUE(answers_[k].obstacle);
        return true;
      }
    }
    return false;
  }

  Ground ground_;
  Ground from_far_;
  TerrainGrid grid_;
  std::vector<TerrainAnswer> answers_;
  std::mt19937 rng_{7};
};

Ground ditch(double width_m, double depth_m) {
  return [=](double x) {
    const double inside = 0.5 * width_m - std::abs(x - 0.5 * width_m);
    return -depth_m * std::clamp(inside / std::min(0.35 * depth_m, 0.5 * width_m), 0.0, 1.0);
  };
}
Ground drop(double depth_m) {
  return [=](double x) { return -depth_m * std::clamp(x / 0.2, 0.0, 1.0); };
}
/// A round crest at x = 0, and the slope of 15 deg behind it.
Ground crest(double radius_m) {
  return [=](double x) {
    const double end = radius_m * std::sin(radians(15.0));
    if (x < 0.0) return 0.0;
    if (x < end) return std::sqrt(radius_m * radius_m - x * x) - radius_m;
    return radius_m * (std::cos(radians(15.0)) - 1.0) - (x - end) * std::tan(radians(15.0));
  };
}

TEST(HiddenGround, IsDetectedBeforeTheVehicleReachesIt) {
  struct Row {
    const char* what;
    Ground ground;
    double min_m;  ///< smallest distance of the LADAR that is enough
    double max_m;
  };
  const std::vector<Row> rows = {
      {"ditch 0.6 m wide, 0.8 m deep", ditch(0.6, 0.8), 5.0, 12.0},
      {"ditch 1 m wide, 1 m deep", ditch(1.0, 1.0), 7.5, 12.0},
      {"ditch 1.5 m wide, 1.2 m deep", ditch(1.5, 1.2), 7.5, 12.0},
      {"ditch 2.5 m wide, 1.5 m deep", ditch(2.5, 1.5), 7.5, 12.0},
      {"drop of 0.5 m", drop(0.5), 7.5, 12.0},
      {"drop of 1 m", drop(1.0), 6.5, 12.0},
      {"hollow 1 m wide, 0.1 m deep", ditch(1.0, 0.1), 0.0, 0.0},
      {"level ground", [](double) { return 0.0; }, 0.0, 0.0},
      {"crest with a radius of 20 m", crest(20.0), 0.0, 0.0},
      {"crest with a radius of 40 m", crest(40.0), 0.0, 0.0},
  };
  for (const Row& row : rows) {
    const double at_m = Approach(row.ground, row.ground).detect();
    std::printf("%-32s detected at %.1f m\n", row.what, at_m);
    EXPECT_GE(at_m, row.min_m) << row.what;
    EXPECT_LE(at_m, row.max_m) << row.what;
  }
}

TEST(HiddenGround, IsDetectedAlthoughScansFromFarAwayShowedLevelGroundThere) {
  const Ground level = [](double) { return 0.0; };
  EXPECT_GE(Approach(ditch(1.0, 1.0), level).detect(), 7.5);
  EXPECT_GE(Approach(ditch(2.5, 1.5), level).detect(), 7.5);
}

}  // namespace
}  // namespace rcs::wm
