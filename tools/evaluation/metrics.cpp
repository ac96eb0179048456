#include "tools/evaluation/metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/node/log/log_file.h"

namespace rcs::evaluation {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kFineCell_m = 0.25;
constexpr std::size_t kMaxCells = 40'000;  // about 0.6 MB of SVG

report::Series course_of(const tools::Trajectory& poses, const std::string& label,
                         report::Colour colour, report::SeriesStyle style) {
  report::Series s{label, colour, style, {}, {}, {}};
  for (const tools::StampedPose& p : poses) {
    s.x.push_back(p.T.p.x());
    s.y.push_back(p.T.p.y());
  }
  return s;
}

bool denied(const std::vector<TimeInterval>& outages, Stamp stamp) {
  return std::any_of(outages.begin(), outages.end(),
                     [stamp](const TimeInterval& i) { return i.contains(stamp); });
}

/// Colour of run i in every plot; orange is reserved for the course without GPS.
report::Colour colour_of_run(std::size_t i) {
  constexpr report::Colour kOrder[] = {report::Colour::kBlue, report::Colour::kGreen,
                                       report::Colour::kPurple, report::Colour::kYellow};
  return kOrder[i % std::size(kOrder)];
}

/// The extent of a course with a margin; an estimate may leave it.
std::optional<report::Window> around(const tools::Trajectory& course) {
  if (course.empty()) return std::nullopt;
  Vec2 low = course.front().T.p.head<2>();
  Vec2 high = low;
  for (const tools::StampedPose& p : course) {
    low = low.cwiseMin(p.T.p.head<2>());
    high = high.cwiseMax(p.T.p.head<2>());
  }
  const double margin_m = 5.0 + 0.1 * (high - low).maxCoeff();
  return report::Window{low.x() - margin_m, high.x() + margin_m, low.y() - margin_m,
                        high.y() + margin_m};
}

struct HeightSum {
  std::int64_t i = 0;
  std::int64_t j = 0;
  double sum_m = 0.0;
  std::int64_t n = 0;
};

constexpr std::int64_t kKeyBase = std::int64_t{1} << 31;
std::int64_t key_of(std::int64_t i, std::int64_t j) { return (j << 32) + i + kKeyBase; }

/// Sorts by row and column and adds the values of one cell in the order given.
std::vector<HeightSum> merged(std::vector<HeightSum> cells) {
  std::stable_sort(cells.begin(), cells.end(), [](const HeightSum& a, const HeightSum& b) {
    return a.j != b.j ? a.j < b.j : a.i < b.i;
  });
  std::vector<HeightSum> out;
  for (const HeightSum& cell : cells) {
    if (out.empty() || out.back().i != cell.i || out.back().j != cell.j) {
      out.push_back(cell);
    } else {
      out.back().sum_m += cell.sum_m;
      out.back().n += cell.n;
    }
  }
  return out;
}

std::vector<HeightSum> coarsened(std::vector<HeightSum> cells) {
  for (HeightSum& cell : cells) {
    cell.i >>= 1;  // rounds down, for negative indices too
    cell.j >>= 1;
  }
  return merged(std::move(cells));
}

}  // namespace

std::string_view frame_name(recording::Frame frame) {
  switch (frame) {
    case recording::Frame::kWorld:
      return "world";
    case recording::Frame::kLocal:
      return "local";
    case recording::Frame::kRolling:
      break;
  }
  return "rolling";
}

std::vector<report::Shade> outage_shades(const std::vector<TimeInterval>& outages, Stamp zero) {
  std::vector<report::Shade> out;
  out.reserve(outages.size());
  for (const TimeInterval& i : outages) {
    out.push_back({seconds(i.from - zero), seconds(i.to - zero), "no GPS"});
  }
  return out;
}

report::Plot course_plot(const tools::Trajectory& truth,
                         const std::vector<NamedTrajectory>& estimates,
                         const std::vector<TimeInterval>& outages, recording::Frame frame) {
  report::Plot plot =
      report::view_from_above("Course from above", frame == recording::Frame::kWorld, 560);
  for (std::size_t k = 0; k < estimates.size(); ++k) {
    const NamedTrajectory& estimate = estimates[k];
    plot.series.push_back(
        course_of(estimate.poses, estimate.name, colour_of_run(k),
                  k == 0 ? report::SeriesStyle::kThickLine : report::SeriesStyle::kLine));
    if (k > 0 || outages.empty()) continue;
    report::Series without = course_of(estimate.poses, estimate.name + ", GPS denied",
                                       report::Colour::kOrange, report::SeriesStyle::kThickLine);
    for (std::size_t i = 0; i < estimate.poses.size(); ++i) {
      if (!denied(outages, estimate.poses[i].stamp)) without.y[i] = kNone;
    }
    plot.series.push_back(std::move(without));
  }
  if (!truth.empty()) {
    plot.series.push_back(
        course_of(truth, "truth", report::Colour::kGrey, report::SeriesStyle::kDashed));
  }
  plot.window = around(truth);
  const tools::Trajectory* shown = !truth.empty()      ? &truth
                                   : estimates.empty() ? nullptr
                                                       : &estimates.front().poses;
  if (shown != nullptr && !shown->empty()) {
    plot.marks = {{shown->front().T.p.x(), shown->front().T.p.y(), "start"},
                  {shown->back().T.p.x(), shown->back().T.p.y(), "end"}};
  }
  return plot;
}

std::vector<report::Plot> error_plots(const WorldMetrics& metrics,
                                      const std::vector<TimeInterval>& outages, Stamp zero) {
  struct Kind {
    const char* title;
    const char* y_label;
    double (*error)(const WorldError&);
    double (*sigma)(const WorldError&);
    bool magnitude;
  };
  const Kind kinds[] = {
      {"Horizontal error", "[m]", [](const WorldError& e) { return e.horizontal_m(); },
       [](const WorldError& e) { return e.sigma_horizontal_m; }, true},
      {"Vertical error", "[m]", [](const WorldError& e) { return e.position_m.z(); },
       [](const WorldError& e) { return e.sigma_m.z(); }, false},
      {"Heading error", "[deg]", [](const WorldError& e) { return degrees(e.heading_rad); },
       [](const WorldError& e) { return degrees(e.sigma_heading_rad); }, false}};
  std::vector<report::Plot> plots;
  for (const Kind& kind : kinds) {
    report::Plot plot;
    plot.title = kind.title;
    plot.x_label = "time [s]";
    plot.y_label = kind.y_label;
    plot.height_px = 250;
    plot.y_from_zero = kind.magnitude;
    plot.shades = outage_shades(outages, zero);
    report::Series band{
        "3 sigma of WM", report::Colour::kBlue, report::SeriesStyle::kBand, {}, {}, {}};
    report::Series error{"error", report::Colour::kBlue, report::SeriesStyle::kLine, {}, {}, {}};
    for (const WorldError& e : metrics.errors) {
      const double t_s = seconds(e.stamp - zero);
      const double bound = 3.0 * kind.sigma(e);
      band.x.push_back(t_s);
      band.y.push_back(bound);
      band.y_low.push_back(kind.magnitude ? 0.0 : -bound);
      error.x.push_back(t_s);
      error.y.push_back(kind.error(e));
    }
    plot.series = {std::move(band), std::move(error)};
    plots.push_back(std::move(plot));
  }
  return plots;
}

report::Plot comparison_plot(const std::vector<std::pair<std::string, const WorldMetrics*>>& runs,
                             const std::vector<TimeInterval>& outages, Stamp zero) {
  report::Plot plot;
  plot.title = "Horizontal error of the runs";
  plot.x_label = "time [s]";
  plot.y_label = "[m] (log scale)";
  plot.log_y = true;
  plot.shades = outage_shades(outages, zero);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    report::Series s{runs[k].first, colour_of_run(k), report::SeriesStyle::kLine, {}, {}, {}};
    for (const WorldError& e : runs[k].second->errors) {
      s.x.push_back(seconds(e.stamp - zero));
      s.y.push_back(std::max(1e-3, e.horizontal_m()));
    }
    plot.series.push_back(std::move(s));
  }
  return plot;
}

report::Plot aligned_error_plot(const PosePairs& pairs, const Pose& T_truth_estimate) {
  report::Plot plot;
  plot.title = "Position error along the course, after alignment";
  plot.x_label = "distance driven [m]";
  plot.y_label = "[m]";
  plot.height_px = 250;
  plot.y_from_zero = true;
  report::Series s{
      "", report::Colour::kBlue, report::SeriesStyle::kLine, tools::distances(pairs.truth), {}, {}};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    s.y.push_back((T_truth_estimate * pairs.estimate[i].p - pairs.truth[i].p).norm());
  }
  plot.series.push_back(std::move(s));
  return plot;
}

Result<report::CellMap> read_map(const std::string& log_path, const tools::Trajectory& poses) {
  Result<LogReader> reader = LogReader::open(log_path);
  if (!reader) return reader.error();
  std::vector<HeightSum> sums;
  std::unordered_map<std::int64_t, std::size_t> index;  // of a cell in `sums`
  LogEvent event;
  points_t m{};
  while (reader->next(&event)) {
    const int size = static_cast<int>(event.data.size());
    if (event.channel != channel::kSpPoints || m.decode(event.data.data(), 0, size) != size) {
      continue;
    }
    const std::optional<Pose> T = tools::pose_at(poses, from_utime(m.utime), Duration::zero());
    if (!T) continue;
    const Mat3 R = T->rotation();
    for (std::size_t k = 0; k < m.x_m.size(); ++k) {
      const Vec3 p = R * Vec3(m.x_m[k], m.y_m[k], m.z_m[k]) + T->p;
      if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e7) continue;
      const std::int64_t i = std::llround(std::floor(p.x() / kFineCell_m));
      const std::int64_t j = std::llround(std::floor(p.y() / kFineCell_m));
      const std::size_t at = index.emplace(key_of(i, j), sums.size()).first->second;
      if (at == sums.size()) sums.push_back({i, j, 0.0, 0});
      sums[at].sum_m += p.z();
      ++sums[at].n;
    }
  }
  sums = merged(std::move(sums));
  report::CellMap map;
  map.cell = kFineCell_m;
  map.value_label = "height [m]";
  while (sums.size() > kMaxCells) {
    sums = coarsened(std::move(sums));
    map.cell *= 2.0;
  }
  std::vector<double> heights_m;
  for (const HeightSum& cell : sums) {
    const double height_m = cell.sum_m / static_cast<double>(cell.n);
    map.cells.push_back({static_cast<int>(cell.i), static_cast<int>(cell.j), height_m});
    heights_m.push_back(height_m);
  }
  if (map.cells.empty()) return Error{log_path + ": no points of SP (SP_POINTS)"};
  // A few tree tops must not dominate the colour scale.
  std::sort(heights_m.begin(), heights_m.end());
  const double low_m = tools::percentile(heights_m, 0.01);
  const double high_m = tools::percentile(heights_m, 0.99);
  for (report::CellMap::Cell& cell : map.cells) cell.value = std::clamp(cell.value, low_m, high_m);
  return map;
}

report::Plot map_plot(report::CellMap map, const tools::Trajectory& poses, recording::Frame frame) {
  report::Plot plot = report::view_from_above(
      fmt::format("Map: points of SP from above, mean height of {:g} m cells", map.cell),
      frame == recording::Frame::kWorld, 560);
  plot.map = std::move(map);
  plot.series = {course_of(poses, "course", report::Colour::kOrange, report::SeriesStyle::kLine)};
  return plot;
}

report::Plot latency_plot(const std::string& title, const std::vector<double>& values_ms) {
  constexpr int kBins = 60;
  report::Plot plot;
  plot.title = title;
  plot.x_label = "[ms]";
  plot.y_label = "cycles (log scale)";
  plot.height_px = 210;
  plot.log_y = true;
  const tools::Summary summary = tools::summarize(values_ms);
  const double width_ms = std::max(1e-3, summary.max * 1.0001 / kBins);
  report::Series bars{"", report::Colour::kBlue, report::SeriesStyle::kBars, {}, {}, {}};
  for (int k = 0; k <= kBins; ++k) {
    bars.x.push_back(k * width_ms);
    bars.y.push_back(0.0);
  }
  for (const double v : values_ms) {
    bars.y[static_cast<std::size_t>(std::clamp(v / width_ms, 0.0, kBins - 1.0))] += 1.0;
  }
  plot.series.push_back(std::move(bars));
  plot.shades = {{summary.p99, kBins * width_ms, "beyond p99"}};
  return plot;
}

std::vector<report::Plot> node_plots(const recording::RunLog& run) {
  std::vector<report::Plot> plots;
  for (const auto& [name, node] : run.nodes) {
    std::vector<double> wall_ms;
    for (const recording::CycleRecord& c : node.cycles) wall_ms.push_back(c.wall_ms);
    plots.push_back(latency_plot(name + ": wall time of a cycle (sp: a scan)", wall_ms));
  }
  return plots;
}

}  // namespace rcs::evaluation
