// Match of a scan to rasters of streets and of surveyed ground from 100 starts up to 3 m and 5 deg
// off (docs/experiments/registration/raster_match.md).
// raster_match_study [--seeds FIRST LAST] [--starts N] [--cells C...] [--column M] [--data FOLDER]
//   [--all]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/support/real_sweeps.h"
#include "tests/support/street_raster.h"
#include "tools/studies/match_starts.h"
#include "tools/survey/npy_raster.h"

namespace rcs::test {
namespace {

struct Options {
  std::vector<std::uint32_t> seeds = {1, 3};  ///< first and last
  int starts = 100;
  double column_m = 0.5;
  std::vector<double> cells_m = {0.3, 1.0};
  std::string data = "../shared/data";
  std::string only;
  double search_sigma_m = 1.0;
  bool all = false;  ///< a line for each place
};

struct Errors {
  double sigma_m, correlation_m, stated_m;
};
constexpr Errors kErrors[] = {{0.02, 0.0, 0.02}, {0.05, 0.0, 0.05}, {0.15, 0.0, 0.15},
                              {0.02, 0.0, 0.1},  {0.02, 1.5, 0.02}, {0.05, 1.5, 0.05},
                              {0.15, 1.5, 0.15}};
constexpr double kSlopes_deg[] = {0.0, 1.0, 1.7, 2.0, 3.0, 4.5, 6.0};

struct Counts {
  int places = 0;  ///< evaluated
  int met = 0;     ///< 95 % of the starts at one place, or refused
  int found = 0;   ///< places where half of the starts or more are not refused
  int inside = 0;  ///< of these, with the reference inside the ellipse
  int one = 0, refused = 0, wrong = 0, starts = 0;
  double error2 = 0.0, major = 0.0;
  double used = 0.0;
  void operator+=(const Counts& o) {
    places += o.places, met += o.met, found += o.found, inside += o.inside, one += o.one;
    refused += o.refused, wrong += o.wrong, starts += o.starts, error2 += o.error2;
    major += o.major, used += o.used;
  }
};

void print(const std::string& name, const Counts& c) {
  const double n = std::max(1, c.found);
  fmt::print(
      "{:<54} {:4} {:5.1f} | {:5.1f} {:5.1f} {:5.1f} | {:4} {:5.1f} | {:6.2f} {:6.2f} {:8.0f}\n",
      name, c.places, 100.0 * c.met / c.places, 100.0 * c.one / c.starts,
      100.0 * c.refused / c.starts, 100.0 * c.wrong / c.starts, c.found, 100.0 * c.inside / n,
      std::sqrt(c.error2 / n), c.major / n, c.used / c.places);
  std::fflush(stdout);
}

Counts evaluate(const RasterPlace& place, const ElevationMap& map, const Options& options,
                std::uint32_t seed) {
  sp::PriorScanParams columns;
  columns.column_m = options.column_m;
  sp::PriorScan scan;
  scan.take(place.scan, place.T_map_vehicle.q.conjugate() * Vec3::UnitZ(), 0, columns);
  sp::PriorMatchParams params;
  params.max_iterations = 60;
  params.search_sigma_m = options.search_sigma_m;
  studies::MatchStarts starts;
  starts.starts = options.starts;
  starts.max_heading_rad = radians(5.0);
  starts.seed = seed;
  const studies::MatchEnds ends =
      match_from_starts(scan, map, place.T_map_vehicle, starts, params, [](int) {});
  Counts c;
  c.places = 1;
  c.starts = options.starts;
  c.one = ends.converged;
  c.refused = ends.refused;
  c.wrong = options.starts - c.one - c.refused;
  c.met = c.one + c.refused >= 0.95 * options.starts ? 1 : 0;
  c.used = ends.used;
  double error = 0.0, major = 0.0;
  if (2 * c.refused <= options.starts) {
    c.found = 1;
    c.inside = ends.inside(place.T_map_vehicle.p.head<2>()) ? 1 : 0;
    error = (ends.poses[ends.nearest].p - place.T_map_vehicle.p).head<2>().norm();
    major = std::sqrt(5.991 * ends.plane().eigenvalues().real().maxCoeff());
  }
  c.error2 = error * error;
  c.major = major;
  if (options.all) print(fmt::format("  {} seed {}", place.name, seed), c);
  return c;
}

template <class Place>
void over_seeds(const std::string& name, const Options& options, double cell_m, const Errors& e,
                Place& place, Counts* total) {
  const std::string title = fmt::format(
      "{}, {} m, {} m{}{}", name, cell_m, e.sigma_m, e.correlation_m > 0.0 ? " over 1.5 m" : "",
      e.stated_m != e.sigma_m ? fmt::format(", stated {} m", e.stated_m) : "");
  if (!options.only.empty() && title.find(options.only) == std::string::npos) return;
  Counts counts;
  for (std::uint32_t seed = options.seeds[0]; seed <= options.seeds[1]; ++seed) {
    const RasterPlace& p = place(seed);
    counts += evaluate(p, raster_map(p, {cell_m, e.sigma_m, e.correlation_m, e.stated_m, seed}),
                       options, seed);
  }
  print(title, counts);
  *total += counts;
}

/// The places are the same for all rasters: each is made once, when it is needed.
template <class Make>
auto kept(const Make& make) {
  return [places = std::map<std::uint32_t, RasterPlace>(),
          make](std::uint32_t seed) mutable -> const RasterPlace& {
    const auto at = places.find(seed);
    return at != places.end() ? at->second : places.emplace(seed, make(seed)).first->second;
  };
}

void streets(const Options& options, Counts* total) {
  for (const bool kerbs : {true, false}) {
    for (const double slope_deg : kSlopes_deg) {
      auto place = kept([&](std::uint32_t seed) {
        return simulated_street({radians(slope_deg), kerbs, seed});
      });
      Counts of_slope;
      for (const double cell_m : options.cells_m) {
        for (const Errors& e : kErrors) {
          over_seeds(fmt::format("street {} deg{}", slope_deg, kerbs ? ", kerbs" : ""), options,
                     cell_m, e, place, &of_slope);
        }
      }
      if (of_slope.places == 0) continue;
      print(fmt::format("= street {} deg{}", slope_deg, kerbs ? ", kerbs" : ""), of_slope);
      *total += of_slope;
    }
  }
}

void surveys(const Options& options, Counts* total) {
  struct Cloud {
    std::string name, file;
    int class_column;
    double unit_m;
  };
  for (const Cloud& cloud : {Cloud{"forest", "/terrain_lidar/lidR/Topography.xyz", 7, 1.0},
                             Cloud{"Oregon", "/terrain_lidar/pdal/autzen_trim.las", 0, 0.3048}}) {
    const Result<Survey> survey =
        read_survey(options.data + cloud.file, cloud.class_column, cloud.unit_m);
    if (!survey) {
      fmt::print("{}\n", survey.error().message);
      continue;
    }
    auto place = kept([&](std::uint32_t seed) { return surveyed_place(*survey, seed); });
    for (const double cell_m : options.cells_m) {
      for (const double stated_m : {0.05, 0.15}) {
        over_seeds(cloud.name, options, cell_m, {0.0, 0.0, stated_m}, place, total);
      }
    }
  }
}

/// The two real sweeps on the real raster, and on the raster with errors added.
void real_sweeps(const Options& options, Counts* total) {
  constexpr Errors kAdded[] = {{0.0, 0.0, 0.05},  {0.0, 0.0, 0.1},   {0.05, 0.0, 0.05},
                               {0.15, 0.0, 0.15}, {0.02, 1.5, 0.02}, {0.05, 1.5, 0.05},
                               {0.15, 1.5, 0.15}};
  for (const Errors& e : kAdded) {
    const Result<RealSweeps> sweeps = pittsburgh_sweeps(options.data, e.stated_m);
    if (!sweeps) {
      fmt::print("{}\n", sweeps.error().message);
      return;
    }
    for (const RasterPlace& place : sweeps->places) {
      const std::string title = fmt::format("{}, {} m{}, stated {} m", place.name, e.sigma_m,
                                            e.correlation_m > 0.0 ? " over 1.5 m" : "", e.stated_m);
      if (!options.only.empty() && title.find(options.only) == std::string::npos) continue;
      Counts counts;
      for (std::uint32_t seed = options.seeds[0]; seed <= options.seeds[1]; ++seed) {
        Raster raster = sweeps->raster;
        add_errors(e.sigma_m, e.correlation_m, seed, &raster);
        counts += evaluate(place, map_of(sweeps->frame, raster), options, seed);
      }
      print(title, counts);
      *total += counts;
    }
  }
}

void pittsburgh(const Options& options, Counts* total) {
  const Result<survey::ImportedRaster> raster =
      survey::import_av2(options.data + kPittsburghLog, {});
  if (!raster) {
    fmt::print("{}\n", raster.error().message);
    return;
  }
  auto place =
      kept([&](std::uint32_t seed) { return place_on_raster(raster->raster, seed).value(); });
  for (const double cell_m : options.cells_m) {
    for (const Errors& e : kErrors) over_seeds("Pittsburgh", options, cell_m, e, place, total);
  }
}

}  // namespace
}  // namespace rcs::test

int main(int argc, char** argv) {
  CLI::App app("Match of a scan to rasters from random starts");
  rcs::test::Options options;
  app.add_option("--seeds", options.seeds, "first and last")->expected(2);
  app.add_option("--starts", options.starts);
  app.add_option("--column", options.column_m);
  app.add_option("--cells", options.cells_m);
  app.add_option("--search-sigma", options.search_sigma_m, "[m]; 1000: local matches alone");
  app.add_option("--data", options.data);
  app.add_option("--only", options.only, "rasters with this text in their names");
  app.add_flag("--all", options.all, "a line for each place");
  CLI11_PARSE(app, argc, argv);
  fmt::print("{:<54} {:>4} {:>5} | {:>5} {:>5} {:>5} | {:>4} {:>5} | {:>6} {:>6} {:>8}\n", "raster",
             "n", "met %", "one %", "ref %", "wr %", "n", "in %", "rms m", "95% m", "units");
  rcs::test::Counts total;
  rcs::test::streets(options, &total);
  rcs::test::surveys(options, &total);
  rcs::test::pittsburgh(options, &total);
  rcs::test::real_sweeps(options, &total);
  if (total.places > 0) rcs::test::print("all", total);
  return 0;
}
