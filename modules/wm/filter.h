#pragma once
// One filter: its state between events, prediction to an instant, and update by a measurement. The
// result depends only on the events and their order in sensor time.

#include <array>
#include <variant>

#include "modules/wm/eskf.h"
#include "modules/wm/fault_detection/ladar_scale.h"
#include "modules/wm/kalman_update.h"
#include "modules/wm/measurement_models.h"

namespace rcs::wm {

/// The values are those of innovation_t.
enum class Source : int {
  kGpsPosition = 0,
  kGpsVelocity = 1,
  kOdometry = 2,
  kNonHolonomic = 3,
  kRolling = 4,
  kPriorMap = 5,
  kZeroVelocity = 6
};
constexpr std::size_t kSources = 7;

/// An input at its instant. The order of the alternatives is the order at equal stamps.
struct Measurement {
  Stamp stamp{};
  std::variant<ImuSample, RollingMatch, PriorMatch, GpsFix, OdometrySample> value;

  [[nodiscard]] const ImuSample* imu() const { return std::get_if<ImuSample>(&value); }
};

/// Record of a measurement that was fused or rejected.
struct Innovation {
  Stamp stamp{};
  Source source = Source::kGpsPosition;
  Reason reason = Reason::kInvalid;
  int dof = 0;
  double nis = 0.0;
  double gate = 0.0;
  Vec6 r = Vec6::Zero();
  Vec6 sigma = Vec6::Zero();
};

/// Detects standstill from the INS: running mean and variance over a window.
struct Stillness {
  Vec3 mean_rate = Vec3::Zero();   ///< [rad/s]
  Vec3 mean_force = Vec3::Zero();  ///< [m/s^2]
  double variance_rate = 0.0;
  double variance_force = 0.0;
  double seen_s = 0.0;

  void add(const ImuSample& imu, double window_s);
  [[nodiscard]] bool quiet(const StillnessParams& params) const;
};

/// Status of a source so far.
struct SourceRecord {
  Stamp accepted = Stamp::min();  ///< newest accepted
  double distance_m = 0.0;        ///< distance driven until then
  int refused = 0;                ///< rejected in a row since
  int in_row = 0;                 ///< accepted in a row
};

/// Sources that a filter excludes: a sub-filter permanently, the main filter while they are faulty.
struct Excluded {
  bool ins = false;  ///< the second process model replaces it
  bool gps = false;
  bool ladar = false;
  bool odometry = false;   ///< and the non-holonomic constraint
  bool wheels = false;     ///< odometry alone
  bool prior_map = false;  ///< also implied by ladar
  bool force = false;      ///< of the INS: its rotation alone is used

  /// The INS or a part of it.
  [[nodiscard]] bool any_of_ins() const { return ins || force; }
};

/// Agreement of the matches to a tile of the a priori map with the filter without them.
struct TileStatus {
  std::int64_t tile_id = 0;
  bool known = false;
  double excess = 1.0;      ///< NIS per degree of freedom, low-passed by distance; 1: as stated
  double distance_m = 0.0;  ///< distance driven at its newest match
  bool suspected = false;   ///< excluded: its matches are not fused

  static constexpr double kExcludedAbove = 3.0;    // of excess
  static constexpr double kReadmittedBelow = 1.5;  // lower, so that a tile does not flap
};

/// Unit of gps_bias, and changes of the sigma that the receiver reports.
struct GpsScale {
  Vec3 unit_m = Vec3::Zero();        ///< 0: no fix yet
  Stamp finer_since = Stamp::max();  ///< fixes have reported a much smaller sigma since
  Stamp renewed = Stamp::min();      ///< when gps_bias was renewed for that
};

/// Divergence detector: residual with which the constraint was rejected on one axis.
struct Divergence {
  double mps = 0.0;  ///< at the newest test; 0: not rejected
  int times = 0;     ///< similar rejections in a row
};

/// Where registrations that were rejected place the vehicle: displacements from the filter in
/// observed directions, world axes.
struct RejectedMatches {
  Stamp stamp = Stamp::min();    ///< of the newest one; min(): the newest was accepted
  Vec3 apart_m = Vec3::Zero();   ///< by the newest one
  Vec3 rate_mps = Vec3::Zero();  ///< at which the displacement grows
  Stamp reset = Stamp::min();    ///< when the rolling map was last placed where the filter is
  Vec3 reset_m = Vec3::Zero();   ///< by the one that was accepted thereby

  void add(Stamp now, const Vec3& displacement_m);
  /// At a stamp not much later than the newest measurement.
  [[nodiscard]] Vec3 displacement(Stamp now, bool still_rejected) const;

  /// A fault that caused the reset has been found after this time.
  static constexpr Duration kResetLasts = from_seconds(5.0);
};

/// Bookkeeping of the filter next to its belief.
struct Bookkeeping {
  std::array<SourceRecord, kSources> sources;
  Stamp ins_stamp = Stamp::min();    ///< end of the newest INS interval that was integrated
  Stamp ins_lost = Stamp::min();     ///< when the INS last fell silent
  Stamp ins_gap_end = Stamp::min();  ///< end of its last gap that was not bridged
  bool level_due = false;            ///< roll and pitch are to be measured since that gap
  Stillness stillness;
  Lasting lasting;
  Vec3 accel_vehicle = Vec3::Zero();  ///< without gravity [m/s^2]
  double odometry_mps = 0.0;          ///< newest odometry
  Stamp odometry_received = Stamp::min();
  Stamp constrained = Stamp::min();       ///< newest test of the non-holonomic constraint
  std::array<Divergence, 2> divergences;  ///< lateral, vertical
  double distance_m = 0.0;                ///< distance driven
  /// Variance per metre that the rolling map of SP inherits from its scans now, [m^2, rad^2].
  double inherited_m2 = 0.0, inherited_rad2 = 0.0;
  RejectedMatches rejected_matches;
  Excluded excluded;
  /// Since the position was last fixed the motion has been measured by the LADAR alone: an error of
  /// it was not seen.
  bool unconfirmed = false;
  Stamp fix_received = Stamp::min();  ///< newest fix, accepted or not
  bool gps_suspected = false;         ///< excluded for its content, not after a silence
  GpsScale gps_scale;
  MapBias map_bias;  ///< modelled bias of the a priori map here, see modelled_bias()
  std::array<TileStatus, 16> tiles;
  TileStatus newest_tile;       ///< of the newest match
  int heights_refused = 0;      ///< in a row, of fixes whose horizontal position was accepted
  bool heights_jumped = false;  ///< the first of them was farther off than a drift can be
  /// The filter has been without forces since: its height may be what is wrong.
  bool heights_undecided = false;
  double height_off_m = 0.0;  ///< of the newest of them
  Stamp heights_since = Stamp::min();
  Stamp height_accepted = Stamp::min();
  bool georeferenced = false;  ///< frame world is that of the datum
  Pose T_path_vehicle;         ///< composition of the predicted body increments only
  Pose T_local_vehicle;        ///< the same with LADAR corrections; steps at each of them
  /// Uncorrected increment: change of the vehicle's pose in the rolling map by other sources since
  /// the last match, vehicle axes. The next match reverts it; the local pose, which never contained
  /// it, must not contain the reversal either.
  Pose uncorrected;
  int world_resets = 0;
  double last_reset_m = 0.0;
  double last_reset_rad = 0.0;
  Stamp last_reset = Stamp::min();

  SourceRecord& of(Source s) { return sources[static_cast<std::size_t>(s)]; }
  [[nodiscard]] const SourceRecord& of(Source s) const {
    return sources[static_cast<std::size_t>(s)];
  }
};

struct FilterState {
  Belief belief;
  Bookkeeping bookkeeping;
};

/// The velocity is integrated from the forces of the INS; otherwise it is extrapolated.
inline bool uses_forces(const FilterState& s) {
  return s.belief.x.inertial && !s.bookkeeping.excluded.force;
}

inline bool uses_wheels(const FilterState& s) {
  constexpr Duration kRecent = from_seconds(2.0);
  const Stamp newest = s.bookkeeping.of(Source::kOdometry).accepted;
  const bool excluded = s.bookkeeping.excluded.odometry || s.bookkeeping.excluded.wheels;
  return !excluded && newest > s.belief.x.stamp - kRecent;
}

/// For some seconds nothing but the LADAR has measured the motion.
inline bool ladar_is_alone(const FilterState& s) {
  const Stamp recent = s.belief.x.stamp - from_seconds(2.0);
  const bool ins = s.belief.x.inertial || s.bookkeeping.ins_stamp > recent;
  return !ins && !uses_wheels(s) && s.bookkeeping.of(Source::kGpsPosition).accepted < recent;
}

/// Without gravity [m/s^2].
inline Vec3 accel_world(const FilterState& s) {
  return s.belief.x.T_world_vehicle.q * s.bookkeeping.accel_vehicle;
}

/// Constants of the filter.
struct Model {
  explicit Model(const WmParams& p);
  WmParams params;
  Earth earth;
  std::array<double, 7> gates{};  ///< by degrees of freedom
  LadarScales ladar_scales;
};

/// Up to three per measurement: a fix has position and velocity, odometry its constraint.
struct Innovations {
  std::array<Innovation, 3> records;
  int count = 0;
  void add(const Innovation& i) { records[static_cast<std::size_t>(count++)] = i; }
};

/// Predicts the state to `to`, and adds a zero-velocity record if standstill is detected.
/// @param next_imu  the INS sample that covers `to`, i.e. the first with stamp >= to; null: the INS
///   is silent, and the second process model is used
void advance(const Model& model, Stamp to, const ImuSample* next_imu, FilterState* state,
             Innovations* records);

/// Fuses a measurement at state->belief.x.stamp; `records` receives the results.
void apply(const Model& model, const Measurement& measurement, FilterState* state,
           Innovations* records);

/// Counts a reset if the world pose has moved from `before` by more than the limits of a step.
void count_reset(const ModeParams& params, const Pose& before, FilterState* state);

}  // namespace rcs::wm
