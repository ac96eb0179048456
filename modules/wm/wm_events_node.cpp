// The events of WM: what changed since the last cycle.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string_view>

#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/message_names.h"
#include "modules/wm/wm_messages_node.h"
#include "modules/wm/wm_node.h"

namespace rcs::wm {
namespace {

constexpr const event::Info* kSilent[] = {&event::kWmInputIns, &event::kWmInputGps,
                                          &event::kWmInputOdometry, &event::kWmInputLadar};

constexpr std::string_view kFindings[] = {
    "nothing",
    "GPS excluded: it contradicts the filter without GPS, which replaces the belief",
    "GPS readmitted: its fixes agree with the belief and the motion",
    "GPS readmitted: its fixes contradict the belief, not each other; they replace its position",
    "GPS excluded: its readmission is revoked, the filter without it replaces the belief",
    "LADAR excluded: it contradicts the filter without LADAR, which replaces the belief",
    "LADAR readmitted: its matches agree with the motion",
    "a priori map excluded: it contradicts the filter without it, which replaces the belief",
    "INS excluded: it contradicts the other sources; the filter without INS replaces the belief",
    "INS readmitted: it agrees with the other sources",
    "odometry excluded: two sources that agree contradict it; the belief continues without it",
    "odometry readmitted: its speed agrees with the belief",
    "GPS excluded: the belief has rejected its fixes; no filter without GPS tells which is wrong",
    "a priori map readmitted: its matches agree with the fixes"};

constexpr char kFaultText[] = "{}{}; test ratio {:.2f} (limit 1), belief moved by {:.2f} m";
constexpr char kReadmissionText[] = "{}; belief moved by {:.2f} m";

/// The end of an exclusion. Fixes that replace the belief reveal a fault of the filter.
bool readmits(Finding finding) {
  return finding == Finding::kGpsReadmitted || finding == Finding::kLadarReadmitted ||
         finding == Finding::kInsReadmitted || finding == Finding::kOdometryReadmitted ||
         finding == Finding::kMapReadmitted;
}

/// The text of `alert`: what each alert means, "; " between two. It allocates only beyond 500
/// characters.
class AlertText {
 public:
  template <class... Args>
  void add(fmt::format_string<Args...> text, const Args&... args) {
    if (text_.size() > 0) text_.append(std::string_view("; "));
    fmt::format_to(std::back_inserter(text_), text, args...);
  }
  void add_level(std::string_view axis, double level_m, double limit_m) {
    if (std::isfinite(level_m)) {
      add("{} alert: protection level {:.2f} m > {:.2f} m", axis, level_m, limit_m);
    } else {
      add("{} alert: no bound of the position error is known", axis);
    }
  }
  /// @param rejected  measurements in a row
  void add_source(std::string_view source, bool is_excluded, double test_ratio, int rejected,
                  std::string_view measurements) {
    if (is_excluded) {
      add("{} alert: excluded, not fused", source);
    } else if (test_ratio > 1.0) {
      add("{} alert: suspect, test ratio {:.2f} > 1", source, test_ratio);
    } else {
      add("{} alert: {} {} rejected in a row", source, rejected, measurements);
    }
  }
  [[nodiscard]] std::string_view text() const { return {text_.data(), text_.size()}; }

 private:
  fmt::memory_buffer text_;
};

}  // namespace

void WmNode::report_events(Stamp now) {
  if (!estimator_.started()) return;
  const FilterState& s = estimator_.state();
  if (const Mode newest = mode(now); newest != reported_mode_) {
    report_.publish(now, event::kWmMode, "{} -> {}",
                    nav_mode_name(static_cast<int>(reported_mode_)),
                    nav_mode_name(static_cast<int>(newest)));
    reported_mode_ = newest;
  }
  if (s.bookkeeping.world_resets != reported_resets_) {
    const double step_m = s.bookkeeping.last_reset_m;
    const double step_deg = degrees(s.bookkeeping.last_reset_rad);
    if (reported_resets_ == 0) {
      report_.publish_end(now, event::kWmWorldReset,
                          "frame world initialized: {:.2f} m and {:.2f} deg from frame local",
                          step_m, step_deg);
    } else {
      report_.publish(now, event::kWmWorldReset,
                      "world pose stepped by {:.2f} m, {:.2f} deg (limits {:.2f} m, {:.1f} deg)",
                      step_m, step_deg, config_.params.modes.reset_m,
                      degrees(config_.params.modes.reset_rad));
    }
    reported_resets_ = s.bookkeeping.world_resets;
  }
  if (estimator_.clock_steps() != reported_clock_steps_) {
    const bool taken_back = estimator_.ins_clock_shift() != reported_ins_shift_;
    report_.publish(
        now, event::kWmClockStep, "{}: the belief continues at stamp {}",
        taken_back ? "the last step was not one of all clocks" : "clocks of all sensors stepped",
        to_utime(s.belief.x.stamp));
    reported_clock_steps_ = estimator_.clock_steps();
  }
  if (estimator_.losses() != reported_losses_) {
    report_.publish(now, event::kWmSolutionLost,
                    "solution lost: no ground vehicle moves as estimated; the filter begins again "
                    "from the sources");
    reported_losses_ = estimator_.losses();
  }
  if (s.belief.x.map_epoch != reported_epoch_) {
    report_.publish(now, event::kWmMapEpoch, "rolling map replaced: map epoch {}",
                    s.belief.x.map_epoch);
    reported_epoch_ = s.belief.x.map_epoch;
  }
}

void WmNode::report_alignment(Stamp now) {
  const auto received = [&](Input input) {
    const Duration silence = inputs_.silence(input, now);
    return silence >= Duration::zero() && silence <= config_.params.modes.gps_timeout;
  };
  std::optional<Missing> missing;
  if (!estimator_.started()) {
    if (received(Input::kIns)) missing = Missing::kLevel;
  } else if (!estimator_.state().bookkeeping.georeferenced) {
    missing = received(Input::kGps) ? Missing::kHeading : Missing::kPosition;
  }
  const std::optional<Missing> report = alignment_.add(now, missing);
  if (!report) return;
  const AlignParams& align = config_.params.align;
  const double waited_s = seconds(AlignmentWatch::kPatience);
  switch (*report) {
    case Missing::kLevel:
      report_.publish(now, event::kWmAlignment,
                      "not level after {:.0f} s of INS samples: stand still for {:.1f} s, or it "
                      "levels in motion after {:.0f} s",
                      waited_s, seconds(align.level_time), seconds(align.patience));
      break;
    case Missing::kPosition:
      report_.publish(
          now, event::kWmAlignment,
          "frame world not georeferenced after {:.0f} s: no GPS fix and no match to the "
          "a priori map; only the local pose is valid",
          waited_s);
      break;
    case Missing::kHeading: {
      const bool path =
          fixes_have_velocity_ || received(Input::kOdometry) || received(Input::kLadar);
      report_.publish(now, event::kWmAlignment,
                      "frame world not georeferenced after {:.0f} s of GPS fixes: heading unknown; "
                      "drive {:.0f} m{}",
                      waited_s, align.baseline_m,
                      path ? ""
                           : " with turns or changes of speed: without velocity of GPS, wheels or "
                             "LADAR the heading follows from accelerations");
    }
  }
}

void WmNode::report_inputs(Stamp now) {
  constexpr std::string_view kNames[] = {"INS", "GPS", "odometry", "LADAR registration"};
  for (std::size_t i = 0; i < kInputs; ++i) {
    const auto input = static_cast<Input>(i);
    const bool silent = inputs_.silent(input, now);
    if (silent == reported_silent_[i]) continue;
    reported_silent_[i] = silent;
    if (silent) {
      report_.publish(now, *kSilent[i], "{} silent for {:.2f} s > {:.2f} s: not fused", kNames[i],
                      seconds(inputs_.silence(input, now)), seconds(inputs_.limit(input)));
    } else {
      report_.publish_end(now, *kSilent[i], "{} received again", kNames[i]);
    }
  }
  const bool no_input = without_input_for(now) > Duration::zero();
  if (no_input != reported_no_input_) {
    reported_no_input_ = no_input;
    if (no_input) {
      report_.publish(now, event::kWmInputNone,
                      "no input moves the belief: mode LOST, pose invalid after {:.2f} s",
                      seconds(config_.params.modes.input_timeout));
    } else {
      report_.publish_end(now, event::kWmInputNone, "inputs move the belief again");
    }
  }
  const Duration shift = estimator_.ins_clock_shift();
  if (shift == reported_ins_shift_) return;
  report_.publish(now, event::kWmClockIns,
                  "clock of the INS stepped by {:.3f} s: its stamps are shifted by "
                  "{:.3f} s",
                  seconds(reported_ins_shift_ - shift), seconds(shift));
  reported_ins_shift_ = shift;
}

void WmNode::report_source_status(Stamp now) {
  const FaultDetection& fault_detection = estimator_.fault_detection();
  if (fault_detection.findings() != reported_findings_) {
    const Finding finding = fault_detection.newest_finding();
    const bool in_part =
        finding == Finding::kInsFaulty && estimator_.state().bookkeeping.excluded.force;
    const std::string_view part = in_part ? ", only its rotation is used" : "";
    const std::string_view text = kFindings[static_cast<std::size_t>(finding)];
    if (readmits(finding)) {
      report_.publish_end(now, event::kWmFde, kReadmissionText, text,
                          fault_detection.finding_moved_m());
    } else {
      report_.publish(now, event::kWmFde, kFaultText, text, part, fault_detection.finding_ratio(),
                      fault_detection.finding_moved_m());
    }
    reported_findings_ = fault_detection.findings();
  }
  const TileStatus& tile = estimator_.state().bookkeeping.newest_tile;
  if (tile.suspected != reported_map_suspected_) {
    if (tile.suspected) {
      report_.publish(
          now, event::kWmPriorMapExcluded,
          "tile {} of the a priori map excluded: low-passed NIS per dof {:.2f} > {:.2f}; its "
          "matches are not fused",
          tile.tile_id, tile.excess, TileStatus::kExcludedAbove);
    } else {
      report_.publish(
          now, event::kWmPriorMapReadmitted,
          "tile {} of the a priori map readmitted: low-passed NIS per dof {:.2f} (limit {:.2f}); "
          "its matches are fused",
          tile.tile_id, tile.excess, TileStatus::kReadmittedBelow);
    }
    reported_map_suspected_ = tile.suspected;
  }
  report_alerts(now);
}

void WmNode::report_alerts(Stamp now) {
  if (integrity_.alerts == reported_alerts_) return;
  reported_alerts_ = integrity_.alerts;
  if (integrity_.alerts == 0) {
    report_.publish_end(now, event::kWmAlert, "alerts ended");
    return;
  }
  const auto raised = [&](Alert alert) { return (integrity_.alerts & alert) != 0; };
  const FilterState& s = estimator_.state();
  const FaultDetection& fault_detection = estimator_.fault_detection();
  const ModeParams& modes = config_.params.modes;
  AlertText text;
  if (raised(kAlertHorizontal)) {
    text.add_level("horizontal", integrity_.protection_horizontal_m, integrity_.limit_horizontal_m);
  }
  if (raised(kAlertVertical)) {
    text.add_level("vertical", integrity_.protection_vertical_m, integrity_.limit_vertical_m);
  }
  if (raised(kAlertInput)) text.add("input alert: no sensor is received");
  const Duration untested = fault_detection.untested_for(s.belief.x.stamp);
  const bool tested = excluded(fault_detection.ins(s)) || fault_detection.ins_test_ratio() > 1.0;
  if (raised(kAlertIns) && !tested && untested > Duration::zero()) {
    text.add("INS alert: its gaps prevent the tests of all sources");
  } else if (raised(kAlertIns)) {
    text.add_source("INS", excluded(fault_detection.ins(s)), fault_detection.ins_test_ratio(), 0,
                    "increments");
  }
  if (raised(kAlertGps)) {
    const int fixes = s.bookkeeping.of(Source::kGpsPosition).refused;
    const int heights = s.bookkeeping.heights_refused;
    text.add_source("GPS", excluded(fault_detection.gps(s, modes)),
                    fault_detection.gps_test_ratio(), std::max(fixes, heights),
                    fixes < heights ? "heights of fixes" : "fixes");
  }
  if (raised(kAlertLadar)) {
    text.add_source("LADAR", excluded(fault_detection.ladar(s, modes)),
                    fault_detection.ladar_test_ratio(), s.bookkeeping.of(Source::kRolling).refused,
                    "matches");
  }
  if (raised(kAlertOdometry)) text.add("odometry alert: excluded, not fused");
  report_.publish(now, event::kWmAlert, "{}", text.text());
}

}  // namespace rcs::wm
