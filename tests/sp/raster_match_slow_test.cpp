// Rasters of streets with slopes of 0 to 6 deg from 100 starts up to 3 m and 5 deg off. The streets
// and errors are others than those on which the constants were chosen (seeds 1 to 4).
#include <gtest/gtest.h>

#include "modules/sp/prior/prior_scan.h"
#include "tests/support/street_raster.h"
#include "tools/studies/match_starts.h"

namespace rcs::test {
namespace {

TEST(RasterMatch, StreetsOfAnySlopeAreFoundAtOnePlaceOrRefused) {
  sp::PriorMatchParams params;
  params.search_sigma_m = 1.0;
  int places = 0, met = 0, found = 0, inside = 0;
  for (const double slope_deg : {0.0, 1.0, 1.7, 3.0, 4.5, 6.0}) {
    for (const bool kerbs : {true, false}) {
      for (const std::uint32_t seed : {301U, 302U}) {
        const RasterPlace place = simulated_street({radians(slope_deg), kerbs, seed});
        sp::PriorScanParams columns;
        columns.column_m = 0.5;
        sp::PriorScan scan;
        scan.take(place.scan, place.T_map_vehicle.q.conjugate() * Vec3::UnitZ(), 0, columns);
        for (const RasterErrors& errors :
             {RasterErrors{0.3, 0.05, 0.0, 0.05, seed}, RasterErrors{0.3, 0.05, 1.5, 0.05, seed}}) {
          studies::MatchStarts starts;
          starts.seed = seed;
          const studies::MatchEnds ends = match_from_starts(
              scan, raster_map(place, errors), place.T_map_vehicle, starts, params, [](int) {});
          ++places;
          met += ends.converged + ends.refused >= 95 ? 1 : 0;
          if (ends.refused > 50) continue;
          ++found;
          inside += ends.inside(place.T_map_vehicle.p.head<2>()) ? 1 : 0;
        }
      }
    }
  }
  std::printf("%d of %d places met, %d found, %d with the reference inside the 95 %% ellipse\n",
              met, places, found, inside);
  EXPECT_EQ(met, places);
  EXPECT_GE(found, places / 4);
  EXPECT_GE(inside, 0.88 * found);
}

}  // namespace
}  // namespace rcs::test
