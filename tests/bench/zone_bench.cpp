// Cost of zones in BG. zone_bench --benchmark_repetitions=10
#include <benchmark/benchmark.h>

#include <cmath>

#include "rcs/zones/zone_raster.h"

namespace rcs {
namespace {

/// A ring around the origin whose radius changes from vertex to vertex by up to `depth`.
ZoneRing ring(double radius_m, int vertices, double depth) {
  ZoneRing out;
  for (int k = 0; k < vertices; ++k) {
    const double angle = 2.0 * kPi * k / vertices;
    const double r = radius_m * (1.0 - (k % 2 == 0 ? 0.0 : depth));
    out.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  return out;
}

Zone zone(ZoneKind kind, const ZoneRing& outer) {
  Zone z;
  z.kind = kind;
  z.polygons.push_back({outer, {}});
  return z;
}

/// A site of 1 km with a vertex each metre of its fence, and two ponds of 10 m next to the vehicle.
Zones site() {
  ZoneRing fence = ring(500.0, 3140, 0.002);
  for (Vec2& p : fence) p += Vec2(485.0, 0.0);  // its border is 15 m from the origin
  Zone ponds = zone(ZoneKind::kKeepOut, ring(10.0, 60, 0.1));
  for (Vec2& p : ponds.polygons[0].outer) p += Vec2(20.0, 10.0);
  Zone other = ponds;
  for (Vec2& p : other.polygons[0].outer) p += Vec2(0.0, -25.0);
  return Zones({zone(ZoneKind::kFence, fence), ponds, other});
}

/// The largest file: every edge crosses the patch of terrain.
Zones hostile() { return Zones({zone(ZoneKind::kKeepOut, ring(200.0, 20'000, 0.99))}); }

const ZoneWindow kPatch{0.4, {-75, -75}, 150, 150, 0.6, {1.0, 2.0}};

void raster(benchmark::State& state, const Zones& zones, double clearance_m) {
  ZoneRaster cells;
  for (auto _ : state) {
    benchmark::DoNotOptimize(cells.forbidden(zones, kPatch, clearance_m).data());
  }
}
BENCHMARK_CAPTURE(raster, site_2_m, site(), 2.0);
BENCHMARK_CAPTURE(raster, site_10_m, site(), 10.0);
BENCHMARK_CAPTURE(raster, hostile_2_m, hostile(), 2.0);

void clearance(benchmark::State& state, const Zones& zones) {
  Vec2 p(0.0, 0.0);
  for (auto _ : state) {
    p.x() = p.x() > 20.0 ? 0.0 : p.x() + 0.37;
    benchmark::DoNotOptimize(zones.clearance(p));
  }
}
BENCHMARK_CAPTURE(clearance, site, site());
BENCHMARK_CAPTURE(clearance, hostile, hostile());

}  // namespace
}  // namespace rcs

BENCHMARK_MAIN();
