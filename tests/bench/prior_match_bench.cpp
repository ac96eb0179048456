// Cost of matching a scan to the a priori map as in SP: select the lowest points of columns from
// the points for the rolling map, then match; with surface points, also the above-ground structure.
// prior_match_bench --benchmark_repetitions=20
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "modules/registration/voxel_sampler.h"
#include "modules/sp/prior/prior_match.h"
#include "modules/sp/prior/prior_scan.h"
#include "tests/support/point_scenes.h"

namespace rcs::sp {
namespace {

double hills(double x, double y) {
  return 4.0 * std::sin(0.05 * x + 0.3) * std::cos(0.04 * y) + 1.5 * std::sin(0.11 * y);
}

// A wall at each of these distances east, as long as the scene and as high as kTop_m.
constexpr double kWallEast_m[] = {18.0, 35.0};
constexpr double kWallNorth_m = 40.0;  // to each side
constexpr double kTop_m = 3.0;

/// As `rcs map build --points` extracts them.
void add_walls(Raster* r) {
  constexpr double kStep_m = 0.4;
  const Vec2 corner = r->level.cell_m * Vec2(r->first.i, r->first.j);
  for (const double x : kWallEast_m) {
    for (double y = -kWallNorth_m; y < kWallNorth_m; y += kStep_m) {
      for (double up = 0.5; up < kTop_m; up += kStep_m) {
        const Vec3 p(x - corner.x(), y - corner.y(), hills(x, y) + up);
        r->points.push_back({p.cast<float>(), Vec3f(-1.0F, 0.0F, 0.0F), 0.05F});
      }
    }
  }
}

ElevationMap survey(double cell_m, bool walls) {
  constexpr double kHalf_m = 160.0;
  MapFrame frame;
  frame.datum = {0.7, -1.3, {100.0}};
  Raster r;
  r.level.cell_m = cell_m;
  const int half = static_cast<int>(kHalf_m / cell_m);
  r.first = {-half, -half};
  r.width = r.height = 2 * half;
  r.sigma_m = {0.1F};
  for (int j = 0; j < r.height; ++j) {
    for (int i = 0; i < r.width; ++i) {
      const Vec2 at = r.level.centre({r.first.i + i, r.first.j + j});
      r.z_m.push_back(static_cast<float>(hills(at.x(), at.y())));
    }
  }
  if (walls) add_walls(&r);
  return std::move(ElevationMap::from_rasters(frame, {r})).value();
}

struct Ladar {
  int rows, cols;
  double low_deg, high_deg;  // elevation
  double wide_deg;           // azimuth, centred ahead
  double reach_m;
  double map_voxel_m;  // as configured
};
constexpr Ladar kDemo3{32, 180, -15.0, 5.0, 90.0, 60.0, 0.1};
constexpr Ladar kHdl64{64, 1900, -24.8, 2.0, 360.0, 80.0, 0.2};

Points scan(const Ladar& ladar, const Pose& T, bool walls) {
  constexpr double kStep_m = 0.25;
  const Vec3 sensor = T * Vec3(0.0, 0.0, 1.0);
  Points points;
  for (int row = 0; row < ladar.rows; ++row) {
    for (int col = 0; col < ladar.cols; ++col) {
      const double up =
          radians(ladar.low_deg + (ladar.high_deg - ladar.low_deg) * row / (ladar.rows - 1));
      const double left = radians(ladar.wide_deg * (static_cast<double>(col) / ladar.cols - 0.5));
      const Vec3 ray =
          T.q * Vec3(std::cos(up) * std::cos(left), std::cos(up) * std::sin(left), std::sin(up));
      for (double range = 1.0; range < ladar.reach_m; range += kStep_m) {
        const Vec3 p = sensor + range * ray;
        const double top_m = hills(p.x(), p.y()) + kTop_m;
        const bool in_wall = walls && std::abs(p.y()) < kWallNorth_m && p.z() < top_m &&
                             std::any_of(std::begin(kWallEast_m), std::end(kWallEast_m),
                                         [&](double x) { return std::abs(p.x() - x) < 0.2; });
        if (p.z() > hills(p.x(), p.y()) && !in_wall) continue;
        points.push_back((T.inverse() * p).cast<float>());
        break;
      }
    }
  }
  return points;
}

/// The prediction has the error of a vehicle that drives without GPS.
void match(benchmark::State& state, const Ladar& ladar, double cell_m, bool walls) {
  const ElevationMap map = survey(cell_m, walls);
  const Pose T = test::pose(0.0, 0.0, hills(0.0, 0.0) + 1.0, 0.02, -0.03, 0.5);
  Points points;
  registration::VoxelSampler().sample(scan(ladar, T, walls), ladar.map_voxel_m, &points);
  const registration::Prediction prediction =
      test::prediction(T * test::pose(0.3, -0.2, 0.1, 0.002, 0.002, 0.005), 0.3, 0.005);
  PriorScan matched;
  PriorMatchWorkspace workspace;
  const PriorMatchParams params;
  PriorMatch found;
  for (auto _ : state) {
    matched.take(points, Vec3::UnitZ(), walls ? params.points.max_points : 0, {});
    found = match_prior_map(matched.ground(), matched.standing(), map, prediction, params,
                            1'000'000'000, &workspace);
    benchmark::DoNotOptimize(found);
  }
  state.counters["points"] = static_cast<double>(points.size());
  state.counters["columns"] = static_cast<double>(matched.ground().size());
  state.counters["standing"] = static_cast<double>(matched.standing().size());
  state.counters["iterations"] = found.registration.iterations;
  state.counters["stop"] = static_cast<double>(found.registration.stop);
}

BENCHMARK_CAPTURE(match, demo3_on_10_m, kDemo3, 10.0, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, demo3_on_1_m, kDemo3, 1.0, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, hdl64_on_1_m, kHdl64, 1.0, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, hdl64_on_0_5_m, kHdl64, 0.5, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, demo3_on_1_m_and_walls, kDemo3, 1.0, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(match, hdl64_on_1_m_and_walls, kHdl64, 1.0, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rcs::sp

BENCHMARK_MAIN();
