// Cost of WM's steps. wm_bench --benchmark_repetitions=10
#include <benchmark/benchmark.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "modules/wm/terrain/terrain_grid.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

Belief some_belief() {
  WmParams params;
  Belief b = initial_belief(params, from_utime(1'000'000));
  b.x.v_world = Vec3(8.0, 0.0, 0.0);
  b.x.inertial = true;
  return start_epoch(b, {exp_so3(Vec3(0.0, 0.0, 1.0)), Vec3(30.0, 5.0, 1.0)}, 1);
}

void predict_inertial(benchmark::State& state) {
  const Belief b = some_belief();
  const ImuSample imu{b.x.stamp + Duration(5'000), Duration(5'000), Vec3(0.001, 0.002, 0.003),
                      Vec3(0.01, 0.0, 0.049)};
  const WmParams params;
  const Earth earth = earth_at(test_datum());
  for (auto _ : state) {
    benchmark::DoNotOptimize(predict(b, imu, earth, params.ins, params.drive, {}));
  }
}
BENCHMARK(predict_inertial);

void predict_coasting(benchmark::State& state) {
  const Belief b = some_belief();
  const WmParams params;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        predict(b, b.x.stamp + Duration(100'000), params.motion, params.ins, params.drive));
  }
}
BENCHMARK(predict_coasting);

void update_gps(benchmark::State& state) {
  const Belief b = some_belief();
  const GpsParams params;
  for (auto _ : state) {
    benchmark::DoNotOptimize(update(b, gps_position(b.x, GpsFix{}, params), 1e9));
  }
}
BENCHMARK(update_gps);

void update_rolling(benchmark::State& state) {
  const Belief b = some_belief();
  const RollingMatch z{T_rolling_vehicle(b.x), 1e5 * Mat6::Identity(), 1, false};
  const RegistrationParams params;
  for (auto _ : state) {
    benchmark::DoNotOptimize(update(b, rolling_match(b.x, z, params, 1.0), 1e9));
  }
}
BENCHMARK(update_rolling);

/// A scan that is 100 ms late with an INS at 200 Hz: the measurements that are fused again because
/// of it.
void late_scan(benchmark::State& state) {
  WmParams params;
  DriveScript script;
  script.imu_hz = 200.0;
  script.length_s = 20.0;
  const std::vector<Truth> truth = make_drive(script);
  Sensors sensors(truth, params, {});
  Estimator estimator(params, test_datum());
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    if (i % 20 == 0) estimator.add(truth[i].stamp, sensors.scan(i));
    if (i % 40 == 0) estimator.add(truth[i].stamp, sensors.gps(i));
    estimator.fuse();
    estimator.clear_innovations();
  }
  std::int64_t k = 0;
  const Stamp late = truth.back().stamp - Duration(100'000);
  const RollingMatch scan{T_rolling_vehicle(estimator.state().belief.x), 1e2 * Mat6::Identity(), 1,
                          false};
  // Only some hundred fit into the ring.
  for (auto _ : state) {
    estimator.add(late + Duration(++k), scan);
    estimator.fuse();
    estimator.clear_innovations();
  }
}
BENCHMARK(late_scan)->Iterations(50);

/// The filter with all its sub-filters in operation: INS at 200 Hz, scans at 10, odometry at 20,
/// fixes at 5 (none in the last third). `core` is the share of one core that it uses in real time.
void estimator_with_subfilters(benchmark::State& state) {
  WmParams params;
  DriveScript script;
  script.imu_hz = 200.0;
  script.length_s = 90.0;
  const std::vector<Truth> truth = make_drive(script);
  Sensors sensors(truth, params, {});
  std::vector<ImuSample> imu(truth.size());
  std::vector<std::optional<RollingMatch>> scans(truth.size());
  std::vector<std::optional<GeodeticFix>> fixes(truth.size());
  std::vector<std::optional<OdometrySample>> wheels(truth.size());
  for (std::size_t i = 1; i < truth.size(); ++i) {
    imu[i] = sensors.imu(i);
    if (i % 20 == 0) scans[i] = sensors.scan(i);
    if (i % 40 == 0 && 3 * i < 2 * truth.size()) fixes[i] = sensors.gps(i);
    if (i % 10 == 0) wheels[i] = sensors.odometry(i);
  }
  for (auto _ : state) {
    Estimator estimator(params, test_datum());
    for (std::size_t i = 1; i < truth.size(); ++i) {
      const Stamp now = truth[i].stamp;
      estimator.add(imu[i]);
      if (fixes[i]) estimator.add(now, *fixes[i]);
      if (scans[i]) estimator.add(now, *scans[i]);
      if (wheels[i]) estimator.add(now, *wheels[i]);
      estimator.fuse();
      estimator.clear_innovations();
    }
    benchmark::DoNotOptimize(estimator.state().belief.x.T_world_vehicle.p.x());
  }
  state.counters["core"] =
      benchmark::Counter(script.length_s * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(estimator_with_subfilters)->Unit(benchmark::kMillisecond);

/// A scan of rolling ground all around, denser where it is nearer.
Points scan_of_ground(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  Points points;
  for (int k = 0; k < 5000; ++k) {
    const float range_m = 5.0F + 30.0F * unit(random) * unit(random);
    const float side_rad = 6.28F * unit(random);
    const float x = range_m * std::cos(side_rad);
    const float y = range_m * std::sin(side_rad);
    points.push_back({x, y, 0.5F * std::sin(0.3F * x) + 0.05F * unit(random)});
  }
  return points;
}

void terrain_insert(benchmark::State& state) {
  TerrainGrid grid{TerrainParams{}};
  const Points points = scan_of_ground(1);
  for (auto _ : state) grid.insert(points, Pose{});
}
BENCHMARK(terrain_insert);

void terrain_patch(benchmark::State& state) {
  TerrainGrid grid{TerrainParams{}};
  for (unsigned seed = 1; seed <= 20; ++seed) grid.insert(scan_of_ground(seed), Pose{});
  std::vector<TerrainAnswer> answers;
  for (auto _ : state) benchmark::DoNotOptimize(grid.patch(Pose{}, &answers));
}
BENCHMARK(terrain_patch);

}  // namespace
}  // namespace rcs::wm

BENCHMARK_MAIN();
