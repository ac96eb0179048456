#pragma once
// Specification of a drill: stimuli that disturb the sensor messages of a drive, and limits for the
// result. One TOML file per drill (config/drills/*/*.toml).

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/result.h"

namespace rcs::drills {

/// Sources whose messages are changed.
enum class DrillSource { kGps, kLadar, kIns, kOdometry, kAll };

/// A stimulus as long as this lasts to the end of every drive.
constexpr double kForGood_s = 1e5;

enum class StimulusKind {
  kDropout,      ///< nothing arrives
  kFlapping,     ///< on_s with, off_s without, repeatedly
  kOffset,       ///< gps: fixes with a consistent offset
  kRamp,         ///< gps: fixes with an increasing offset
  kHeight,       ///< gps: fixes higher by height_m
  kSigma,        ///< gps: the reported sigma is overwritten
  kFrozen,       ///< the first content of the window repeatedly, with new stamps
  kStale,        ///< gps: stamps older than the measurements
  kNullIsland,   ///< gps: 0 N, 0 E
  kNan,          ///< gps: not finite
  kEmptyFacets,  ///< ladar: a share of the facets has no returns
  kDust,         ///< ladar: a share of the cells has returns between 2 and 6 m
  kClock,        ///< stamps jump by jump_s
  kDelay,        ///< arrives later by delay_ms
  kReorder,      ///< every second message arrives after its successor
  kRepeat,       ///< every message arrives again after delay_ms
  kZero,         ///< ins, odometry: all values are zero
  kBias,         ///< ins, odometry, ladar ranges: a constant error, reached linearly in rise_s
  kScale,        ///< ins, odometry, ladar ranges: multiplied by a factor
  kNoise,        ///< additional white noise of each message
  kSaturate,     ///< ins: limited to a range
  kAxes,         ///< ins: axes exchanged or inverted
  kMount         ///< ladar: the mount is turned against its encoder, in rise_s
};

/// An interval of a drive. Times are relative to the first sensor message.
struct DrillWindow {
  double begin_s = 0.0;
  double end_s = 0.0;

  [[nodiscard]] bool contains(double t_s) const { return t_s >= begin_s && t_s < end_s; }
  [[nodiscard]] double length_s() const { return end_s - begin_s; }
};

/// A window of time and its stimulus. Times are relative to the first sensor message.
struct Stimulus {
  StimulusKind kind = StimulusKind::kDropout;
  DrillSource source = DrillSource::kGps;
  double begin_s = 0.0;
  double length_s = 0.0;  ///< flapping: on_s + off_s, count times

  double on_s = 1.0;          ///< flapping
  double off_s = 4.0;         ///< flapping
  int count = 0;              ///< flapping: cycles; offset: fixes, 0: the whole window
  double offset_m = 0.0;      ///< offset
  double bearing_rad = 0.0;   ///< offset and ramp: clockwise from north
  double decay_s = 0.0;       ///< offset: time of the linear decay to 0; 0: no decay
  double rate_mps = 0.0;      ///< ramp
  bool with_velocity = true;  ///< ramp: the velocity of the fixes includes the drift
  double height_m = 0.0;      ///< height
  double sigma_m = 0.0;       ///< sigma, all axes
  double age_s = 0.0;         ///< stale
  double share = 0.0;         ///< empty facets and dust
  double jump_s = 0.0;        ///< clock
  double delay_ms = 0.0;      ///< delay and repeat
  // Errors of the content: of bias the value, of noise the standard deviation, of saturate the
  // limit.
  Vec3 gyro_radps = Vec3::Zero();    ///< ins, vehicle axes
  Vec3 accel_mps2 = Vec3::Zero();    ///< ins, vehicle axes
  double speed_mps = 0.0;            ///< odometry
  double yaw_rate_radps = 0.0;       ///< odometry
  double range_m = 0.0;              ///< ladar
  double position_m = 0.0;           ///< gps, noise of each axis
  double factor = 1.0;               ///< scale: odometry and ladar
  double gyro_factor = 1.0;          ///< scale: ins
  double accel_factor = 1.0;         ///< scale: ins
  double tilt_rad = 0.0;             ///< mount, positive up
  double pan_rad = 0.0;              ///< mount, positive left
  double rise_s = 0.0;               ///< bias, scale and mount: time to reach the full error
  std::array<int, 3> axes{1, 2, 3};  ///< axes: +-(1 + index of the axis that is published)

  [[nodiscard]] double end_s() const { return begin_s + length_s; }
  [[nodiscard]] bool holds(double time_s) const { return time_s >= begin_s && time_s < end_s(); }
  /// True if the changed messages are false.
  [[nodiscard]] bool corrupts() const {
    return kind != StimulusKind::kDropout && kind != StimulusKind::kFlapping &&
           kind != StimulusKind::kEmptyFacets;
  }
};

[[nodiscard]] Stimulus dropout(DrillSource source, double begin_s, double length_s);

/// Conditions of the run.
struct DrillRun {
  double length_s = 0.0;            ///< of the drive; 0: all of it
  std::string scenario;             ///< path; empty: that of the command line
  std::string ins;                  ///< INS grade of the simulator and of WM; empty: as configured
  bool prior_map = false;           ///< simulator: use the a priori map of the course
  double map_cell_m = 0.0;          ///< of the map; 0: as in the scenario
  Vec3 map_shift_m = Vec3::Zero();  ///< error of the map, east north up
  double map_turn_rad = 0.0;        ///< rotation of the map about the start of the vehicle
  double grant_share = 1.0;         ///< share of the work units granted to SP
  int ladar_rows = 0;               ///< of the scenario's LADAR; 0: as configured
  int ladar_cols = 0;
};

/// Limits by the name of the metric: see kLimits in drill_limits.h.
using DrillLimits = std::map<std::string, double, std::less<>>;

struct Drill {
  std::string id;     ///< file name without .toml
  std::string name;   ///< title in reports
  std::string about;  ///< description
  bool needs_simulator = false;
  bool full = false;  ///< only with --full
  int seeds = 1;
  int seeds_full = 20;               ///< with --full
  std::optional<std::int64_t> seed;  ///< of the first run; nullopt: that of the campaign
  DrillRun run;
  std::vector<Stimulus> stimuli;
  DrillLimits limits;

  /// Begin of the evaluation: the first stimulus, or 20 s without stimuli.
  [[nodiscard]] double begin_s() const;
  /// End of the last stimulus; kForGood_s if a stimulus does not end, or without stimuli.
  [[nodiscard]] double end_s() const;
};

[[nodiscard]] Result<Drill> load_drill(const std::string& path);
/// @param path  file name for messages; paths in the drill are relative to it
[[nodiscard]] Result<Drill> parse_drill(std::string_view text, const std::string& path);

/// The name of the kind in the file.
[[nodiscard]] std::string_view kind_name(StimulusKind kind);
[[nodiscard]] std::string_view source_name(DrillSource source);
/// A stimulus in a few words: "gps dropout 35-95 s".
[[nodiscard]] std::string describe(const Stimulus& s);

}  // namespace rcs::drills
