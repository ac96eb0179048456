#pragma once
// One filter from event to event: what it carries along, how it moves to an instant, how it takes a
// measurement. The result depends on the events and their order in sensor time alone.

#include <array>
#include <variant>

#include "modules/wm/eskf.h"
#include "modules/wm/kalman_update.h"
#include "modules/wm/measurement_models.h"

namespace rcs::wm {

/// The values are innovation_t's.
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

/// One record for every measurement that was considered.
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

/// Stands when the INS is as quiet as at rest: running mean and variance over a window.
struct Stillness {
  Vec3 mean_rate = Vec3::Zero();   ///< [rad/s]
  Vec3 mean_force = Vec3::Zero();  ///< [m/s^2]
  double variance_rate = 0.0;
  double variance_force = 0.0;
  double seen_s = 0.0;

  void add(const ImuSample& imu, double window_s);
  [[nodiscard]] bool quiet(const StillnessParams& params) const;
};

/// What a source did so far.
struct SourceRecord {
  Stamp accepted = Stamp::min();  ///< newest accepted
  double distance_m = 0.0;        ///< driven until then
  int refused = 0;                ///< in a row since
};

/// Sources that a filter excludes: a sub-filter permanently, the main filter while they are faulty.
struct Withheld {
  bool gps = false;
  bool ladar = false;
  bool odometry = false;
  bool prior_map = false;  ///< ladar withholds it, too
};

/// How well matches to a tile of the a priori map agree with what is believed without them.
struct TileTrust {
  std::int64_t tile_id = 0;
  bool known = false;
  double excess = 1.0;      ///< NIS for each degree of freedom, low-passed by distance; 1: as good
                            ///< as it says
  double distance_m = 0.0;  ///< driven at its newest match
  bool doubted = false;     ///< its matches are looked at, and not fused
};

/// In what gps_offset is counted, and what the receiver claims meanwhile.
struct GpsScale {
  Vec3 unit_m = Vec3::Zero();        ///< 0: no fix yet
  Stamp finer_since = Stamp::max();  ///< fixes have claimed much less than that
  Stamp renewed = Stamp::min();      ///< gps_offset became another one
};

/// What the non-holonomic constraint was refused with on one axis.
struct Astray {
  double mps = 0.0;  ///< the newest time; 0: it was not
  int times = 0;     ///< in a row, alike
};

/// What the filter carries along beside its belief.
struct Memory {
  std::array<SourceRecord, kSources> sources;
  Stamp ins_stamp = Stamp::min();    ///< end of the newest INS interval that was integrated
  Stamp ins_lost = Stamp::min();     ///< when it last fell silent
  Stamp ins_gap_end = Stamp::min();  ///< when it came back from a gap that was not bridged
  Stillness stillness;
  Lasting lasting;
  Vec3 accel_vehicle = Vec3::Zero();  ///< without gravity [m/s^2]
  double odometry_mps = 0.0;          ///< newest
  Stamp odometry_heard = Stamp::min();
  Stamp constrained = Stamp::min();  ///< when the non-holonomic constraint was last held up
  std::array<Astray, 2> astray;      ///< sideways, up
  double distance_m = 0.0;           ///< driven
  /// Variance for each metre that SP's map inherits of its scans now, [m^2, rad^2].
  double inherited_m2 = 0.0, inherited_rad2 = 0.0;
  Withheld withheld;
  Stamp fix_heard = Stamp::min();  ///< newest fix, believed or not
  bool gps_accused = false;        ///< withheld for what it said, not for its silence
  GpsScale gps_scale;
  MapBias map_bias;  ///< of the a priori map here, as it says
  std::array<TileTrust, 16> tiles;
  bool tile_doubted = false;  ///< the newest match's
  int heights_refused = 0;    ///< in a row, of fixes whose place was accepted
  bool anchored = false;      ///< the world is the datum's: absolute measurements count
  Pose T_path_vehicle;        ///< composition of the predicted body increments alone
  Pose T_local_vehicle;       ///< the same with the LADAR's corrections; steps at each of them
  /// What other sources did to the vehicle's pose in the map since the last match, vehicle axes.
  /// The next match takes it back, and the local pose, which never had it, must not have that
  /// either.
  Pose unmatched;
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
  Memory memory;
};

/// Without gravity [m/s^2].
inline Vec3 accel_world(const FilterState& s) {
  return s.belief.x.T_world_vehicle.q * s.memory.accel_vehicle;
}

/// Constants of the filter.
struct Model {
  explicit Model(const WmParams& p);
  WmParams params;
  Earth earth;
  std::array<double, 7> gates{};  ///< by degrees of freedom
};

/// Up to three per measurement: a fix has position and velocity, odometry its constraint.
struct Innovations {
  std::array<Innovation, 3> records;
  int count = 0;
  void add(const Innovation& i) { records[static_cast<std::size_t>(count++)] = i; }
};

/// Moves the state to `to`.
/// @param next_imu  the INS sample that covers `to`, i.e. the first with stamp >= to; null: silent,
///                  the second process model is used
/// A zero-velocity record is added when the vehicle is found to stand.
void advance(const Model& model, Stamp to, const ImuSample* next_imu, FilterState* state,
             Innovations* records);

/// Fuses a measurement at state->belief.x.stamp; `records` says how it went.
void apply(const Model& model, const Measurement& measurement, FilterState* state,
           Innovations* records);

/// Counts a reset when the world pose has moved from `before` by more than a step's bounds.
void count_reset(const ModeParams& params, const Pose& before, FilterState* state);

}  // namespace rcs::wm
