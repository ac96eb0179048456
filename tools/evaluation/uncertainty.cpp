#include "tools/evaluation/uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tools/evaluation/metrics.h"

namespace rcs::evaluation {
namespace {

using report::Colour;
using report::SeriesStyle;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kMin_m = 1e-3;  // of a logarithmic axis
constexpr Duration kPeriod = std::chrono::milliseconds(100);
/// Longer silences interrupt a line.
constexpr Duration kGap = std::chrono::milliseconds(1000);

report::Series series(const char* label, Colour colour, SeriesStyle style) {
  return {label, colour, style, {}, {}, {}};
}

/// Adds a value over time; a silence and a value that is not finite interrupt the line.
class TimeLine {
 public:
  TimeLine(report::Series* series, Stamp zero) : series_(series), zero_(zero) {}

  void add(Stamp stamp, double value) {
    if (last_ && stamp - *last_ > kGap) push(stamp, kNone);
    push(stamp, value);
    last_ = stamp;
  }

 private:
  void push(Stamp stamp, double value) {
    series_->x.push_back(seconds(stamp - zero_));
    series_->y.push_back(value);
  }

  report::Series* series_;
  Stamp zero_;
  std::optional<Stamp> last_;
};

bool has_value(const report::Series& s) {
  return std::any_of(s.y.begin(), s.y.end(), [](double v) { return std::isfinite(v); });
}

/// 3 sigma at 10 Hz, interrupted where the world pose is invalid.
report::Series sigma_line(const recording::RunLog& run, Stamp zero,
                          double (*sigma)(const WorldSigma&)) {
  report::Series s = series("3 sigma of WM", Colour::kBlue, SeriesStyle::kLine);
  TimeLine line(&s, zero);
  Stamp due = Stamp::min();
  for (const recording::NavRecord& nav : run.nav) {
    if (nav.stamp < due) continue;
    due = nav.stamp + kPeriod;
    line.add(nav.stamp, nav.world_valid ? 3.0 * sigma(world_sigma(nav.T_world_vehicle.rotation(),
                                                                  nav.cov_world_pose))
                                        : kNone);
  }
  return s;
}

report::Plot over_time(const char* title, const char* y_label,
                       const std::vector<TimeInterval>& outages, Stamp zero) {
  report::Plot plot;
  plot.title = title;
  plot.x_label = "time [s]";
  plot.y_label = y_label;
  plot.height_px = 260;
  plot.shades = outage_shades(outages, zero);
  return plot;
}

/// One axis of the position.
struct Kind {
  const char* title;
  double ProtectionRecord::*level;
  double ProtectionRecord::*limit;
  double (*sigma)(const WorldSigma&);
  double (*error)(const WorldError&);
};

report::Plot position_plot(const Kind& kind, const recording::RunLog& run, const RunTrace& trace,
                           const WorldMetrics* world, const std::vector<TimeInterval>& outages,
                           Stamp zero) {
  report::Plot plot = over_time(kind.title, "[m] (log scale)", outages, zero);
  plot.log_y = true;
  report::Series level = series("protection level", Colour::kOrange, SeriesStyle::kThickLine);
  report::Series limit = series("alert limit", Colour::kGrey, SeriesStyle::kDashed);
  TimeLine level_line(&level, zero);
  TimeLine limit_line(&limit, zero);
  for (const ProtectionRecord& r : trace.protection) {
    level_line.add(r.stamp, r.*kind.level);
    limit_line.add(r.stamp, r.*kind.limit);
  }
  report::Series error = series("error", Colour::kPurple, SeriesStyle::kLine);
  if (world != nullptr) {
    TimeLine error_line(&error, zero);
    for (const WorldError& e : world->errors) {
      error_line.add(e.stamp, std::max(kMin_m, kind.error(e)));
    }
  }
  for (report::Series* s : {&level, &limit, &error}) {
    if (has_value(*s)) plot.series.push_back(std::move(*s));
  }
  report::Series sigma = sigma_line(run, zero, kind.sigma);
  if (has_value(sigma)) plot.series.push_back(std::move(sigma));
  return plot;
}

}  // namespace

UncertaintyMetrics uncertainty_at_end(const recording::RunLog& run, const RunTrace& trace,
                                      const TimeInterval& interval) {
  UncertaintyMetrics m{kNone, kNone};
  for (const recording::NavRecord& nav : run.nav) {
    if (!interval.contains(nav.stamp)) continue;
    m.sigma_horizontal_m =
        nav.world_valid
            ? world_sigma(nav.T_world_vehicle.rotation(), nav.cov_world_pose).horizontal_m
            : kNone;
  }
  for (const ProtectionRecord& r : trace.protection) {
    if (interval.contains(r.stamp)) m.protection_horizontal_m = r.horizontal_m;
  }
  return m;
}

double distance_driven_m(const recording::RunLog& run, const TimeInterval& interval) {
  double driven_m = 0.0;
  const recording::NavRecord* last = nullptr;
  for (const recording::NavRecord& nav : run.nav) {
    if (!interval.contains(nav.stamp)) continue;
    if (last != nullptr && nav.stamp - last->stamp < kPeriod) continue;
    if (last != nullptr) driven_m += (nav.T_local_vehicle.p - last->T_local_vehicle.p).norm();
    last = &nav;
  }
  return driven_m;
}

std::vector<report::Plot> uncertainty_plots(const recording::RunLog& run, const RunTrace& trace,
                                            const WorldMetrics* world,
                                            const std::vector<TimeInterval>& outages, Stamp zero) {
  const Kind kinds[] = {
      {"Horizontal position: bounds", &ProtectionRecord::horizontal_m,
       &ProtectionRecord::limit_horizontal_m, [](const WorldSigma& s) { return s.horizontal_m; },
       [](const WorldError& e) { return e.horizontal_m(); }},
      {"Height: bounds", &ProtectionRecord::vertical_m, &ProtectionRecord::limit_vertical_m,
       [](const WorldSigma& s) { return s.position_m.z(); },
       [](const WorldError& e) { return std::abs(e.position_m.z()); }}};
  std::vector<report::Plot> plots;
  for (const Kind& kind : kinds) {
    report::Plot plot = position_plot(kind, run, trace, world, outages, zero);
    if (!plot.series.empty()) plots.push_back(std::move(plot));
  }
  if (world != nullptr) return plots;
  report::Series heading =
      sigma_line(run, zero, [](const WorldSigma& s) { return degrees(s.heading_rad); });
  if (!has_value(heading)) return plots;
  report::Plot plot = over_time("Heading: 3 sigma", "[deg]", outages, zero);
  plot.y_from_zero = true;
  plot.series.push_back(std::move(heading));
  plots.push_back(std::move(plot));
  return plots;
}

report::Plot speed_plot(const RunTrace& trace, const std::vector<TimeInterval>& outages,
                        Stamp zero) {
  report::Plot plot = over_time("Speed of WM", "[m/s]", outages, zero);
  plot.height_px = 210;
  plot.y_from_zero = true;
  report::Series speed = series("speed", Colour::kBlue, SeriesStyle::kLine);
  TimeLine line(&speed, zero);
  for (const SpeedRecord& r : trace.speed) line.add(r.stamp, r.speed_mps);
  plot.series.push_back(std::move(speed));
  return plot;
}

const char* uncertainty_text() {
  return "Protection level: bound that the position error exceeds with a probability of 0.001, "
         "published by WM; the line is interrupted where no bound is known. Alert limit: an alert "
         "is raised while the level exceeds it. 3 sigma: three of the standard deviations that WM "
         "published, horizontally in the worst direction.";
}

}  // namespace rcs::evaluation
