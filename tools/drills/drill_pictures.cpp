#include "tools/drills/drill_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "tools/drills/drill_baselines.h"
#include "tools/drills/drill_metrics.h"

namespace rcs::drills {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kLead_s = 10.0;
/// Lower end of the error scale.
constexpr double kMinError_m = 0.01;
constexpr report::Colour kSubfilterColours[kSubfilterKinds] = {
    report::Colour::kGrey, report::Colour::kGreen, report::Colour::kPurple};

std::string subfilter_label(int kind) {
  return kind == 0 ? "inertial alone" : std::string(subfilter_name(kind));
}

double first_s(const Drill& drill) { return std::max(0.0, drill.begin_s() - kLead_s); }
double last_s(const DrillRecord& record, const DrillErrors& errors) {
  return errors.time_s(record.end);
}

std::vector<report::Shade> stimulus_shades(const Drill& drill, double end_s) {
  std::vector<report::Shade> shades;
  for (const Stimulus& s : drill.stimuli) {
    shades.push_back({s.begin_s, std::min(s.end_s(), end_s), describe(s)});
  }
  return shades;
}

report::Series series(std::string label, report::Colour colour, report::SeriesStyle style) {
  return {std::move(label), colour, style, {}, {}, {}};
}

void add(double x, double y, report::Series* s) {
  s->x.push_back(x);
  s->y.push_back(y);
}

/// The positions of a sub-filter, with a gap where it was restarted from the filter.
report::Series subfilter_course(const DrillRecord& record, const DrillErrors& errors, int kind,
                                double from_s) {
  report::Series s =
      series(subfilter_label(kind), kSubfilterColours[kind], report::SeriesStyle::kLine);
  std::optional<Stamp> branch;
  for (const DrillSubfilter& subfilter : record.subfilters) {
    if (subfilter.kind != kind || errors.time_s(subfilter.stamp) < from_s) continue;
    if (branch && *branch != subfilter.branch) add(kNone, kNone, &s);
    branch = subfilter.branch;
    add(subfilter.T_world_vehicle.p.x(), subfilter.T_world_vehicle.p.y(), &s);
  }
  return s;
}

/// Errors of the sub-filters over time.
report::Series subfilter_errors(const DrillRecord& record, const DrillErrors& errors, int kind,
                                double from_s,
                                const std::function<double(const Vec3&)>& magnitude) {
  report::Series s =
      series(subfilter_label(kind), kSubfilterColours[kind], report::SeriesStyle::kLine);
  std::optional<Stamp> branch;
  for (const DrillSubfilter& subfilter : record.subfilters) {
    const double t_s = errors.time_s(subfilter.stamp);
    const std::optional<Pose> truth = errors.truth_at(subfilter.stamp);
    if (subfilter.kind != kind || t_s < from_s || !truth) continue;
    if (branch && *branch != subfilter.branch) add(t_s, kNone, &s);
    branch = subfilter.branch;
    add(t_s, std::max(kMinError_m, magnitude(subfilter.T_world_vehicle.p - truth->p)), &s);
  }
  return s;
}

/// Intervals of time with a constant value, drawn as horizontal lines.
class Lane {
 public:
  /// @param series  by colour
  Lane(double y, std::map<report::Colour, report::Series>* series) : y_(y), series_(series) {}

  /// @param colour  none: nothing is drawn
  void at(double t_s, std::optional<report::Colour> colour) {
    constexpr double kGap_s = 1.0;
    const bool gap = t_s - last_s_ > kGap_s;
    if (since_ && (colour != colour_ || gap)) close(gap ? last_s_ : t_s);
    if (!since_) since_ = t_s;
    colour_ = colour;
    last_s_ = t_s;
  }
  void end() {
    if (since_) close(last_s_);
  }

 private:
  void close(double to_s) {
    if (colour_) {
      report::Series* s = &series_->at(*colour_);
      add(*since_, y_, s);
      add(to_s, y_, s);
      add(to_s, kNone, s);
    }
    since_.reset();
  }

  double y_;
  std::map<report::Colour, report::Series>* series_;
  std::optional<double> since_;
  std::optional<report::Colour> colour_;
  double last_s_ = 0.0;
};

report::Colour colour_of_mode(int mode) {
  switch (mode) {
    case nav_state_t::MODE_GPS_INS:
    case nav_state_t::MODE_GPS_INS_LADAR:
    case nav_state_t::MODE_GPS_LADAR:
      return report::Colour::kBlue;
    case nav_state_t::MODE_INS_LADAR:
    case nav_state_t::MODE_LADAR:
      return report::Colour::kGreen;
    default:
      return report::Colour::kOrange;
  }
}

std::optional<report::Colour> colour_of_status(int status) {
  switch (status) {
    case integrity_t::STATUS_ACCEPTED:
    case integrity_t::STATUS_SUSPECT:
      return report::Colour::kBlue;
    case integrity_t::STATUS_QUARANTINE:
    case integrity_t::STATUS_READMITTING:
      return report::Colour::kOrange;
    case integrity_t::STATUS_PROBATION:
      return report::Colour::kPurple;
    default:
      return std::nullopt;
  }
}

}  // namespace

report::Plot drill_course(const Drill& drill, const DrillRecord& record) {
  const DrillErrors errors(record);
  const double from_s = first_s(drill);
  report::Plot plot = report::view_from_above(drill.id + ": from above", true, 460);
  report::Series fused = series("WM", report::Colour::kBlue, report::SeriesStyle::kThickLine);
  report::Series disturbed =
      series("WM, disturbed", report::Colour::kOrange, report::SeriesStyle::kThickLine);
  report::Series truth = series("truth", report::Colour::kGrey, report::SeriesStyle::kDashed);
  for (double t_s = from_s; t_s < last_s(record, errors); t_s += 0.25) {
    const Stamp stamp = errors.stamp_at(t_s);
    if (const std::optional<Pose> T = errors.truth_at(stamp)) add(T->p.x(), T->p.y(), &truth);
    const DrillBelief* b = errors.belief_at(stamp);
    if (b == nullptr) continue;
    const Vec3& p = b->T_world_vehicle.p;
    const bool stimulus = std::any_of(drill.stimuli.begin(), drill.stimuli.end(),
                                      [t_s](const Stimulus& s) { return s.holds(t_s); });
    add(p.x(), p.y(), &fused);
    add(p.x(), stimulus ? p.y() : kNone, &disturbed);
  }
  plot.series = {std::move(fused), std::move(disturbed)};
  for (int k = 0; k < kSubfilterKinds; ++k) {
    report::Series s = subfilter_course(record, errors, k, from_s);
    if (!s.x.empty()) plot.series.push_back(std::move(s));
  }
  if (!truth.x.empty()) {
    plot.marks = {{truth.x.front(), truth.y.front(), fmt::format("{:.0f} s", from_s)},
                  {truth.x.back(), truth.y.back(), "end"}};
  }
  plot.series.push_back(std::move(truth));
  return plot;
}

std::vector<report::Plot> drill_error_plots(const Drill& drill, const DrillRecord& record) {
  struct Kind {
    const char* title;
    std::function<double(const Vec3&)> magnitude;
    double DrillIntegrity::*protection;
  };
  const Kind kinds[] = {{"horizontal error", [](const Vec3& e) { return e.head<2>().norm(); },
                         &DrillIntegrity::horizontal_m},
                        {"vertical error", [](const Vec3& e) { return std::abs(e.z()); },
                         &DrillIntegrity::vertical_m}};
  const DrillErrors errors(record);
  const double from_s = first_s(drill);
  const std::vector<DrillError> sampled = errors.sampled();
  std::vector<report::Plot> plots;
  for (const Kind& kind : kinds) {
    report::Plot plot;
    plot.title = drill.id + ": " + kind.title;
    plot.x_label = "time [s]";
    plot.y_label = "[m] (log scale)";
    plot.height_px = 260;
    plot.log_y = true;
    plot.shades = stimulus_shades(drill, last_s(record, errors));
    report::Series wm = series("WM", report::Colour::kBlue, report::SeriesStyle::kThickLine);
    for (const DrillError& e : sampled) {
      if (e.t_s < from_s) continue;
      add(e.t_s, std::max(kMinError_m, kind.magnitude(e.position_m)), &wm);
    }
    report::Series level =
        series("protection level", report::Colour::kOrange, report::SeriesStyle::kDashed);
    for (const DrillIntegrity& i : record.integrity) {
      const double protection_m = i.*kind.protection;
      if (errors.time_s(i.stamp) < from_s || !std::isfinite(protection_m)) continue;
      add(errors.time_s(i.stamp), protection_m, &level);
    }
    for (int k = 0; k < kSubfilterKinds; ++k) {
      report::Series s = subfilter_errors(record, errors, k, from_s, kind.magnitude);
      if (!s.x.empty()) plot.series.push_back(std::move(s));
    }
    plot.series.push_back(std::move(wm));
    if (!level.x.empty()) plot.series.push_back(std::move(level));
    plots.push_back(std::move(plot));
  }
  return plots;
}

report::Plot drill_time_line(const Drill& drill, const DrillRecord& record) {
  // Lanes from the bottom, in the order of y_names.
  constexpr double kEvents = 0.0;
  constexpr double kAlerts = 1.0;
  constexpr double kLadar = 2.0;
  constexpr double kGps = 3.0;
  constexpr double kFixes = 4.0;
  constexpr double kMode = 5.0;
  const DrillErrors errors(record);
  const double from_s = first_s(drill);
  const double to_s = last_s(record, errors);
  report::Plot plot;
  plot.title = drill.id + ": status of WM and its sources";
  plot.x_label = "time [s]";
  plot.height_px = 270;
  plot.y_names = {"events", "alerts", "LADAR", "GPS", "fixes", "mode"};
  plot.window = report::Window{from_s, to_s, -0.6, kMode + 0.6};
  plot.shades = stimulus_shades(drill, to_s);
  std::map<report::Colour, report::Series> lines;
  for (const auto& [colour, label] : std::initializer_list<std::pair<report::Colour, const char*>>{
           {report::Colour::kBlue, "fused, accepted, with GPS"},
           {report::Colour::kGreen, "without GPS"},
           {report::Colour::kPurple, "probation"},
           {report::Colour::kOrange, "rejected, quarantine, alert, dead reckoning"}}) {
    lines.emplace(colour, series(label, colour, report::SeriesStyle::kThickLine));
  }

  Lane mode(kMode, &lines);
  for (const DrillBelief& b : record.beliefs) {
    if (errors.time_s(b.stamp) >= from_s) mode.at(errors.time_s(b.stamp), colour_of_mode(b.mode));
  }
  mode.end();
  Lane gps(kGps, &lines);
  Lane ladar(kLadar, &lines);
  Lane alerts(kAlerts, &lines);
  for (const DrillIntegrity& i : record.integrity) {
    const double t_s = errors.time_s(i.stamp);
    if (t_s < from_s) continue;
    gps.at(t_s, colour_of_status(i.gps));
    ladar.at(t_s, colour_of_status(i.ladar));
    alerts.at(t_s, i.alerts == 0 ? std::nullopt : std::optional(report::Colour::kOrange));
  }
  gps.end();
  ladar.end();
  alerts.end();

  report::Series taken = series("", report::Colour::kBlue, report::SeriesStyle::kDots);
  report::Series refused = series("", report::Colour::kOrange, report::SeriesStyle::kDots);
  for (const DrillInnovation& i : record.innovations) {
    const double t_s = errors.time_s(i.stamp);
    if (i.source != innovation_t::SOURCE_GPS_POSITION || t_s < from_s) continue;
    add(t_s, kFixes + (i.accepted ? 0.15 : -0.15), i.accepted ? &taken : &refused);
  }
  report::Series told = series("", report::Colour::kGrey, report::SeriesStyle::kDots);
  for (const DrillEvent& e : record.events) {
    if (errors.time_s(e.time) >= from_s) add(errors.time_s(e.time), kEvents, &told);
  }
  for (auto& [colour, line] : lines) plot.series.push_back(std::move(line));
  plot.series.push_back(std::move(taken));
  plot.series.push_back(std::move(refused));
  plot.series.push_back(std::move(told));
  return plot;
}

}  // namespace rcs::drills
