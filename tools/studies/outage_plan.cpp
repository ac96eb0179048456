#include "tools/studies/outage_plan.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::studies {
namespace {

/// Time after an outage for the readmission of GPS.
constexpr double kAfter_s = 10.0;
/// The part of it that the drive must still cover: one or two fixes.
constexpr double kMin_s = 0.5;

OutagePlan plan(const OutageQuestion& question, OutagePlan::Kind kind, std::size_t variant,
                const drills::DrillWindow& window) {
  OutagePlan p{kind, variant, window, {}};
  const std::string what =
      kind == OutagePlan::Kind::kWmWithGps ? "with_gps"
      : kind == OutagePlan::Kind::kNoGps
          ? "no_gps"
          : fmt::format("gps_cut_{:g}s_at_{:.1f}s", window.length_s(), window.begin_s);
  p.drill.id = variant == 0 ? what : fmt::format("{}_without_{}", what, variant);
  if (kind == OutagePlan::Kind::kOutage) {
    p.drill.stimuli.push_back(
        drills::dropout(drills::DrillSource::kGps, window.begin_s, window.length_s()));
    if (!question.cut) p.drill.run.length_s = window.end_s + kAfter_s;
  }
  if (kind == OutagePlan::Kind::kNoGps) {
    p.drill.stimuli.push_back(drills::dropout(drills::DrillSource::kGps, 0.0, drills::kForGood_s));
  }
  if (variant > 0) {
    for (const drills::DrillSource source : question.without[variant - 1]) {
      p.drill.stimuli.push_back(drills::dropout(source, 0.0, drills::kForGood_s));
    }
  }
  return p;
}

Result<std::vector<drills::DrillWindow>> windows_of(const OutageQuestion& question,
                                                    double drive_s) {
  if (question.cut) {
    if (question.cut->end_s <= drive_s) return std::vector<drills::DrillWindow>{*question.cut};
    return Error{fmt::format("the cut ends at {:g} s, but the drive at {:.1f} s",
                             question.cut->end_s, drive_s)};
  }
  std::vector<drills::DrillWindow> windows;
  for (const double length_s : question.lengths_s) {
    const double last_s = drive_s - kMin_s - length_s;
    if (last_s < question.from_s) {
      return Error{
          fmt::format("the drive is {:.1f} s long: an outage of {:g} s after {:g} s does not fit "
                      "(see --length, --from)",
                      drive_s, length_s, question.from_s)};
    }
    for (int k = 0; k < question.places; ++k) {
      const double share =
          question.places == 1 ? 0.0 : static_cast<double>(k) / (question.places - 1);
      const double begin_s = question.from_s + share * (last_s - question.from_s);
      windows.push_back({begin_s, begin_s + length_s});
    }
  }
  return windows;
}

bool has(const std::vector<drills::DrillSource>& sources, drills::DrillSource source) {
  return std::find(sources.begin(), sources.end(), source) != sources.end();
}

}  // namespace

bool OutageQuestion::uses(std::size_t variant, drills::DrillSource source) const {
  return variant == 0 || !has(without[variant - 1], source);
}

Result<std::vector<drills::DrillSource>> parse_without(const std::string& text) {
  std::vector<drills::DrillSource> sources;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t to = std::min(text.find('+', from), text.size());
    const std::string name = text.substr(from, to - from);
    bool known = false;
    for (const drills::DrillSource s :
         {drills::DrillSource::kOdometry, drills::DrillSource::kLadar, drills::DrillSource::kIns}) {
      if (name != drills::source_name(s)) continue;
      known = true;
      if (!has(sources, s)) sources.push_back(s);
    }
    if (!known) return Error{"'" + text + "': expected odometry, ladar, ins, joined by +"};
    from = to + 1;
  }
  return sources;
}

Result<std::vector<OutagePlan>> plan_outages(const OutageQuestion& question, double drive_s,
                                             bool ladar) {
  const Result<std::vector<drills::DrillWindow>> windows = windows_of(question, drive_s);
  if (!windows) return windows.error();
  std::vector<OutagePlan> plans;
  for (std::size_t v = 0; v <= question.without.size(); ++v) {
    plans.push_back(plan(question, OutagePlan::Kind::kWmWithGps, v, {}));
    for (const drills::DrillWindow& window : *windows) {
      plans.push_back(plan(question, OutagePlan::Kind::kOutage, v, window));
    }
  }
  if (ladar) plans.push_back(plan(question, OutagePlan::Kind::kNoGps, 0, {}));
  return plans;
}

}  // namespace rcs::studies
