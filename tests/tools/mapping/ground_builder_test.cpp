#include "tools/mapping/ground_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rcs/terrain/map_tile.h"
#include "tests/tools/mapping/ground_scene.h"
#include "tools/mapping/mount_estimate.h"

namespace rcs {
namespace {

using test::GroundScene;

struct Errors {
  std::vector<double> m;
  int cells = 0;  ///< of the region, known or not
  double within_2 = 0.0;
  double within_1 = 0.0;

  [[nodiscard]] double median() {
    std::nth_element(m.begin(), m.begin() + static_cast<std::ptrdiff_t>(m.size() / 2), m.end());
    return m[m.size() / 2];
  }
  [[nodiscard]] double most() const {
    return m.empty() ? 0.0 : *std::max_element(m.begin(), m.end());
  }
  [[nodiscard]] double known() const { return static_cast<double>(m.size()) / cells; }
};

struct Built {
  mapping::GroundMetrics metrics;
  std::vector<Raster> tiles;
  std::int64_t seen_through = 0;

  /// Statistics of height minus true ground where `in` is true and at least `count` scans observed
  /// it.
  template <class In>
  [[nodiscard]] Errors errors(int count, const In& in) const {
    Errors e;
    for (const Raster& r : tiles) {
      for (std::size_t k = 0; k < r.cells(); ++k) {
        const Vec2 p = r.level.centre(
            {r.first.i + static_cast<int>(k) % r.width, r.first.j + static_cast<int>(k) / r.width});
        if (p.x() < 2 || p.x() > 38 || std::abs(p.y()) > 10 || !in(p.x(), p.y())) continue;
        ++e.cells;
        if (std::isnan(r.z_m[k]) || r.count[k] < count) continue;
        const double off = r.z_m[k] - GroundScene::ground(p.x(), p.y());
        e.m.push_back(off);
        if (std::abs(off) <= layer_at(r.sigma_m, k)) e.within_1 += 1.0;
        if (std::abs(off) <= 2.0 * layer_at(r.sigma_m, k)) e.within_2 += 1.0;
      }
    }
    const auto n = static_cast<double>(std::max<std::size_t>(1, e.m.size()));
    e.within_1 /= n;
    e.within_2 /= n;
    return e;
  }
};

Built build(const GroundScene& scene) {
  const std::vector<GroundScene::Shot> shots = scene.drive();
  mapping::GroundSurface surface{mapping::GroundSurfaceParams()};
  for (const GroundScene::Shot& s : shots) surface.add(s.p);
  EXPECT_TRUE(surface.finish([] { return true; }));
  const mapping::GroundBuilderParams params;
  mapping::GroundBuilder builder(params, &surface);
  for (const GroundScene::Shot& s : shots) {
    builder.count(s.p, s.range_m);
    surface.see_through(s.from, s.p, s.scan);
  }
  Built built;
  built.seen_through = surface.close();
  builder.settle();
  for (const GroundScene::Shot& s : shots) builder.measure(s.p, s.range_m, s.stamp, s.scan);
  builder.finish();
  built.metrics = builder.metrics();
  MapLevel level;
  level.cell_m = params.cell_m;
  for (const Cell tile : builder.tiles()) built.tiles.push_back(builder.tile(level, tile, 7000));
  return built;
}

const Built& with_things() {
  static const Built built = build(GroundScene());
  return built;
}

bool anywhere(double, double) { return true; }

TEST(GroundBuilder, BareGroundIsFoundToACentimetre) {
  GroundScene scene;
  scene.things = false;
  const Built built = build(scene);
  Errors e = built.errors(5, anywhere);
  ASSERT_GT(e.m.size(), 5000U);
  EXPECT_NEAR(e.median(), 0.0, 0.003);
  EXPECT_GT(e.within_2, 0.95);
  for (double& m : e.m) m = std::abs(m);
  EXPECT_LT(e.median(), 0.01);
  EXPECT_LT(built.metrics.above_ground + built.metrics.transient, built.metrics.ground / 1000);
  EXPECT_EQ(built.seen_through, 0);
  const Raster& r = built.tiles.front();
  EXPECT_TRUE(check_raster(r));
  EXPECT_EQ(layer_at(r.source, 0), CellSource::kSensed);
  EXPECT_EQ(layer_at(r.date, 0), 7000);
}

TEST(GroundBuilder, TheGroundUnderGrassIsFound) {
  Errors e = with_things().errors(3, GroundScene::in_grass);
  EXPECT_GT(e.known(), 0.2);
  EXPECT_NEAR(e.median(), 0.0, 0.015);
  for (double& m : e.m) m = std::abs(m);
  std::sort(e.m.begin(), e.m.end());
  EXPECT_LT(e.m[e.m.size() * 9 / 10], 0.05) << "0.3 m of grass";
}

TEST(GroundBuilder, AHedgeIsNotGround) {
  const Errors e =
      with_things().errors(1, [](double x, double y) { return x > 14.4 && x < 16.0 && y < -5.6; });
  ASSERT_GT(e.cells, 150);
  EXPECT_LT(e.most(), 0.3) << e.known();
}

TEST(GroundBuilder, TheGroundUnderARoofAndACrownIsFound) {
  for (const auto& in : {+[](double x, double y) { return x > 21 && x < 25 && y > 4 && y < 7; },
                         +[](double x, double y) { return std::hypot(x - 30, y + 7) < 1.0; }}) {
    Errors e = with_things().errors(2, in);
    EXPECT_GT(e.known(), 0.3);
    EXPECT_LT(e.most(), 0.12);
    for (double& m : e.m) m = std::abs(m);
    EXPECT_LT(e.median(), 0.015);
  }
}

TEST(GroundBuilder, ATransientCarIsRemovedFromTheRoad) {
  Errors e = with_things().errors(
      2, [](double x, double y) { return x > 17 && x < 23 && GroundScene::on_road(x, y); });
  EXPECT_GT(e.known(), 0.9);
  EXPECT_LT(e.most(), 0.1);
  EXPECT_GT(with_things().metrics.transient, 100);
}

TEST(GroundBuilder, SigmaCoversPoseErrors) {
  GroundScene scene;
  scene.things = false;
  const Errors sure = build(scene).errors(5, anywhere);
  scene.look_m = 0.03;
  const Built unsure = build(scene);
  const Errors e = unsure.errors(5, anywhere);
  EXPECT_GT(e.within_2, 0.9);
  EXPECT_LT(e.within_1, 0.95) << "not just large";
  EXPECT_GT(sure.within_2, 0.95);
  EXPECT_GT(unsure.metrics.sigma_median_m, 0.012);
}

TEST(GroundBuilder, AnOffsetOfTheWholeRunIsAnOffsetOfTheMap) {
  GroundScene scene;
  scene.things = false;
  scene.shift_m = 0.4;
  Errors e = build(scene).errors(1, anywhere);
  EXPECT_NEAR(e.median(), 0.4, 0.003);
}

TEST(MountEstimator, FindsTheMisalignmentOfTheLadar) {
  GroundScene scene;
  scene.things = false;
  scene.turn = Vec3(0.0, -0.004, 0.0);
  const std::vector<GroundScene::Shot> shots = scene.drive();
  mapping::GroundSurface surface{mapping::GroundSurfaceParams()};
  for (const GroundScene::Shot& s : shots) surface.add(s.p);
  EXPECT_TRUE(surface.finish([] { return true; }));
  mapping::MountEstimator estimator(0.2);
  const mapping::GroundBuilderParams params;
  for (const GroundScene::Shot& s : shots) {
    const std::optional<mapping::GroundHere> here = surface.at(s.p.x(), s.p.y());
    if (!here || std::abs(s.p.z() - here->z_m) > 0.12) continue;
    estimator.add(s.p_vehicle, s.T_map_vehicle, Vec6::Zero(), here->gradient, s.p.z() - here->z_m,
                  mapping::height_sigma(params, s.range_m));
  }
  const mapping::MountError found = estimator.solve();
  // Pitch raises distant points. Roll is not observable on a straight path: a point always has the
  // same lateral distance.
  EXPECT_NEAR(found.turn_vehicle.y(), -0.004, 0.0006);
  EXPECT_NEAR(found.turn_vehicle.x(), 0.0, 0.002);
  EXPECT_NEAR(found.turn_vehicle.z(), 0.0, 0.002);
  EXPECT_EQ(found.late_s, 0.0) << "a vehicle with speed 0";
}

TEST(GroundLayer, TheLowestModeUnderGrassIsTheGroundAndGrassAloneHasALargeSigma) {
  std::array<double, mapping::HeightCounts::kLayers> weight{};
  const auto layer = [](double z) {
    return static_cast<std::size_t>((z - mapping::HeightCounts::kLowest_m) /
                                    mapping::HeightCounts::kLayer_m);
  };
  for (double z = 0.0; z < 0.3; z += mapping::HeightCounts::kLayer_m) {
    weight[layer(z + 1e-6)] += 10.0;
  }
  std::optional<mapping::GroundLayer> g = mapping::find_ground(weight, 3.0);
  ASSERT_TRUE(g);
  EXPECT_GT(g->sigma_m, 0.03);
  weight[layer(-0.011)] += 40.0;
  weight[layer(0.005)] += 40.0;
  g = mapping::find_ground(weight, 3.0);
  ASSERT_TRUE(g);
  EXPECT_NEAR(g->above_m, 0.0, 0.01);
  EXPECT_LT(g->sigma_m, 0.025);
  EXPECT_GT(g->is_ground(0.0), 0.8);
  EXPECT_LT(g->is_ground(0.06), 0.1);
  EXPECT_EQ(g->is_ground(-0.4), 0.0);
  weight.fill(0.0);
  EXPECT_FALSE(mapping::find_ground(weight, 3.0));
}

TEST(HeightCounts, FullHistogramsKeepTheirProportions) {
  mapping::HeightCounts counts;
  for (int k = 0; k < 9000; ++k) {
    EXPECT_TRUE(counts.add(0.011, 16));
    if (k % 4 == 0) {
      EXPECT_TRUE(counts.add(0.211, 16));
    }
  }
  EXPECT_FALSE(counts.add(2.0, 16));
  EXPECT_FALSE(counts.add(std::nan(""), 16));
  double low = 0;
  double high = 0;
  for (int k = 0; k < mapping::HeightCounts::kLayers; ++k) {
    (mapping::HeightCounts::middle_m(k) < 0.1 ? low : high) +=
        counts.weight[static_cast<std::size_t>(k)];
  }
  EXPECT_NEAR(low / high, 4.0, 0.2);
}

TEST(GroundSurface, AnInterruptEndsTheComputation) {
  mapping::GroundSurface surface{mapping::GroundSurfaceParams()};
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      for (int k = 0; k < 3; ++k) surface.add(Vec3(0.25 + 0.5 * i, 0.25 + 0.5 * j, 0.0));
    }
  }
  int asked = 0;
  EXPECT_FALSE(surface.finish([&asked] {
    ++asked;
    return false;
  }));
  EXPECT_EQ(asked, 1) << "after a part of the cells";
}

}  // namespace
}  // namespace rcs
