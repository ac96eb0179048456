// Plants that give way are distinguished from solids by the rays that pass through them.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <vector>

#include "modules/wm/terrain/terrain_grid.h"
#include "tests/wm/imager.h"

namespace rcs::wm {
namespace {

struct Scene {
  double grass_m = 0.0;  ///< height of the grass
  double transmittance_per_m = 0.4;
  std::function<bool(const Vec3& p)> solid = [](const Vec3&) { return false; };
};

class VegetationTest : public testing::Test {
 protected:
  VegetationTest() : grid_(params()) {}

  void drive(const Scene& scene, const Vec2& from, const Vec2& to) {
    const double way_m = (to - from).norm();
    const Vec2 ahead = (to - from) / way_m;
    const Quat q(Eigen::AngleAxisd(std::atan2(ahead.y(), ahead.x()), Vec3::UnitZ()));
    for (double s = 0.0; s < way_m; s += 0.3) {
      const Vec2 here = from + s * ahead;
      T_ = Pose{q, Vec3(here.x(), here.y(), 0.9)};
      grid_.insert(
          imager_scan(
              T_, [&](const Vec3& at, const Vec3& ray) { return range_in(scene, at, ray); }, &rng_),
          T_);
    }
    first_ = grid_.patch(T_, &answers_);
  }

  [[nodiscard]] TerrainAnswer at(double x_m, double y_m) const {
    const int i = static_cast<int>(std::floor(x_m / grid_.params().cell_m)) - first_.i;
    const int j = static_cast<int>(std::floor(y_m / grid_.params().cell_m)) - first_.j;
    return answers_[static_cast<std::size_t>(j * grid_.params().patch + i)];
  }
  /// Share of the known cells of a rectangle that are obstacles.
  [[nodiscard]] double obstacles(double x0, double x1, double y0, double y1) const {
    int known = 0;
    int obstacles = 0;
    for (double x = x0; x < x1; x += 0.4) {
      for (double y = y0; y < y1; y += 0.4) {
        const TerrainAnswer a = at(x, y);
        known += a.known ? 1 : 0;
        obstacles += a.obstacle ? 1 : 0;
      }
    }
    std::printf("%d of %d known cells are obstacles\n", obstacles, known);
    return static_cast<double>(obstacles) / std::max(1, known);
  }

 private:
  static TerrainParams params() {
    TerrainParams p;
    p.edge_range_m = 10.0;
    p.vegetation_m = 1.1;
    p.p_vehicle_ladar = kImager;
    return p;
  }
  std::optional<double> range_in(const Scene& scene, const Vec3& from, const Vec3& ray) {
    double left_m = std::log(1.0 - unit_(rng_)) / std::log(scene.transmittance_per_m);
    return first_inside(from, ray, [&](const Vec3& p) {
      if (p.z() <= 0.0 || scene.solid(p)) return true;
      if (p.z() >= scene.grass_m) return false;
      left_m -= 0.02;
      return left_m <= 0.0;
    });
  }

  TerrainGrid grid_;
  std::mt19937 rng_{3};
  std::uniform_real_distribution<> unit_{0.0, 1.0};
  std::vector<TerrainAnswer> answers_;
  Cell first_;
  Pose T_;
};

TEST_F(VegetationTest, GrassGivesWay) {
  for (const double height_m : {0.3, 0.5, 0.8, 1.0}) {
    Scene meadow;
    meadow.grass_m = height_m;
    meadow.transmittance_per_m = height_m < 0.9 ? 0.4 : 0.3;
    std::printf("grass of %.1f m: ", height_m);
    drive(meadow, {0.0, 0.0}, {15.0, 0.0});
    EXPECT_LT(obstacles(18.0, 26.0, -3.0, 3.0), 0.03) << height_m;
    int vegetation = 0;
    for (double x = 18.0; x < 26.0; x += 0.4) vegetation += at(x, 0.2).vegetation ? 1 : 0;
    if (height_m > 0.7) {
      EXPECT_GT(vegetation, 5) << height_m;
    }
  }
}

// A ray along the face of a wall passes through the cells that the face divides.
TEST_F(VegetationTest, AWallIsSolidFromTheFrontAndFromBeside) {
  for (const double turn : {0.0, 0.3, -0.15}) {
    for (const double y0_m : {3.01, 3.07, 3.13, 3.19}) {
      const auto face_m = [&](double x_m) { return y0_m + turn * (x_m - 18.0); };
      Scene wall;
      wall.solid = [&](const Vec3& p) {
        const double behind_m = p.y() - face_m(p.x());
        return behind_m > 0.0 && behind_m < 0.4 && p.z() < 0.8;
      };
      const double y_m = std::min(0.0, face_m(15.0) - 3.0);
      drive(wall, {0.0, y_m - 15.0 * turn}, {15.0, y_m});  // along it
      int free = 0;
      for (double x = 17.0; x < 24.0; x += 0.2) free += at(x, face_m(x) + 0.02).obstacle ? 0 : 1;
      EXPECT_EQ(free, 0) << y0_m << ", " << turn;
      drive(Scene(), {0.0, 60.0}, {9.0, 60.0});  // elsewhere
    }
  }
}

TEST_F(VegetationTest, SolidsAreObstaclesAlsoInShortGrass) {
  struct Solid {
    const char* what;
    std::function<bool(const Vec3&)> is;
  };
  const std::vector<Solid> solids = {
      {"rock of 0.6 m", [](const Vec3& p) { return (p - Vec3(20.0, 0.2, 0.0)).norm() < 0.6; }},
      {"rock of 0.45 m", [](const Vec3& p) { return (p - Vec3(20.0, 0.2, 0.0)).norm() < 0.45; }},
      {"trunk of 0.3 m", [](const Vec3& p) { return (p - Vec3(20.0, 0.2, p.z())).norm() < 0.15; }},
      {"stump of 0.3 m, 0.7 m high",
       [](const Vec3& p) { return p.z() < 0.7 && (p - Vec3(20.0, 0.2, p.z())).norm() < 0.15; }},
  };
  for (const double grass_m : {0.0, 0.25}) {
    for (const Solid& solid : solids) {
      Scene scene;
      scene.grass_m = grass_m;
      scene.solid = solid.is;
      drive(scene, {0.0, 0.0}, {15.0, 0.0});
      std::printf("%s in grass of %.2f m: ", solid.what, grass_m);
      EXPECT_GT(obstacles(19.2, 20.8, -0.6, 1.0), 0.0) << solid.what;
      drive(Scene(), {0.0, 40.0}, {9.0, 40.0});  // elsewhere
    }
  }
}

}  // namespace
}  // namespace rcs::wm
