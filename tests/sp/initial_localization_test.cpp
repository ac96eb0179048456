#include "modules/sp/start/initial_localization.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "tests/support/heap_guard.h"
#include "tests/support/point_scenes.h"

namespace rcs::sp {
namespace {

using Ground = std::function<double(double x, double y)>;

constexpr WorkUnits kPlenty = 1'000'000'000;

/// Waves of all lengths and directions, from a seed.
Ground hills(unsigned seed) {
  struct Wave {
    double a, kx, ky, phase;
  };
  std::vector<Wave> waves;
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (const double length_m : {120.0, 80.0, 50.0, 30.0, 20.0, 13.0}) {
    for (int k = 0; k < 3; ++k) {
      const double bearing = 2.0 * kPi * u(rng);
      const double wave = 2.0 * kPi / length_m;
      waves.push_back({0.02 * length_m, wave * std::cos(bearing), wave * std::sin(bearing),
                       2.0 * kPi * u(rng)});
    }
  }
  return [waves](double x, double y) {
    double z = 0.0;
    for (const Wave& w : waves) z += w.a * std::sin(w.kx * x + w.ky * y + w.phase);
    return z;
  };
}

ElevationMap survey(const Ground& ground, double noise_m) {
  constexpr int kHalf = 130;
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  Raster tile;
  tile.level.cell_m = 2.0;
  tile.first = {-kHalf, -kHalf};
  tile.width = tile.height = 2 * kHalf;
  tile.sigma_m = {static_cast<float>(std::max(noise_m, 0.05))};
  std::mt19937 rng(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  for (int j = 0; j < tile.height; ++j) {
    for (int i = 0; i < tile.width; ++i) {
      const Vec2 at = tile.level.centre({tile.first.i + i, tile.first.j + j});
      tile.z_m.push_back(static_cast<float>(ground(at.x(), at.y()) + noise_m * noise(rng)));
    }
  }
  Result<ElevationMap> map = ElevationMap::from_rasters(frame, {tile});
  EXPECT_TRUE(map.ok()) << map.error().message;
  return std::move(map).value();
}

/// A drive in a bend in the map's frame; frame level begins at the start of the vehicle.
struct Drive {
  explicit Drive(Ground ground) : ground_(std::move(ground)) {}

  [[nodiscard]] Pose T_map_vehicle(double way_m) const {
    const double yaw = 0.4 + way_m / 90.0;
    const double x = 90.0 * (std::sin(yaw) - std::sin(0.4));
    const double y = 90.0 * (std::cos(0.4) - std::cos(yaw));
    return test::pose(x, y, ground_(x, y) + 1.0, 0.02, -0.03, yaw);
  }
  [[nodiscard]] Pose T_level_map() const {
    const Pose T = T_map_vehicle(0.0);
    return Pose{Quat(Eigen::AngleAxisd(yaw_of(T.q), Vec3::UnitZ())), T.p}.inverse();
  }
  [[nodiscard]] Points scan(double way_m) {
    std::uniform_real_distribution<double> u(0.0, 1.0);
    std::normal_distribution<double> noise(0.0, 0.05);
    const Pose T = T_map_vehicle(way_m);
    Points points;
    for (int k = 0; k < 150; ++k) {
      const double range_m = 4.0 + 34.0 * u(rng_);
      const double bearing = yaw_of(T.q) + 1.6 * (u(rng_) - 0.5);
      const double x = T.p.x() + range_m * std::cos(bearing);
      const double y = T.p.y() + range_m * std::sin(bearing);
      const double bush_m = u(rng_) < 0.05 ? 1.5 : 0.0;
      points.push_back(
          (T.inverse() * Vec3(x, y, ground_(x, y) + noise(rng_) + bush_m)).cast<float>());
    }
    return points;
  }

 private:
  Ground ground_;
  std::mt19937 rng_{3};
};

InitialLocalizationParams quick() {
  InitialLocalizationParams p;
  p.samples = 600;
  return p;
}

/// @param off_m  distance of the middle of the region from the vehicle's start
StartRegion region(const Vec2& off_m) { return {off_m, 60.0, 0.4 + 0.2, 0.35}; }

/// Drives until the vehicle is localized, or for this time.
InitialLocalizationStatus drive(Drive* way, const ElevationMap& map, double length_m,
                                WorkUnits piece, InitialLocalizer* localizer) {
  for (double at_m = 0.0; at_m < length_m; at_m += 2.0) {
    localizer->add(way->scan(at_m), way->T_level_map() * way->T_map_vehicle(at_m));
    while (localizer->work(map, piece) > 0) {
    }
    if (localizer->status().state == InitialLocalizationState::kFound) break;
  }
  return localizer->status();
}

InitialLocalizationStatus drive(const Ground& ground, const ElevationMap& map, const Vec2& off_m,
                                double length_m = 100.0) {
  Drive way(ground);
  InitialLocalizer localizer(quick());
  EXPECT_TRUE(localizer.begin(region(off_m)));
  return drive(&way, map, length_m, kPlenty, &localizer);
}

TEST(InitialLocalization, FindsTheVehicleOnHills) {
  const Ground ground = hills(1);
  const ElevationMap map = survey(ground, 0.1);
  Drive way(ground);
  InitialLocalizer localizer(quick());
  ASSERT_TRUE(localizer.begin(region({-30.0, 25.0})));
  const InitialLocalizationStatus s = drive(&way, map, 150.0, kPlenty, &localizer);
  ASSERT_EQ(s.state, InitialLocalizationState::kFound) << static_cast<int>(s.reason);
  EXPECT_EQ(s.hypotheses, 1);
  const Pose T_level_vehicle = way.T_level_map() * way.T_map_vehicle(s.travelled_m);
  const Pose T = s.T_map_level * T_level_vehicle;
  const Pose right = way.T_map_vehicle(s.travelled_m);
  EXPECT_LT((T.p - right.p).norm(), 0.6);
  EXPECT_LT(std::abs(wrap_angle(yaw_of(T.q) - yaw_of(right.q))), 0.01);
  const Mat<4> covariance = localizer.covariance_at(T_level_vehicle);
  const Vec2 off = (T.p - right.p).head<2>();
  EXPECT_LT(off.dot(Mat<2>(covariance.topLeftCorner<2, 2>()).inverse() * off), 13.8);  // 99.9 %
  EXPECT_LT(covariance(0, 0) + covariance(1, 1), 2.0);
}

TEST(InitialLocalization, TheResultDoesNotDependOnTheSteps) {
  const Ground ground = hills(2);
  const ElevationMap map = survey(ground, 0.1);
  std::vector<InitialLocalizationStatus> answers;
  for (const WorkUnits piece : {kPlenty, WorkUnits{50'000}, WorkUnits{6'000}}) {
    Drive way(ground);
    InitialLocalizer localizer(quick());
    ASSERT_TRUE(localizer.begin(region({10.0, 40.0})));
    answers.push_back(drive(&way, map, 150.0, piece, &localizer));
  }
  ASSERT_EQ(answers[0].state, InitialLocalizationState::kFound);
  for (const InitialLocalizationStatus& s : answers) {
    EXPECT_EQ(s.state, answers[0].state);
    EXPECT_EQ(s.T_map_level.matrix(), answers[0].T_map_level.matrix());
    EXPECT_EQ(s.covariance, answers[0].covariance);
    EXPECT_EQ(s.travelled_m, answers[0].travelled_m);
  }
}

TEST(InitialLocalization, NoStepExceedsItsGrant) {
  const Ground ground = hills(2);
  const ElevationMap map = survey(ground, 0.1);
  Drive way(ground);
  InitialLocalizer localizer(quick());
  ASSERT_TRUE(localizer.begin(region({10.0, 40.0})));
  for (double at_m = 0.0; at_m < 80.0; at_m += 2.0) {
    localizer.add(way.scan(at_m), way.T_level_map() * way.T_map_vehicle(at_m));
    EXPECT_LE(localizer.work(map, 7'000), 7'000);
  }
  EXPECT_EQ(localizer.status().state, InitialLocalizationState::kSearching);
}

TEST(InitialLocalization, AllocatesNothingAfterTheStart) {
  if (!rcs::test::HeapGuard::available()) GTEST_SKIP() << "a sanitizer owns malloc";
  const Ground ground = hills(2);
  const ElevationMap map = survey(ground, 0.1);
  Drive way(ground);
  InitialLocalizer localizer(quick());
  ASSERT_TRUE(localizer.begin(region({10.0, 40.0})));
  std::int64_t allocations = 0;
  for (double at_m = 0.0; at_m < 100.0; at_m += 2.0) {
    const Points points = way.scan(at_m);
    const Pose T_level_vehicle = way.T_level_map() * way.T_map_vehicle(at_m);
    const rcs::test::HeapGuard heap;
    localizer.add(points, T_level_vehicle);
    localizer.work(map, kPlenty);
    allocations += heap.allocations();
  }
  EXPECT_EQ(localizer.status().state, InitialLocalizationState::kFound);
  EXPECT_EQ(allocations, 0);
}

TEST(InitialLocalization, AFlatFieldGivesNoPosition) {
  const Ground flat = [](double, double) { return 0.0; };
  const ElevationMap map = survey(flat, 0.15);
  const InitialLocalizationStatus s = drive(flat, map, {20.0, 0.0});
  EXPECT_EQ(s.state, InitialLocalizationState::kCollecting);
  EXPECT_EQ(s.reason, InitialLocalizationReason::kFeatureless);
  EXPECT_GT(s.hypotheses, 5);
}

TEST(InitialLocalization, NoCandidateFitsAnotherMap) {
  const ElevationMap map = survey(hills(5), 0.1);
  const InitialLocalizationStatus s = drive(hills(6), map, {0.0, 0.0});
  EXPECT_NE(s.state, InitialLocalizationState::kFound);
  EXPECT_EQ(s.reason, InitialLocalizationReason::kNothingFits);
}

TEST(InitialLocalization, AStartOutsideTheSearchRegionIsNotFound) {
  const Ground ground = hills(3);
  const ElevationMap map = survey(ground, 0.1);
  const InitialLocalizationStatus s = drive(ground, map, {70.0, 60.0});
  EXPECT_NE(s.state, InitialLocalizationState::kFound);
  EXPECT_EQ(s.reason, InitialLocalizationReason::kNothingFits);
}

TEST(InitialLocalization, RepetitiveTerrainIsAmbiguous) {
  const Ground waves = [](double x, double y) {
    return 1.5 * std::sin(2.0 * kPi * x / 40.0) + 1.5 * std::cos(2.0 * kPi * y / 40.0 + 1.0);
  };
  const InitialLocalizationStatus s = drive(waves, survey(waves, 0.1), {5.0, 0.0});
  EXPECT_EQ(s.state, InitialLocalizationState::kCollecting);
  EXPECT_EQ(s.reason, InitialLocalizationReason::kAmbiguous);
  EXPECT_GT(s.hypotheses, 2);
  EXPECT_GT(s.scatter_m, 20.0);
}

TEST(InitialLocalization, ContradictingTerrainRefutesACandidate) {
  const Ground right = hills(4);
  const Ground other = hills(9);
  // Terrain within the first 44 m and the range of the search: as in the map; beyond: different.
  const Ground seen = [&right, &other](double x, double y) {
    return std::hypot(x, y) < 80.0 ? right(x, y)
                                   : other(x, y) - other(70.0, 40.0) + right(70.0, 40.0);
  };
  const InitialLocalizationStatus s = drive(seen, survey(right, 0.1), {20.0, 10.0}, 90.0);
  EXPECT_NE(s.state, InitialLocalizationState::kFound);
  EXPECT_GE(s.refuted, 1);
}

TEST(InitialLocalization, ATooLargeSearchRegionIsRejected) {
  InitialLocalizer localizer(quick());
  EXPECT_FALSE(localizer.begin({Vec2::Zero(), 1000.0, 0.0, kPi}));
  EXPECT_EQ(localizer.status().state, InitialLocalizationState::kOff);
}

}  // namespace
}  // namespace rcs::sp
