#include "modules/sp/prior/prior_match.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/support/point_scenes.h"
#include "tools/mapping/coarser.h"

namespace rcs::sp {
namespace {

constexpr WorkUnits kPlenty = 1'000'000'000;

double hills(double x, double y) {
  return 4.0 * std::sin(0.05 * x + 0.3) * std::cos(0.04 * y) + 1.5 * std::sin(0.11 * y);
}

/// @param ground  z(x, y); NaN: unknown
ElevationMap survey_of(const std::function<double(double, double)>& ground, float sigma_m) {
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  Raster tile;
  tile.level.cell_m = 5.0;
  tile.first = {-30, -30};
  tile.width = tile.height = 60;
  tile.sigma_m = {sigma_m};
  for (int j = 0; j < tile.height; ++j) {
    for (int i = 0; i < tile.width; ++i) {
      const double x = -150.0 + 5.0 * (i + 0.5);
      const double y = -150.0 + 5.0 * (j + 0.5);
      tile.z_m.push_back(static_cast<float>(ground(x, y)));
    }
  }
  Result<ElevationMap> map = ElevationMap::from_rasters(frame, {tile});
  EXPECT_TRUE(map.ok()) << map.error().message;
  return std::move(map).value();
}

ElevationMap survey(bool flat, float sigma_m) {
  return survey_of([flat](double x, double y) { return flat ? 0.0 : hills(x, y); }, sigma_m);
}

Points seen_from(const Pose& T_world_vehicle, bool flat, double bushes, std::mt19937* rng) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.1);
  Points points;
  for (int i = 0; i < 2500; ++i) {
    const double x = T_world_vehicle.p.x() + 50.0 * u(*rng);
    const double y = T_world_vehicle.p.y() + 50.0 * u(*rng);
    double z = (flat ? 0.0 : hills(x, y)) + noise(*rng);
    if (0.5 * (u(*rng) + 1.0) < bushes) z += 0.5 + 2.0 * std::abs(u(*rng));
    points.push_back((T_world_vehicle.inverse() * Vec3(x, y, z)).cast<float>());
  }
  return points;
}

Pose on_hills(double x, double y, double roll, double pitch, double yaw) {
  return test::pose(x, y, hills(x, y) + 0.9, roll, pitch, yaw);
}

/// A survey, and the points of a vehicle on the same ground.
struct Scene {
  Scene(unsigned seed, const Pose& T_world_vehicle, bool flat, double bushes, float sigma_m)
      : rng(seed),
        T(T_world_vehicle),
        map(survey(flat, sigma_m)),
        source(seen_from(T, flat, bushes, &rng)) {}

  PriorMatch match(const registration::Prediction& prediction, const PriorMatchParams& params) {
    return match_prior_map(source, standing, map, prediction, params, kPlenty, &workspace);
  }

  std::mt19937 rng;
  Pose T;
  ElevationMap map;
  Points source;
  Points standing;  // above the ground
  PriorMatchWorkspace workspace;
};

TEST(PriorMatch, FindsTheVehicleOnHills) {
  Scene scene(1, on_hills(10.0, -20.0, 0.05, -0.05, 0.6), false, 0.0, 0.2F);
  const Pose start = scene.T * test::pose(3.0, -2.0, 1.0, 0.01, 0.0, 0.02);
  const PriorMatch match = scene.match(test::prediction(start, 3.0, 0.05), {});
  ASSERT_TRUE(registration::usable(match.registration.stop))
      << static_cast<int>(match.registration.stop);
  EXPECT_EQ(match.tile_id, tile_id(0, {0, -1}));
  const Vec6 e = log_se3(scene.T.inverse() * match.registration.T_target_vehicle);
  EXPECT_LT(e.head<3>().norm(), 0.5);
  EXPECT_LT(std::abs(e[2]), 0.1);
}

TEST(PriorMatch, OscillationAcrossACellBorderEnds) {
  int ended = 0;
  constexpr int kScenes = 20;
  for (unsigned seed = 0; seed < kScenes; ++seed) {
    Scene scene(100 + seed, on_hills(3.0 * seed, -20.0, 0.05, -0.05, 0.3 * seed), false, 0.3,
                0.01F);
    PriorMatchParams params;
    params.min_sigma_m = 0.01;
    params.max_iterations = 40;
    const Pose start = scene.T * test::pose(0.4, -0.3, 0.2, 0.003, 0.003, 0.01);
    const PriorMatch match = scene.match(test::prediction(start, 0.5, 0.01), params);
    ended += match.registration.stop == registration::Stop::kMaxIterations ? 0 : 1;
  }
  EXPECT_GE(ended, kScenes - 1);
}

TEST(PriorMatch, ACellCountsOnceForAnyNumberOfPoints) {
  Scene scene(2, on_hills(0.0, 0.0, 0.0, 0.0, 0.0), false, 0.0, 0.2F);
  const registration::Prediction p = test::prediction(scene.T, 1.0, 0.02);
  const Mat6 few = scene.match(p, {}).registration.information;
  for (int k = 0; k < 4; ++k) {
    const Points more = seen_from(scene.T, false, 0.0, &scene.rng);
    for (std::size_t i = 0; i < more.size(); ++i) scene.source.push_back(more[i]);
  }
  const Mat6 many = scene.match(p, {}).registration.information;
  EXPECT_LT(many(2, 2), 1.2 * few(2, 2));
  // 20 x 20 cells at sigma 0.2 m at most.
  EXPECT_LT(many(2, 2), 1.1 * 400 / (0.2 * 0.2));
}

TEST(PriorMatch, VegetationDoesNotBiasTheHeight) {
  Scene scene(3, on_hills(0.0, 0.0, 0.0, 0.0, 0.0), false, 0.3, 0.2F);
  const PriorMatch match = scene.match(test::prediction(scene.T, 1.0, 0.02), {});
  ASSERT_TRUE(registration::usable(match.registration.stop));
  EXPECT_NEAR(match.registration.T_target_vehicle.p.z(), scene.T.p.z(), 0.15);
}

/// End points of rays ahead of a vehicle on hills with shrubs of 0.6 m, into which light penetrates
/// 0.6 m.
Points seen_in_shrubs(const Pose& T_world_vehicle, std::mt19937* rng) {
  constexpr double kShrubs_m = 0.6;
  constexpr double kInto_m = 0.6;
  constexpr double kStep_m = 0.05;
  std::uniform_real_distribution<double> azimuth(-0.8, 0.8);
  std::uniform_real_distribution<double> elevation(-0.35, 0.05);
  const Vec3 sensor = T_world_vehicle * Vec3(1.0, 0.0, 0.9);
  Points points;
  while (points.size() < 1500) {
    const double a = azimuth(*rng);
    const double up = elevation(*rng);
    const Vec3 d = T_world_vehicle.q *
                   Vec3(std::cos(up) * std::cos(a), std::cos(up) * std::sin(a), std::sin(up));
    for (double way = 0.0; way < 60.0; way += kStep_m) {
      const Vec3 p = sensor + way * d;
      if (p.z() > hills(p.x(), p.y()) + kShrubs_m) continue;
      points.push_back((T_world_vehicle.inverse() * (p + kInto_m * d)).cast<float>());
      break;
    }
  }
  return points;
}

TEST(PriorMatch, PenetrationIntoShrubsDoesNotBiasThePosition) {
  constexpr int kScenes = 12;
  double ahead_m = 0.0;
  double ahead_by_surface_m = 0.0;  // without penetration
  for (unsigned seed = 0; seed < kScenes; ++seed) {
    Scene scene(200 + seed, on_hills(-40.0 + 7.0 * seed, 5.0 * seed, 0.0, 0.0, 0.5 * seed), false,
                0.0, 0.1F);
    scene.source = seen_in_shrubs(scene.T, &scene.rng);
    const auto error_ahead_m = [&](double foliage_m) {
      PriorMatchParams params;
      params.foliage_m = foliage_m;
      const registration::Prediction start = test::prediction(scene.T, 0.5, 0.01);
      return log_se3(scene.T.inverse() * scene.match(start, params).registration.T_target_vehicle)
          .x();
    };
    ahead_m += error_ahead_m(PriorMatchParams{}.foliage_m) / kScenes;
    ahead_by_surface_m += error_ahead_m(0.001) / kScenes;
  }
  EXPECT_LT(ahead_by_surface_m, -0.3);
  EXPECT_LT(std::abs(ahead_m), 0.2);
}

double furrow(double x, double y) { return 0.1 * (std::sin(2.5 * x) + std::sin(2.5 * y)); }

/// Furrows, 0.2 m high and 2.5 m apart, on cells of 0.5 m: cells of 2 m hardly resolve them.
ElevationMap furrows() {
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  Raster tile;
  tile.level.cell_m = 0.5;
  tile.first = {-128, -128};
  tile.width = tile.height = 256;
  tile.sigma_m = {0.2F};
  for (int j = 0; j < tile.height; ++j) {
    for (int i = 0; i < tile.width; ++i) {
      tile.z_m.push_back(static_cast<float>(furrow(0.5 * (i - 127.5), 0.5 * (j - 127.5))));
    }
  }
  Result<ElevationMap> map = ElevationMap::from_rasters(frame, mapping::with_coarser_levels(tile));
  EXPECT_TRUE(map.ok()) << map.error().message;
  return std::move(map).value();
}

TEST(PriorMatch, ASurveyBetterThanItsSigmaIsMatchedOnItsFineCells) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-40.0, 40.0);
  const Pose T = test::pose(1.0, 2.0, 0.9, 0.0, 0.0, 0.4);
  Points source;
  for (int k = 0; k < 4000; ++k) {
    const double x = u(rng);
    const double y = u(rng);
    source.push_back((T.inverse() * Vec3(x, y, furrow(x, y))).cast<float>());
  }
  // Its sigma is 0.2 m, which would correspond to slopes of 0.46.
  const ElevationMap map = furrows();
  const registration::Prediction start =
      test::prediction(T * test::pose(0.2, -0.2, 0.1, 0.0, 0.0, 0.002), 0.2, 0.01);
  PriorMatchWorkspace workspace;
  const registration::Registration r =
      match_prior_map(source, {}, map, start, {}, kPlenty, &workspace).registration;
  EXPECT_LT(log_se3(T.inverse() * r.T_target_vehicle).head<2>().norm(), 0.05);
  EXPECT_GT(r.information(0, 0), 25.0);  // 0.2 m
}

TEST(PriorMatch, TheResultDoesNotDependOnTheInitialGuess) {
  Scene scene(6, on_hills(10.0, -20.0, 0.05, -0.05, 0.6), false, 0.2, 0.02F);
  PriorMatchParams params;
  params.min_sigma_m = 0.02;  // distant points are no match
  params.max_iterations = 60;
  std::mt19937& rng = scene.rng;
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto apart = [&](double max_spread_m) {
    params.max_spread_m = max_spread_m;
    std::vector<Vec3> ends;
    double most = 0.0;
    for (int k = 0; k < 20; ++k) {
      const Pose start = scene.T * test::pose(4.0 * u(rng), 4.0 * u(rng), u(rng), 0.01 * u(rng),
                                              0.0, 0.08 * u(rng));
      ends.push_back(
          scene.match(test::prediction(start, 4.0, 0.08), params).registration.T_target_vehicle.p);
      most = std::max(most, (ends.back() - ends.front()).norm());
    }
    return most;
  };
  EXPECT_LT(apart(0.6), 0.05);
  EXPECT_GT(apart(0.0), 1.0) << "without the inflation it does";
}

TEST(PriorMatch, FlatGroundGivesNoInformationAboutXYAndYaw) {
  Scene scene(4, test::pose(5.0, 5.0, 0.9, 0.0, 0.0, 1.0), true, 0.0, 0.2F);
  const Pose start = scene.T * test::pose(1.0, 2.0, 0.3, 0.0, 0.0, 0.05);
  const PriorMatch match = scene.match(test::prediction(start, 3.0, 0.05), {});
  ASSERT_EQ(match.registration.stop, registration::Stop::kDegenerate);
  const Vec3 moved = match.registration.T_target_vehicle.p - start.p;
  EXPECT_LT(moved.head<2>().norm(), 0.05);
  EXPECT_NEAR(match.registration.T_target_vehicle.p.z(), 0.9, 0.05);
}

TEST(PriorMatch, HolesInTheSurveyLoseTheirCellsOnly) {
  Scene scene(7, on_hills(10.0, -20.0, 0.05, -0.05, 0.6), false, 0.0, 0.2F);
  const auto with_holes = [](double x, double y) {
    const bool hole = std::fmod(std::abs(x), 40.0) < 15.0 && std::fmod(std::abs(y), 40.0) < 15.0;
    return hole ? std::nan("") : hills(x, y);
  };
  const Pose start = scene.T * test::pose(3.0, -2.0, 1.0, 0.01, 0.0, 0.02);
  const registration::Registration whole =
      scene.match(test::prediction(start, 3.0, 0.05), {}).registration;
  scene.map = survey_of(with_holes, 0.2F);
  const registration::Registration holed =
      scene.match(test::prediction(start, 3.0, 0.05), {}).registration;
  ASSERT_TRUE(registration::usable(holed.stop)) << static_cast<int>(holed.stop);
  EXPECT_LT((holed.T_target_vehicle.p - scene.T.p).norm(), 0.6);
  EXPECT_LT(holed.information(2, 2), whole.information(2, 2));
}

// The survey's surface turns a cliff of 12 m into a ramp one cell wide, and displaces the edge.
TEST(PriorMatch, ASmoothedCliffInTheSurveyDoesNotBiasThePosition) {
  const auto cliff = [](double x, double y) { return hills(x, y) - (x > 17.3 ? 12.0 : 0.0); };
  Scene scene(8, on_hills(0.0, -20.0, 0.05, -0.05, 0.6), false, 0.0, 0.2F);
  for (std::size_t k = 0; k < scene.source.size(); ++k) {
    Vec3 p = scene.T * scene.source[k].cast<double>();
    p.z() -= p.x() > 17.3 ? 12.0 : 0.0;
    const Vec3f seen = (scene.T.inverse() * p).cast<float>();
    scene.source.x[k] = seen.x();
    scene.source.y[k] = seen.y();
    scene.source.z[k] = seen.z();
  }
  scene.map = survey_of(cliff, 0.2F);
  const Pose start = scene.T * test::pose(1.5, -1.0, 0.5, 0.01, 0.0, 0.02);
  const registration::Registration match =
      scene.match(test::prediction(start, 2.0, 0.05), {}).registration;
  ASSERT_TRUE(registration::usable(match.stop)) << static_cast<int>(match.stop);
  EXPECT_LT((match.T_target_vehicle.p - scene.T.p).norm(), 0.6);
  EXPECT_NEAR(match.T_target_vehicle.p.z(), scene.T.p.z(), 0.15);
}

// ---- above-ground structure ------------------------------------------------------------------

struct Wall {
  Vec2 from, to;
  double half_m() const { return 0.5 * (to - from).norm(); }
  Vec2 normal() const {  // to the left
    const Vec2 along = (to - from).normalized();
    return {-along.y(), along.x()};
  }
};
const std::vector<Wall> kWalls = {
    {{25.0, -10.0}, {25.0, 15.0}}, {{-10.0, -18.0}, {20.0, -14.0}}, {{-16.0, 20.0}, {-20.0, 5.0}}};
constexpr double kTop_m = 3.0;

/// A flat field with the walls of the map, and the points of a vehicle at the true walls.
/// @param moved_m  displacement of the last and shortest wall on the map, along its normal
Scene walls_on_a_flat_field(unsigned seed, const Pose& T, double moved_m, double per_m2) {
  Scene scene(seed, T, true, 0.0, 0.1F);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.03);
  Raster tile;
  tile.level.cell_m = 5.0;
  tile.first = {-30, -30};
  tile.width = tile.height = 60;
  tile.sigma_m = {0.1F};
  tile.z_m.assign(tile.cells(), 0.0F);
  for (std::size_t w = 0; w < kWalls.size(); ++w) {
    const Wall& wall = kWalls[w];
    const Vec2 middle = 0.5 * (wall.from + wall.to);
    const Vec2 along = (wall.to - wall.from).normalized();
    const auto at = [&](double s) { return Vec2(middle + s * wall.half_m() * along); };
    for (double s = -1.0; s < 1.0; s += 0.2 / wall.half_m()) {
      for (double z = 0.5; z < kTop_m; z += 0.2) {
        const Vec2 p =
            at(s) + (w + 1 == kWalls.size() ? moved_m : 0.0) * wall.normal() + Vec2(150.0, 150.0);
        tile.points.push_back({Vec3(p.x(), p.y(), z).cast<float>(),
                               Vec3(wall.normal().x(), wall.normal().y(), 0.0).cast<float>(),
                               0.05F});
      }
    }
    const int seen = static_cast<int>(per_m2 * 2.0 * wall.half_m() * kTop_m);
    for (int k = 0; k < seen; ++k) {
      const Vec2 p = at(u(scene.rng)) + noise(scene.rng) * wall.normal();
      const Vec3 q(p.x(), p.y(), 0.5 + 0.5 * (kTop_m - 0.5) * (1.0 + u(scene.rng)));
      scene.standing.push_back((T.inverse() * q).cast<float>());
    }
  }
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  Result<ElevationMap> map = ElevationMap::from_rasters(frame, {tile});
  EXPECT_TRUE(map.ok()) << map.error().message;
  scene.map = std::move(map).value();
  return scene;
}

TEST(PriorPoints, WallsDeterminePositionAndHeadingOnFlatGround) {
  double nees = 0.0;
  constexpr int kScenes = 20;
  for (unsigned seed = 0; seed < kScenes; ++seed) {
    const Pose T = test::pose(2.0, 1.0, 0.9, 0.0, 0.0, 0.3 * seed);
    Scene scene = walls_on_a_flat_field(30 + seed, T, 0.0, 2.0);
    std::normal_distribution<double> n;
    const Pose start =
        T * test::pose(0.7 * n(scene.rng), 0.7 * n(scene.rng), 0.2, 0.0, 0.0, 0.02 * n(scene.rng));
    const registration::Prediction p = test::prediction(start, 0.7, 0.02);
    const registration::Registration r = scene.match(p, {}).registration;
    ASSERT_EQ(r.stop, registration::Stop::kConverged) << seed;
    const Vec6 e = log_se3(T.inverse() * r.T_target_vehicle);
    EXPECT_LT(e.head<2>().norm(), 0.06) << seed;
    EXPECT_LT(std::abs(e[5]), radians(0.3)) << seed;
    EXPECT_LT(std::abs(e[2]), 0.06);
    nees += e.dot(r.information * e) / 6.0 / kScenes;
    scene.standing.clear();
    EXPECT_EQ(scene.match(p, {}).registration.stop, registration::Stop::kDegenerate)
        << "the ground alone";
  }
  EXPECT_LT(nees, 2.0);
}

TEST(PriorPoints, AMisplacedWallIsRejected) {
  const Pose T = test::pose(2.0, 1.0, 0.9, 0.0, 0.0, 0.4);
  for (const double moved_m : {1.0, -0.9, 2.0}) {
    Scene scene = walls_on_a_flat_field(60, T, moved_m, 2.0);
    const Pose start = T * test::pose(0.3, -0.2, 0.1, 0.0, 0.0, 0.01);
    const registration::Registration r =
        scene.match(test::prediction(start, 0.4, 0.01), {}).registration;
    ASSERT_TRUE(registration::usable(r.stop)) << moved_m;
    const Vec6 e = log_se3(T.inverse() * r.T_target_vehicle);
    EXPECT_LT(e.head<2>().norm(), 0.1) << moved_m;
    EXPECT_LT(std::abs(e[5]), radians(0.5)) << moved_m;
  }
}

TEST(PriorPoints, AThousandPointsOfAWallDoNotReduceSigmaBelowItsError) {
  const Pose T = test::pose(2.0, 1.0, 0.9, 0.0, 0.0, 0.0);
  Scene few = walls_on_a_flat_field(70, T, 0.0, 2.0);
  Scene many = walls_on_a_flat_field(71, T, 0.0, 20.0);
  const registration::Prediction p = test::prediction(T, 0.5, 0.02);
  const Mat6 by_few = few.match(p, {}).registration.information;
  const Mat6 by_many = many.match(p, {}).registration.information;
  EXPECT_LT(by_many(0, 0), 1.3 * by_few(0, 0));
  // 71 m of walls cross fewer than 3 cubes of 2 m for each metre, and each contributes 1 / (0.2
  // m)^2.
  EXPECT_LT(by_many(0, 0) + by_many(1, 1), 3.0 * 71.0 / (0.2 * 0.2));
}

TEST(PriorPoints, ASurfaceSeenFromBehindDoesNotMatch) {
  const Pose T = test::pose(2.0, 1.0, 0.9, 0.0, 0.0, 0.0);
  Scene scene = walls_on_a_flat_field(80, T, 0.0, 2.0);
  const Pose beyond = test::pose(60.0, 60.0, 0.9, 0.0, 0.0, 0.0);
  Points seen;
  for (std::size_t k = 0; k < scene.standing.size(); ++k) {
    const Vec3 q = T * scene.standing[k].cast<double>();
    if (q.x() > 24.0) seen.push_back((beyond.inverse() * q).cast<float>());
  }
  PriorPointsWorkspace workspace;
  EXPECT_EQ(sum_points(seen, scene.map, beyond, {}, 2.0, 4.0, 0.0, &workspace).voxels, 0);
}

TEST(PriorPoints, WithoutMapPointsNothingChangesAtNoCost) {
  Scene scene(9, on_hills(10.0, -20.0, 0.05, -0.05, 0.6), false, 0.2, 0.1F);
  const registration::Prediction p =
      test::prediction(scene.T * test::pose(1, 0, 0.2, 0, 0, 0.01), 1.0, 0.02);
  const registration::Registration before = scene.match(p, {}).registration;
  scene.standing = scene.source;
  const registration::Registration after = scene.match(p, {}).registration;
  EXPECT_EQ(after.T_target_vehicle.p, before.T_target_vehicle.p);
  EXPECT_EQ(after.information, before.information);
  EXPECT_EQ(after.used, before.used);
}

TEST(PriorPoints, TheSameScanGivesTheSameResult) {
  const Pose T = test::pose(2.0, 1.0, 0.9, 0.0, 0.0, 0.4);
  const registration::Prediction p =
      test::prediction(T * test::pose(0.5, 0.4, 0, 0, 0, 0.01), 0.7, 0.02);
  Scene scene = walls_on_a_flat_field(90, T, 0.0, 2.0);
  const registration::Registration first = scene.match(p, {}).registration;
  const registration::Registration second = scene.match(p, {}).registration;
  EXPECT_EQ(first.T_target_vehicle.p, second.T_target_vehicle.p);
  EXPECT_EQ(first.information, second.information);
  EXPECT_GT(first.used, 0);
}

TEST(PriorMatch, OutsideTheMapGetsAResult) {
  Scene scene(5, test::pose(1000.0, 0.0, 0.0, 0.0, 0.0, 0.0), false, 0.0, 0.2F);
  EXPECT_EQ(scene.match(test::prediction(scene.T, 1.0, 0.1), {}).registration.stop,
            registration::Stop::kEmpty);
}

}  // namespace
}  // namespace rcs::sp
