#pragma once
// What a drill is: what is done to the sensors' messages of a drive, and what must hold all the
// same. One TOML file a drill (config/drills/*/*.toml).

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/result.h"

namespace rcs::drills {

/// Whose messages are changed.
enum class DrillSource { kGps, kLadar, kIns, kOdometry, kAll };

/// A stimulus as long as this lasts to the end of every drive.
constexpr double kForGood_s = 1e5;

enum class StimulusKind {
  kDropout,      ///< nothing arrives
  kFlapping,     ///< on_s with, off_s without, again and again
  kOffset,       ///< gps: fixes consistently elsewhere
  kRamp,         ///< gps: fixes walk away
  kHeight,       ///< gps: fixes higher by height_m
  kSigma,        ///< gps: the reported sigma is overwritten
  kFrozen,       ///< gps: the first fix of the window again and again, with new stamps
  kStale,        ///< gps: stamps older than what they stamp
  kNullIsland,   ///< gps: 0 N, 0 E
  kNan,          ///< gps: no numbers
  kEmptyFacets,  ///< ladar: a share of the facets comes without returns
  kDust,         ///< ladar: a share of the cells returns something between 2 and 6 m
  kClock,        ///< stamps jump by jump_s
  kDelay,        ///< arrives later by delay_ms
  kReorder,      ///< every second message arrives after its successor
  kRepeat        ///< every message arrives once more after delay_ms
};

/// A stretch of a drive. Times count from the first sensor message.
struct DrillWindow {
  double begin_s = 0.0;
  double end_s = 0.0;

  [[nodiscard]] bool contains(double t_s) const { return t_s >= begin_s && t_s < end_s; }
  [[nodiscard]] double length_s() const { return end_s - begin_s; }
};

/// A window of time and what happens in it. Times count from the first sensor message.
struct Stimulus {
  StimulusKind kind = StimulusKind::kDropout;
  DrillSource source = DrillSource::kGps;
  double begin_s = 0.0;
  double length_s = 0.0;  ///< flapping: on_s + off_s, count times

  double on_s = 1.0;          ///< flapping
  double off_s = 4.0;         ///< flapping
  int count = 0;              ///< flapping: how often; offset: of fixes, 0: the window
  double offset_m = 0.0;      ///< offset
  double bearing_rad = 0.0;   ///< offset and ramp: clockwise from north
  double decay_s = 0.0;       ///< offset: falls linearly to nothing within; 0: it stays
  double rate_mps = 0.0;      ///< ramp
  bool with_velocity = true;  ///< ramp: the fixes' velocity tells of it, too
  double height_m = 0.0;      ///< height
  double sigma_m = 0.0;       ///< sigma, all axes
  double age_s = 0.0;         ///< stale
  double share = 0.0;         ///< empty facets and dust
  double jump_s = 0.0;        ///< clock
  double delay_ms = 0.0;      ///< delay and repeat

  [[nodiscard]] double end_s() const { return begin_s + length_s; }
  [[nodiscard]] bool holds(double time_s) const { return time_s >= begin_s && time_s < end_s(); }
  /// Changes messages so that they say what is not true.
  [[nodiscard]] bool corrupts() const {
    return kind != StimulusKind::kDropout && kind != StimulusKind::kFlapping &&
           kind != StimulusKind::kEmptyFacets;
  }
};

[[nodiscard]] Stimulus dropout(DrillSource source, double begin_s, double length_s);

/// What the run differs in from any other.
struct DrillRun {
  double length_s = 0.0;            ///< of the drive; 0: all of it
  std::string scenario;             ///< path; empty: the command's
  std::string ins;                  ///< grade, of the simulator and of WM; empty: as configured
  bool prior_map = false;           ///< simulator: SP gets the course's a priori map
  double map_cell_m = 0.0;          ///< of that; 0: as the scenario says
  Vec3 map_shift_m = Vec3::Zero();  ///< it is wrong by, east north up
  double map_turn_rad = 0.0;        ///< and turned about the vehicle's start
  double grant_share = 1.0;         ///< of the work units that SP is granted
  int ladar_rows = 0;               ///< of the scenario's LADAR; 0: as configured
  int ladar_cols = 0;
};

/// Limits by the name of the figure: see kMarks in drill_limits.h.
using DrillMarks = std::map<std::string, double, std::less<>>;

struct Drill {
  std::string id;     ///< the file's name without .toml
  std::string name;   ///< for people
  std::string about;  ///< what happens, and why it matters
  bool needs_simulator = false;
  bool full = false;  ///< only with --full
  int seeds = 1;
  int seeds_full = 20;  ///< with --full
  DrillRun run;
  std::vector<Stimulus> stimuli;
  DrillMarks marks;

  /// Where the judging begins: the first stimulus, or 20 s where there is none.
  [[nodiscard]] double begin_s() const;
  /// Where the last stimulus ends; kForGood_s where one lasts for good, or there is none.
  [[nodiscard]] double end_s() const;
};

[[nodiscard]] Result<Drill> load_drill(const std::string& path);
/// @param path  names the file in messages; what the drill names is relative to it
[[nodiscard]] Result<Drill> parse_drill(std::string_view text, const std::string& path);

/// The kind as the file writes it.
[[nodiscard]] std::string_view kind_name(StimulusKind kind);
[[nodiscard]] std::string_view source_name(DrillSource source);
/// A stimulus in a few words: "gps dropout 35-95 s".
[[nodiscard]] std::string describe(const Stimulus& s);

}  // namespace rcs::drills
