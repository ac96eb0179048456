#include "modules/sp/prior/raster_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "modules/sp/prior/prior_match.h"
#include "modules/sp/prior/prior_scan.h"
#include "tests/support/point_scenes.h"
#include "tests/support/real_sweeps.h"
#include "tests/support/street_raster.h"
#include "tools/studies/match_starts.h"

namespace rcs::sp {
namespace {

constexpr WorkUnits kPlenty = 1'000'000'000;
constexpr double kHalfMetre_m = 0.5;

PriorMatchParams searching() {
  PriorMatchParams params;
  params.search_sigma_m = 1.0;
  return params;
}

PriorScan scan_of(const test::RasterPlace& place) {
  PriorScanParams columns;
  columns.column_m = kHalfMetre_m;
  PriorScan scan;
  scan.take(place.scan, place.T_map_vehicle.q.conjugate() * Vec3::UnitZ(), 0, columns);
  return scan;
}

studies::MatchEnds match(const test::RasterPlace& place, const test::RasterErrors& errors) {
  studies::MatchStarts starts;
  starts.starts = 12;
  return match_from_starts(scan_of(place), raster_map(place, errors), place.T_map_vehicle, starts,
                           searching(), [](int) {});
}

test::RasterPlace street(double slope_deg, bool kerbs, std::uint32_t seed) {
  return test::simulated_street({radians(slope_deg), kerbs, seed});
}

TEST(RasterSearch, AStreetIsFoundFromMetresAwayAtOnePlace) {
  for (const double slope_deg : {1.7, 4.5}) {
    const test::RasterPlace place = street(slope_deg, true, 1);
    for (const double correlation_m : {0.0, 1.5}) {
      const studies::MatchEnds ends = match(place, {0.3, 0.05, correlation_m, 0.05, 1});
      EXPECT_EQ(ends.converged + ends.refused, 12) << place.name;
      // The more the errors resemble ground, the more starts are refused.
      EXPECT_LE(ends.refused, correlation_m > 0.0 ? 6 : 0) << place.name;
      EXPECT_TRUE(ends.inside(place.T_map_vehicle.p.head<2>())) << place.name;
    }
  }
}

// The only slopes along the street are errors of the raster.
TEST(RasterSearch, SlopesThatAreErrorsOfTheRasterAreRefused) {
  const test::RasterPlace place = street(0.0, false, 1);
  for (const test::RasterErrors& errors :
       {test::RasterErrors{0.3, 0.05, 0.0, 0.05, 1}, test::RasterErrors{0.3, 0.15, 1.5, 0.15, 1},
        test::RasterErrors{1.0, 0.05, 1.5, 0.05, 1}}) {
    EXPECT_EQ(match(place, errors).refused, 12) << errors.sigma_m;
  }
}

registration::Prediction off(const Pose& T, double distance_m, double sigma_m) {
  return test::prediction(T * test::pose(distance_m, -0.5 * distance_m, 0.1, 0.0, 0.0, 0.01),
                          sigma_m, 0.02);
}

TEST(RasterSearch, ARefusedMatchHasInformationAboutTheHeightAlone) {
  const test::RasterPlace place = street(0.0, false, 2);
  const PriorScan scan = scan_of(place);
  const ElevationMap map = raster_map(place, {0.3, 0.05, 0.0, 0.05, 2});
  const registration::Prediction prediction = off(place.T_map_vehicle, 1.0, 2.0);
  PriorMatchWorkspace workspace;
  const registration::Registration r =
      match_prior_map(scan.ground(), {}, map, prediction, searching(), kPlenty, &workspace)
          .registration;
  ASSERT_EQ(r.stop, registration::Stop::kDegenerate);
  EXPECT_EQ(r.T_target_vehicle.p.head<2>(), prediction.T_target_vehicle.p.head<2>());
  EXPECT_NEAR(r.T_target_vehicle.p.z(), place.T_map_vehicle.p.z(), 0.1);
  const Vec3 up = prediction.T_target_vehicle.rotation().transpose() * Vec3::UnitZ();
  EXPECT_GT(up.dot(r.information.topLeftCorner<3, 3>() * up), 1.0);
  EXPECT_LT(r.information.norm() - up.dot(r.information.topLeftCorner<3, 3>() * up), 1e-9);
}

TEST(RasterSearch, ACertainPredictionIsTrackedWithoutASearch) {
  const test::RasterPlace place = street(3.0, true, 3);
  const PriorScan scan = scan_of(place);
  const ElevationMap map = raster_map(place, {0.3, 0.05, 0.0, 0.05, 3});
  const registration::Prediction prediction = off(place.T_map_vehicle, 0.3, 0.5);
  PriorMatchWorkspace workspace;
  const auto tracked = [&](const PriorMatchParams& params) {
    return match_prior_map(scan.ground(), {}, map, prediction, params, kPlenty, &workspace)
        .registration;
  };
  const registration::Registration a = tracked(searching());
  const registration::Registration b = tracked(PriorMatchParams{});
  EXPECT_EQ(a.T_target_vehicle.p, b.T_target_vehicle.p);
  EXPECT_EQ(a.information, b.information);
  EXPECT_EQ(a.used, b.used);
}

TEST(RasterSearch, ASearchUsesNoMoreThanItsGrant) {
  const test::RasterPlace place = street(3.0, true, 3);
  const PriorScan scan = scan_of(place);
  const ElevationMap map = raster_map(place, {0.3, 0.05, 0.0, 0.05, 3});
  const registration::Prediction prediction = off(place.T_map_vehicle, 1.0, 2.0);
  PriorMatchWorkspace workspace;
  for (const WorkUnits granted : {1000, 20'000, 200'000, 1'000'000}) {
    const registration::Registration r =
        match_prior_map(scan.ground(), {}, map, prediction, searching(), granted, &workspace)
            .registration;
    EXPECT_LE(r.used, granted);
  }
}

// On a slope, a wrong heading is a wrong tilt, too.
TEST(RasterSearch, TheResultDoesNotDependOnTheTiltOfTheStart) {
  const test::RasterPlace place = street(6.0, true, 5);
  const PriorScan scan = scan_of(place);
  const ElevationMap map = raster_map(place, {0.3, 0.02, 0.0, 0.02, 5});
  PriorMatchWorkspace workspace;
  std::vector<Vec3> ends;
  for (const double tilt_rad : {-0.02, 0.0, 0.02}) {
    registration::Prediction prediction = off(place.T_map_vehicle, 1.0, 2.0);
    prediction.T_target_vehicle = prediction.T_target_vehicle *
                                  test::pose(0.0, 0.0, 0.0, tilt_rad, -tilt_rad, 3.0 * tilt_rad);
    const registration::Registration r =
        match_prior_map(scan.ground(), {}, map, prediction, searching(), kPlenty, &workspace)
            .registration;
    ASSERT_EQ(r.stop, registration::Stop::kConverged);
    ends.push_back(r.T_target_vehicle.p);
  }
  EXPECT_LT((ends[0] - ends[1]).norm(), 0.02);
  EXPECT_LT((ends[2] - ends[1]).norm(), 0.02);
}

TEST(RasterSearch, TheSameScanGivesTheSameResult) {
  const test::RasterPlace place = street(2.0, true, 4);
  const PriorScan scan = scan_of(place);
  const ElevationMap map = raster_map(place, {0.3, 0.02, 0.0, 0.02, 4});
  const registration::Prediction prediction = off(place.T_map_vehicle, 1.0, 2.0);
  PriorMatchWorkspace workspace;
  const auto once = [&] {
    return match_prior_map(scan.ground(), {}, map, prediction, searching(), kPlenty, &workspace)
        .registration;
  };
  const registration::Registration a = once();
  const registration::Registration b = once();
  EXPECT_EQ(a.T_target_vehicle.p, b.T_target_vehicle.p);
  EXPECT_EQ(a.information, b.information);
}

// ---- slopes of the scan ----------------------------------------------------------------------

std::vector<ScanGroundCell> ground_of(const Points& points) {
  ScanGroundWorkspace workspace;
  std::vector<ScanGroundCell> cells;
  find_scan_ground(points, Mat3::Identity(), &workspace, &cells);
  return cells;
}

Points plane(double half_m, const Vec2& slope) {
  Points points;
  for (double x = -half_m; x < half_m; x += 0.25) {
    for (double y = -half_m; y < half_m; y += 0.25) {
      points.push_back(Vec3(x, y, slope.dot(Vec2(x, y))).cast<float>());
    }
  }
  return points;
}

TEST(ScanGround, APlaneHasItsSlopes) {
  const Vec2 slope(0.1, -0.05);
  for (const ScanGroundCell& cell : ground_of(plane(5.0, slope))) {
    // The windows of cells at the border are smaller, so that the prior of a slope weighs more.
    const bool border = cell.p.head<2>().cwiseAbs().maxCoeff() > 3.5;
    EXPECT_LT((cell.slope - slope).norm(), border ? 0.35 * slope.norm() : 0.005);
  }
}

TEST(ScanGround, ALineOfPointsHasNoSlopeAcross) {
  Points line;
  for (double x = -10.0; x < 10.0; x += 0.2) {
    line.push_back(Vec3(x, 20.0 + 0.02 * x, 0.1 * x + 0.2 * std::sin(x)).cast<float>());
  }
  for (const ScanGroundCell& cell : ground_of(line)) EXPECT_LT(std::abs(cell.slope.y()), 0.02);
}

TEST(ScanGround, ACarDoesNotTiltTheGroundBesideIt) {
  Points points = plane(8.0, Vec2(0.03, 0.0));
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (std::abs(points.x[k]) < 2.2F && std::abs(points.y[k]) < 0.9F) points.z[k] += 0.5F;
  }
  double square = 0.0;
  int n = 0;
  for (const ScanGroundCell& cell : ground_of(points)) {
    if (std::abs(cell.p.x()) < 2.5 && std::abs(cell.p.y()) < 1.5) continue;
    square += (cell.slope - Vec2(0.03, 0.0)).squaredNorm();
    ++n;
  }
  EXPECT_LT(std::sqrt(square / n), 0.015);
}

TEST(ScanGround, ACarAndAWallAreNotGround) {
  Points points = plane(8.0, Vec2(0.1, 0.0));
  std::size_t ground = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const bool car = std::abs(points.x[k]) < 2.2F && std::abs(points.y[k]) < 0.9F;
    const bool wall = points.y[k] > 7.0F;
    if (!car && !wall) ++ground;
    points.z[k] += car ? 1.4F : wall ? 1.0F : 0.0F;
  }
  const std::vector<ScanGroundCell> cells = ground_of(points);
  // Cells at the border of an object contain ground, too.
  for (const ScanGroundCell& cell : cells) EXPECT_LE(cell.p.z() - 0.1 * cell.p.x(), 0.5001);
  // A cell has four points.
  EXPECT_GT(cells.size(), ground / 4 * 9 / 10);
}

TEST(ScanGround, AKerbAndASteepSlopeAreGround) {
  const std::size_t all = ground_of(plane(8.0, Vec2(0.0, 0.0))).size();
  EXPECT_EQ(ground_of(plane(8.0, Vec2(0.4, 0.0))).size(), all);
  Points kerb = plane(8.0, Vec2(0.02, 0.0));
  for (std::size_t k = 0; k < kerb.size(); ++k) kerb.z[k] += kerb.y[k] > 2.0F ? 0.12F : 0.0F;
  EXPECT_EQ(ground_of(kerb).size(), all);
}

// Real sweeps between parked cars and bushes, and the real raster of the street.
TEST(RasterSearch, RealSweepsOfAStreetAreFoundAtOnePlaceOrRefused) {
  const char* data = std::getenv("RCS_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "RCS_DATA_DIR is not set";
  const Result<test::RealSweeps> sweeps = test::pittsburgh_sweeps(data, 0.05);
  ASSERT_TRUE(sweeps) << sweeps.error().message;
  const ElevationMap map = test::map_of(sweeps->frame, sweeps->raster);
  for (const test::RasterPlace& place : sweeps->places) {
    studies::MatchStarts starts;
    starts.starts = 12;
    const studies::MatchEnds ends = match_from_starts(scan_of(place), map, place.T_map_vehicle,
                                                      starts, searching(), [](int) {});
    EXPECT_EQ(ends.converged + ends.refused, 12) << place.name;
    if (ends.poses.empty()) continue;
    EXPECT_TRUE(ends.inside(place.T_map_vehicle.p.head<2>())) << place.name;
  }
}

TEST(RasterFit, AdvantageIsInStandardDeviations) {
  std::mt19937 rng(1);
  std::normal_distribution<double> normal(1.0, 2.0);
  constexpr int kBlocks = 400;
  std::vector<double> first(kBlocks, 5.0), second;
  for (int k = 0; k < kBlocks; ++k) second.push_back(5.0 + normal(rng));
  // The mean is 1 with a standard deviation of 2 / sqrt(400).
  EXPECT_NEAR(advantage(first, second), 10.0, 1.5);
  EXPECT_NEAR(advantage(second, first), -10.0, 1.5);
}

}  // namespace
}  // namespace rcs::sp
