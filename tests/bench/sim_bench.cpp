// sim_bench: milliseconds per scan of the simulator, in the reference scenario. The vehicle drives,
// so that the tiles of the world are generated during the drive as in a run.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "sim/scenario_file.h"
#include "sim/simulator.h"

namespace rcs::sim {
namespace {

Result<Scenario> scenario(const std::string& name) {
  const char* const root = std::getenv("RCS_SOURCE_DIR");
  return load_scenario(std::string(root != nullptr ? root : ".") + "/config/sim/" + name, {});
}

/// A simulator in the middle of its course, at speed.
constexpr double kBegin_s = 20.0;
constexpr double kEnd_s = 190.0;

void demo3_scan(benchmark::State& state) {
  const Result<Scenario> s = scenario("reference.toml");
  if (!s) return state.SkipWithError(s.error().message.c_str());
  const Simulator simulator(*s);
  RangeImager imager(s->imager, s->beam, s->mount, s->seed);
  RangeFacet facet;
  double time_s = kBegin_s;
  std::int64_t shots = 0;
  std::int64_t returns = 0;
  double sum_m = 0.0;
  for (auto _ : state) {
    for (int k = 0; k < s->imager.facets; ++k) {
      imager.render(simulator.world(), simulator.vehicle(), time_s + k * imager.facet_duration_s(),
                    k, &facet);
      for (const float r : facet.range_m) {
        returns += r > 0.0F ? 1 : 0;
        sum_m += r;
      }
    }
    shots += std::int64_t{s->imager.rows} * s->imager.cols;
    const Vec3 p = simulator.vehicle().pose_at(time_s).p;
    simulator.world().forget_beyond(p.x(), p.y(), s->beam.max_range_m + 50.0);
    time_s = time_s + s->imager.period_s < kEnd_s ? time_s + s->imager.period_s : kBegin_s;
  }
  state.counters["returns_share"] = static_cast<double>(returns) / static_cast<double>(shots);
  state.counters["mean_range_m"] = sum_m / static_cast<double>(returns);
  state.counters["x_real_time"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * s->imager.period_s, benchmark::Counter::kIsRate);
}
BENCHMARK(demo3_scan)->Unit(benchmark::kMillisecond)->Iterations(1500);

/// Everything: sensors, encoding, ground truth.
void whole_scenario_second(benchmark::State& state) {
  const Result<Scenario> s = scenario("reference.toml");
  if (!s) return state.SkipWithError(s.error().message.c_str());
  Simulator simulator(*s);
  SourceEvent event;
  Stamp until = simulator.peek();
  for (auto _ : state) {
    until += std::chrono::seconds(1);
    while (simulator.peek() < until) simulator.take(&event);
  }
  state.counters["x_real_time"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(whole_scenario_second)->Unit(benchmark::kMillisecond)->Iterations(150);

}  // namespace
}  // namespace rcs::sim

BENCHMARK_MAIN();
