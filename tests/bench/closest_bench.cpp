// closest_bench [FOLDER]: cost of a closest-point query as a function of the number of points, by
// brute force, by the kd-tree, and by the Delaunay triangulation that Madhavan and Messina use
// (section 2.1; in section 4 they expect a kd-tree to bring O(N_D N_M) down to O(N_D log N_M)). The
// points are scans of the simulated range imager with increasingly fine cells. Prints tables and
// writes FOLDER/closest.svg (default: out/closest).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "rcs/base/check.h"
#include "rcs/base/kd_tree.h"
#include "sim/scenario_file.h"
#include "tests/bench/delaunay_search.h"
#include "tools/base/files.h"
#include "tools/report/svg_plot.h"
#include "tools/report/table.h"
#include "tools/studies/cpu_time.h"
#include "tools/studies/simulated_scans.h"

namespace rcs::bench {
namespace {

constexpr double kMin_ms = 30.0;  // of a measurement: the stopwatch has a resolution of 1 us
constexpr int kTimes = 5;         // repetitions; the median is used
constexpr std::size_t kBruteQueries = 2000;

Points part_of(const Points& points, std::size_t n, std::mt19937* rng) {
  std::vector<std::size_t> all(points.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<std::size_t> some;
  std::sample(all.begin(), all.end(), std::back_inserter(some), n, *rng);  // keeps their order
  Points part;
  for (const std::size_t i : some) part.push_back(points[i]);
  return part;
}

Points shuffled(const Points& points, std::mt19937* rng) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), *rng);
  Points out;
  for (const std::size_t i : order) out.push_back(points[i]);
  return out;
}

struct Clouds {
  Points model;
  Points queries;  ///< the next scan, transformed by a guess
};

/// `n` points each of two consecutive scans with sufficiently fine cells.
Clouds clouds_of(std::size_t n, sim::Scenario scenario, std::mt19937* rng) {
  // Not all cells have a return; a few more cells are drawn so that the number is exact.
  constexpr double kCellsAPoint = 1.5;
  const double finer = std::sqrt(kCellsAPoint * static_cast<double>(n) /
                                 static_cast<double>(scenario.imager.rows * scenario.imager.cols));
  const int facets = scenario.imager.facets;
  scenario.imager.rows =
      facets * static_cast<int>(std::ceil(finer * scenario.imager.rows / facets));
  scenario.imager.cols = static_cast<int>(std::ceil(finer * scenario.imager.cols));
  const studies::ScanSet set = studies::simulate_scans(scenario, 1);
  const studies::ScanPair& pair = set.pairs.front();
  const Pose guess = pair.T_model_data * studies::random_offset({0.3, radians(1.0)}, rng);
  Clouds clouds;
  clouds.model = part_of(set.scans.at(pair.model), n, rng);
  const Points data = part_of(set.scans.at(pair.data), n, rng);
  RCS_CHECK(clouds.model.size() == n && data.size() == n);
  for (std::size_t i = 0; i < data.size(); ++i) {
    clouds.queries.push_back((guess * data[i].cast<double>()).cast<float>());
  }
  return clouds;
}

/// CPU time of one call of `work`.
template <class Work>
double measured_ms(const Work& work) {
  std::vector<double> times_ms;
  for (int time = 0; time < kTimes; ++time) {
    int calls = 0;
    double all_ms = 0.0;
    for (; all_ms < kMin_ms; ++calls) {
      studies::CpuWatch watch;
      work();
      all_ms += watch.stop_ms();
    }
    times_ms.push_back(all_ms / calls);
  }
  std::sort(times_ms.begin(), times_ms.end());
  return times_ms[kTimes / 2];
}

/// Keeps the compiler from removing unused results.
volatile float sink = 0.0F;

template <class Search>
double query_us(const Points& queries, std::size_t count, const Search& search) {
  const double ms = measured_ms([&] {
    float sum = 0.0F;
    for (std::size_t i = 0; i < count; ++i) sum += search(queries[i]);
    sink = sum;
  });
  return 1e3 * ms / static_cast<double>(count);
}

float brute2(const Points& model, const Vec3f& p) {
  float best = 1e30F;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const float dx = model.x[i] - p.x();
    const float dy = model.y[i] - p.y();
    const float dz = model.z[i] - p.z();
    best = std::min(best, dx * dx + dy * dy + dz * dz);
  }
  return best;
}

struct Row {
  double n = 0.0;
  double brute_us = 0.0;
  double tree_build_ms = 0.0;
  double tree_us = 0.0;
  double tree_shuffled_us = 0.0;
  double delaunay_build_ms = 0.0;
  double delaunay_us = 0.0;
  double delaunay_shuffled_us = 0.0;
  double steps = 0.0;  ///< of a walk
  double steps_shuffled = 0.0;
  double simplices = 0.0;  ///< per point
  double degree = 0.0;
};

Row measure(std::size_t n, const sim::Scenario& scenario) {
  std::mt19937 rng(static_cast<unsigned>(n));
  const Clouds c = clouds_of(n, scenario, &rng);
  const Points mixed = shuffled(c.queries, &rng);
  Row row;
  row.n = static_cast<double>(n);
  row.brute_us = query_us(mixed, std::min(n, kBruteQueries),
                          [&c](const Vec3f& p) { return brute2(c.model, p); });

  row.tree_build_ms =
      measured_ms([&c] { sink = KdTree(c.model).closest(c.queries[0]).distance2_m2; });
  const KdTree tree(c.model);
  const auto by_tree = [&tree](const Vec3f& p) { return tree.closest(p).distance2_m2; };
  row.tree_us = query_us(c.queries, n, by_tree);
  row.tree_shuffled_us = query_us(mixed, n, by_tree);

  row.delaunay_build_ms =
      measured_ms([&c] { sink = static_cast<float>(DelaunaySearch(c.model).simplices()); });
  const DelaunaySearch delaunay(c.model);
  row.simplices = static_cast<double>(delaunay.simplices()) / row.n;
  row.degree = delaunay.degree();
  const auto walk_us = [&](const Points& queries, double* steps) {
    DelaunaySearch::Walk walk;
    std::uint64_t walks = 0;
    const double us = query_us(queries, n, [&](const Vec3f& p) {
      ++walks;
      return delaunay.closest(p, &walk).distance2_m2;
    });
    *steps = static_cast<double>(walk.steps) / static_cast<double>(walks);
    return us;
  };
  row.delaunay_us = walk_us(c.queries, &row.steps);
  row.delaunay_shuffled_us = walk_us(mixed, &row.steps_shuffled);

  for (std::size_t i = 0; i < n; i += 1 + n / 200) {
    const float best = brute2(c.model, c.queries[i]);
    DelaunaySearch::Walk walk;
    RCS_CHECK(std::abs(by_tree(c.queries[i]) - best) <= 1e-5F * best);
    RCS_CHECK(std::abs(delaunay.closest(c.queries[i], &walk).distance2_m2 - best) <= 1e-5F * best);
  }
  return row;
}

struct Curve {
  const char* name;
  report::Colour colour;
  report::SeriesStyle style;
  double (*ms)(const Row&);
};

/// As many queries as points: one iteration of a registration.
double all_ms(const Row& r, double each_us) { return 1e-3 * each_us * r.n; }

using report::Colour;
using report::SeriesStyle;
const std::vector<Curve> kQueries = {
    {"brute force", report::Colour::kGrey, report::SeriesStyle::kLine,
     [](const Row& r) { return all_ms(r, r.brute_us); }},
    {"kd-tree", report::Colour::kBlue, report::SeriesStyle::kLine,
     [](const Row& r) { return all_ms(r, r.tree_us); }},
    {"kd-tree, shuffled", report::Colour::kBlue, report::SeriesStyle::kDashed,
     [](const Row& r) { return all_ms(r, r.tree_shuffled_us); }},
    {"Delaunay", report::Colour::kOrange, report::SeriesStyle::kLine,
     [](const Row& r) { return all_ms(r, r.delaunay_us); }},
    {"Delaunay, shuffled", report::Colour::kOrange, report::SeriesStyle::kDashed,
     [](const Row& r) { return all_ms(r, r.delaunay_shuffled_us); }},
};
const std::vector<Curve> kBuilds = {
    {"kd-tree", report::Colour::kBlue, report::SeriesStyle::kLine,
     [](const Row& r) { return r.tree_build_ms; }},
    {"Delaunay", report::Colour::kOrange, report::SeriesStyle::kLine,
     [](const Row& r) { return r.delaunay_build_ms; }},
};

/// Exponent k of t ~ N^k, by least squares of the logarithms.
double exponent(const std::vector<Row>& rows, double (*ms)(const Row&)) {
  double x = 0.0;
  double y = 0.0;
  for (const Row& r : rows) {
    x += std::log(r.n) / static_cast<double>(rows.size());
    y += std::log(ms(r)) / static_cast<double>(rows.size());
  }
  double xx = 0.0;
  double xy = 0.0;
  for (const Row& r : rows) {
    xx += (std::log(r.n) - x) * (std::log(r.n) - x);
    xy += (std::log(r.n) - x) * (std::log(ms(r)) - y);
  }
  return xy / xx;
}

void print(const std::vector<Row>& rows) {
  report::Table table{{"N", "brute [us]", "kd-tree [us]", "shuffled", "built [ms]", "Delaunay [us]",
                       "shuffled", "built [ms]", "steps", "shuffled", "simplices/N", "neighbours"},
                      {}};
  for (const Row& r : rows) {
    table.rows.push_back(
        {fmt::format("{:.0f}", r.n), fmt::format("{:.2f}", r.brute_us),
         fmt::format("{:.3f}", r.tree_us), fmt::format("{:.3f}", r.tree_shuffled_us),
         fmt::format("{:.2f}", r.tree_build_ms), fmt::format("{:.3f}", r.delaunay_us),
         fmt::format("{:.3f}", r.delaunay_shuffled_us), fmt::format("{:.1f}", r.delaunay_build_ms),
         fmt::format("{:.2f}", r.steps), fmt::format("{:.1f}", r.steps_shuffled),
         fmt::format("{:.2f}", r.simplices), fmt::format("{:.1f}", r.degree)});
  }
  fmt::print("CPU time of one query, and of building, N points and N queries\n{}\n",
             to_text(table));
  report::Table fits{{"time ~ N^k", "k"}, {}};
  const auto n_log_n = [](const Row& r) { return r.n * std::log(r.n); };
  fits.rows.push_back({"N log N would be", fmt::format("{:.2f}", exponent(rows, n_log_n))});
  for (const Curve& c : kQueries) {
    fits.rows.push_back(
        {fmt::format("N queries, {}", c.name), fmt::format("{:.2f}", exponent(rows, c.ms))});
  }
  for (const Curve& c : kBuilds) {
    fits.rows.push_back(
        {fmt::format("building, {}", c.name), fmt::format("{:.2f}", exponent(rows, c.ms))});
  }
  fmt::print("{}", to_text(fits));
}

report::Plot plot_of(const std::string& title, const std::vector<Row>& rows,
                     const std::vector<Curve>& curves) {
  report::Plot plot;
  plot.title = title;
  plot.x_label = "points N";
  plot.y_label = "CPU time [ms]";
  plot.width_px = 1000;
  plot.height_px = 380;
  plot.log_x = plot.log_y = true;
  for (const Curve& c : curves) {
    report::Series s;
    s.label = fmt::format("{}: N^{:.2f}", c.name, exponent(rows, c.ms));
    s.colour = c.colour;
    s.style = c.style;
    for (const Row& r : rows) {
      s.x.push_back(r.n);
      s.y.push_back(c.ms(r));
    }
    plot.series.push_back(s);
  }
  return plot;
}

int run(const std::string& folder) {
  const char* const root = std::getenv("RCS_SOURCE_DIR");
  const Result<sim::Scenario> scenario = sim::load_scenario(
      std::string(root != nullptr ? root : ".") + "/config/sim/reference.toml", {});
  if (!scenario) {
    fmt::print(stderr, "closest_bench: {}\n", scenario.error().message);
    return 1;
  }
  std::vector<Row> rows;
  for (const std::size_t n : {1000U, 2000U, 5000U, 10'000U, 20'000U, 50'000U, 100'000U, 200'000U}) {
    rows.push_back(measure(n, *scenario));
    fmt::print(stderr, "closest_bench: {} points\n", n);
  }
  print(rows);
  const std::string path = folder + "/closest.svg";
  const Outcome written = tools::write_text(
      path,
      report::render_stacked({plot_of("N queries for the closest of N points", rows, kQueries),
                              plot_of("What they are searched in, built", rows, kBuilds)}));
  if (!written) {
    fmt::print(stderr, "closest_bench: {}\n", written.error().message);
    return 1;
  }
  fmt::print("picture: {}\n", path);
  return 0;
}

}  // namespace
}  // namespace rcs::bench

int main(int argc, char** argv) { return rcs::bench::run(argc > 1 ? argv[1] : "out/closest"); }
