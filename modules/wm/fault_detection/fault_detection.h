#pragma once
// Fault detection and exclusion by solution separation: sub-filters that exclude a source monitor
// the filter that uses it, and a source that contradicts them is excluded. They process an input
// once its place in time is final, delayed by the lag of the history; a finding replaces the state
// there, and all later inputs are fused again.

#include <algorithm>
#include <array>
#include <optional>

#include "modules/wm/fault_detection/course_shape.h"
#include "modules/wm/fault_detection/fix_drift.h"
#include "modules/wm/fault_detection/match_mean.h"
#include "modules/wm/fault_detection/motion_votes.h"
#include "modules/wm/fault_detection/source_monitor.h"
#include "modules/wm/fault_detection/turned_path.h"
#include "modules/wm/fault_detection/wheels_vote.h"
#include "modules/wm/filter.h"
#include "rcs/base/protection_quantiles.h"

namespace rcs::wm {

/// The values are those of subfilter_t. kGps also excludes the a priori map: it runs on motion
/// only.
enum class Without : int { kAll = 0, kLadar = 1, kGps = 2 };

/// A copy of the filter that excludes some source from a moment at which all tests were calm.
struct Subfilter {
  FilterState state;
  Stamp branch = Stamp::min();  ///< time of the branch; min(): not alive

  [[nodiscard]] bool alive() const { return branch != Stamp::min(); }
  /// It spans a gap of the INS: its difference from the main filter then measures the gap.
  [[nodiscard]] bool passed_gap() const {
    return alive() && !state.bookkeeping.excluded.ins &&
           std::max(state.bookkeeping.ins_lost, state.bookkeeping.ins_gap_end) >= branch;
  }
};

/// State of a source and whether it is received. The values are those of integrity_t.
enum class SourceStatus : int {
  kNone = 0,
  kFully = 1,
  kQuarantine = 2,
  kProbation = 3,
  kSuspect = 4,
  kReadmitting = 5
};

[[nodiscard]] constexpr bool fused(SourceStatus source) {
  return source == SourceStatus::kFully || source == SourceStatus::kProbation ||
         source == SourceStatus::kSuspect;
}

[[nodiscard]] constexpr bool excluded(SourceStatus source) {
  return source == SourceStatus::kQuarantine || source == SourceStatus::kReadmitting;
}

enum class Finding : int {
  kNothing = 0,
  kGpsFaulty,      ///< GPS is faulty: excluded, the filter continues from the sub-filter
  kGpsReadmitted,  ///< fixes agree with the filter and with the motion: readmitted
  kFilterFaulty,  ///< fixes contradict the filter for long but not each other: the filter is faulty
  /// GPS is faulty within its probation, or agrees with the motion that was given up for it.
  kGpsReadmissionRevoked,
  kLadarFaulty,
  kLadarReadmitted,
  kMapFaulty,           ///< the a priori map is faulty: excluded
  kInsFaulty,           ///< the INS is faulty: excluded, the second process model replaces it
  kInsReadmitted,       ///< the INS agrees with the other sources: readmitted
  kOdometryFaulty,      ///< the speed of the wheels is wrong: excluded
  kOdometryReadmitted,  ///< it agrees with the filter: readmitted
  kGpsRejected,   ///< the filter has rejected its fixes, and no sub-filter tells which one is wrong
  kMapReadmitted  ///< the a priori map agrees with the fixes: readmitted
};

/// How far the filter is off at most if a source is faulty: its distance to the sub-filter that
/// excludes the source, plus that one's own error (99.9 %).
struct UndetectedError {
  Stamp stamp = Stamp::min();
  double horizontal_m = 0.0;
  double vertical_m = 0.0;
  double horizontal_mps = 0.0;  ///< rate at which the filter and the sub-filter diverge
  double vertical_mps = 0.0;

  /// At a later stamp. The divergence of a filter whose acceleration is wrong doubles meanwhile.
  [[nodiscard]] UndetectedError at(Stamp later) const;
  /// The larger one of each value.
  [[nodiscard]] UndetectedError larger(const UndetectedError& other) const;
};

class FaultDetection {
 public:
  explicit FaultDetection(const FaultDetectionParams& params);

  /// The filter has been restarted: discards all sub-filters and tests.
  void clear();

  /// Frame world has been initialized from fixes: they still correct the heading for a while.
  void begin_fixes(Stamp now) { gps_fused_from_ = now; }

  /// @param m  the next input whose place in time is final
  /// @param next_imu  as for advance()
  /// @param belief  the state of the main filter after m
  /// @return the state that replaces it, if a finding does so
  [[nodiscard]] std::optional<FilterState> add(const Model& model, const Measurement& m,
                                               const ImuSample* next_imu,
                                               const FilterState& belief);

  [[nodiscard]] const Subfilter& subfilter(Without what) const;
  /// As of the newest input whose place in time is final.
  [[nodiscard]] const SourceMonitors& monitors() const { return monitors_; }
  [[nodiscard]] SourceStatus gps(const FilterState& belief, const ModeParams& modes) const;
  [[nodiscard]] SourceStatus ladar(const FilterState& belief, const ModeParams& modes) const;
  /// Of its content: whether messages are received is not considered.
  [[nodiscard]] SourceStatus ins(const FilterState& belief) const;
  /// Excluded, and received.
  [[nodiscard]] bool odometry_excluded(const FilterState& belief) const;
  /// Test statistics over their limits; a source that stays above 1 is faulty.
  [[nodiscard]] double gps_test_ratio() const { return gps_test_ratio_; }
  [[nodiscard]] double ladar_test_ratio() const { return ladar_test_ratio_; }
  [[nodiscard]] LadarScale ladar_scale() const { return votes_.ladar_scale(); }
  /// Against the LADAR. The limit is lower while wheels or GPS contradict the INS, too.
  [[nodiscard]] double ins_test_ratio() const;
  /// For how long gaps of the INS have prevented the tests, beyond what a single gap causes.
  [[nodiscard]] Duration untested_for(Stamp now) const {
    if (untested_since_ == Stamp::max()) return Duration::zero();
    return std::max<Duration>(now - untested_since_ - kUntested, Duration::zero());
  }
  /// Minimum detectable error: largest horizontal error by GPS that the tests may not detect.
  [[nodiscard]] double detectable_m() const { return detectable_m_; }
  /// Distance from the filter to the alternative hypothesis that the rejected fixes are right, if
  /// they agree with each other; otherwise 0.
  [[nodiscard]] double alternative_m() const { return alternative_m_; }
  /// Distance from the filter to the sub-filter without the a priori map while that test is not
  /// calm; otherwise 0.
  [[nodiscard]] double map_alternative_m() const { return map_alternative_m_; }
  /// Of the faults of the INS and of the LADAR that have not been detected.
  [[nodiscard]] UndetectedError undetected(Stamp stamp) const;
  [[nodiscard]] Finding newest_finding() const { return finding_; }
  [[nodiscard]] int findings() const { return findings_; }
  /// Of the newest finding: the test ratio that led to it, and the horizontal step of the belief.
  [[nodiscard]] double finding_ratio() const { return finding_ratio_; }
  [[nodiscard]] double finding_moved_m() const { return finding_moved_m_; }

 private:
  /// The filter under the hypothesis that an excluded source is right.
  struct Hypothesis {
    FilterState state;
    Stamp began = Stamp::min();
    double began_m = 0.0;
    int agreed = 0;
    int refused = 0;           ///< rejected measurements of the source
    int refused_in_row = 0;    ///< of them the newest in a row
    Vec2 off = Vec2::Zero();   ///< distance of its fix from the filter at the first test [m]
    double variance_m2 = 0.0;  ///< horizontal variance of the filter then, larger axis [m^2]
    double up_m = 0.0;         ///< the same distance upwards
    double up_variance_m2 = 0.0;
    double heading_rad = 0.0;  ///< by which the heading of the filter may be wrong
    FixDrift drift{};          ///< of its velocities against the filter

    [[nodiscard]] bool alive() const { return began != Stamp::min(); }
    void count(bool accepted);
  };

  /// The inertial motion since its branch against one other source.
  struct InertialTest {
    double ratio = 0.0;       ///< NIS over its limit at the newest measurement
    double evidence_s = 0.0;  ///< time above the limit, weighted by the ratio; 0: it is not above
    Stamp tested = Stamp::min();

    void add(double ratio_now, Stamp now);
    /// Above the limit for this time, or for less with a larger ratio.
    [[nodiscard]] bool lasts(Stamp now, Duration time) const;
  };
  /// Change of a residual of the inertial motion since its first second: a velocity or a heading
  /// that was wrong at the branch is no fault of the INS.
  struct Drift {
    Stamp since = Stamp::min(), newest = Stamp::min();
    double first = 0.0;  ///< mean of the first second
    double mean = 0.0;   ///< of the last one

    /// @return the change, once it has been measured for two seconds
    std::optional<double> add(Stamp stamp, double value);
  };
  /// A copy of the filter that continues by the INS alone, and what the LADAR measures against it.
  struct Inertial {
    Subfilter subfilter;
    double began_m = 0.0;          ///< distance driven at the branch
    MatchMean matches;             ///< in the current map
    Vec6 residual = Vec6::Zero();  ///< their mean
    std::array<Drift, 2> across;   ///< against the constraint: to the left, upwards
    double rotation = 0.0;         ///< ratio of the rotation alone
    bool in_rotation = false;  ///< the newest match contradicts its rotation more than its position
  };
  /// Rotations from scan to scan: LADAR against INS, of the newest scans.
  struct ScanRotation {
    Quat by_ladar = Quat::Identity();
    Quat by_ins = Quat::Identity();
    int map_epoch = -1;
    std::array<double, 32> apart_rad{};
    std::size_t scans = 0;
  };
  void move(const Model& model, const Measurement& m, const ImuSample* next_imu,
            const FilterState& belief);
  void test_ins(const Model& model, const Measurement& m, const FilterState& belief);
  void test_ins_by_ladar(const Model& model, const RollingMatch& z);
  void test_ins_by_fix(const Model& model, const GpsFix& z, const FilterState& belief, Stamp stamp);
  void test_ins_by_constraint(const OdometryParams& params, Stamp stamp);
  void vote_by_fix(const Model& model, const GpsFix& z);
  void vote_by_wheels(const OdometryParams& params, const OdometrySample& z, bool excluded);
  [[nodiscard]] std::optional<double> test_by_match(const Model& model, const RollingMatch& z,
                                                    Inertial* inertial) const;
  void branch_inertial(const FilterState& belief, Inertial* inertial) const;
  void branch_recent(const FilterState& belief);
  [[nodiscard]] const Subfilter& without_ins_since_the_fault() const;
  /// Between INS and LADAR.
  enum class Faulty { kUnknown, kIns, kLadar };
  [[nodiscard]] Faulty ins_or_ladar(Stamp now) const;
  /// The inertial motion violates the non-holonomic constraint by more than this test ratio.
  [[nodiscard]] bool violates_constraint(double ratio) const;
  [[nodiscard]] bool ladar_is_poor() const;
  [[nodiscard]] bool by_one_scan() const;
  [[nodiscard]] bool gyro_is_right(Stamp now) const;
  [[nodiscard]] bool only_ins_is_accepted(const FilterState& belief) const;
  std::optional<FilterState> decide_ins(const FilterState& belief, const ModeParams& modes);
  FilterState exclude_ins(const FilterState& belief, const ModeParams& modes);
  [[nodiscard]] bool ins_is_faulty_from_the_start(const FilterState& belief) const;
  FilterState exclude_early_ins(const Model& model, const FilterState& belief);
  [[nodiscard]] bool is_left_by_gps(Stamp now) const;
  FilterState exclude_ladar(const FilterState& belief, const ModeParams& modes);
  [[nodiscard]] bool ins_sides_with_ladar(const FilterState& belief) const;
  [[nodiscard]] bool wheels_are_stuck(const Measurement& m);
  [[nodiscard]] bool wheels_are_refused(const Measurement& input, const FilterState& belief);
  [[nodiscard]] bool only_filter_speed_changed(const Measurement& input,
                                               const FilterState& belief) const;
  bool wheels_are_outvoted(const Measurement& m, const FilterState& belief);
  FilterState exclude_outvoted_odometry(const FilterState& belief, const ModeParams& modes);
  [[nodiscard]] bool wheels_contradict_ins(const FilterState& others) const;
  [[nodiscard]] bool wheels_are_left(const Model& model, const GpsFix& z) const;
  FilterState exclude_odometry(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_excluded_odometry(const Model& model, const OdometrySample& z,
                                                     const FilterState& belief);
  void suppose_ins_right(const FilterState& belief);
  std::optional<FilterState> decide_excluded_ins(const Measurement& m, const FilterState& belief,
                                                 const ModeParams& modes);
  void drop_what_passed_a_gap(Stamp now);
  void bound_undetected(const FilterState& belief);
  void renew(const FilterState& belief);
  void branch_motion(const FilterState& belief);
  void branch_without_gps(const FilterState& belief);
  void branch_all(const FilterState& belief);
  /// @param branch  of the sub-filters to be replaced
  [[nodiscard]] bool tests_are_calm(Stamp branch, const FilterState& belief) const;
  [[nodiscard]] static bool has_position(const FilterState& belief);
  [[nodiscard]] bool lasts(bool contradicts, Stamp now, Stamp* since) const;
  [[nodiscard]] bool knows_attitude(const FilterState& belief) const;
  std::optional<FilterState> judge_fix(const Model& model, const GpsFix& z,
                                       const FilterState& belief);
  std::optional<FilterState> judge_suspect_fix(const Model& model, const GpsFix& z,
                                               const FilterState& belief);
  void suppose_gps_right(const Model& model, const GpsFix& z, const FilterState& belief);
  /// The horizontal error that an undetected fault may have caused.
  [[nodiscard]] double possible_error_m(const FilterState& belief) const;
  bool drifts(const Model& model, const GpsFix& z, const FilterState& belief);
  bool keeps_its_shape(const Model& model, const GpsFix& z, const FilterState& belief);
  [[nodiscard]] double possible_turn_rad(const FilterState& belief) const;
  std::optional<FilterState> heading_is_wrong(const Model& model, const GpsFix& z,
                                              const FilterState& belief);
  std::optional<FilterState> judge_quarantined_fix(const Model& model, const GpsFix& z,
                                                   const FilterState& belief);
  std::optional<FilterState> map_is_faulty(const Model& model, const GpsFix& z,
                                           const FilterState& belief);
  FilterState without_map(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_prior_match(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_excluded_map(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_match(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_quarantined_match(const FilterState& belief,
                                                     const ModeParams& modes);
  std::optional<FilterState> exclude_other_than_gps(const Model& model, const GpsFix& z,
                                                    const FilterState& belief);
  FilterState exclude_gps(bool confirmed, const FilterState& belief, const ModeParams& modes);
  void suppose_ins_faulty(const FilterState& belief);
  std::optional<FilterState> exclude_suspect_gps(const Model& model, const GpsFix& z,
                                                 const FilterState& belief);
  [[nodiscard]] bool moves_along(const Model& model, const GpsFix& z,
                                 const FilterState& belief) const;
  void watch_jumps(const Model& model, const GpsFix& z, Stamp now);
  void sum_velocity(const Model& model, const GpsFix& z);
  void compare_speeds(const Model& model, const GpsFix& z, const FilterState& others);
  [[nodiscard]] bool speeds_side_with_fix() const;
  [[nodiscard]] bool sides_with_fix(const Model& model, const GpsFix& z,
                                    const Subfilter& motion) const;
  [[nodiscard]] bool ins_is_confirmed(const Model& model, const GpsFix& z) const;
  void follow_rotation(const Measurement& m, const FilterState& belief);
  void follow_courses(const Model& model, const Measurement& m);
  [[nodiscard]] static bool accepts_fixes(const Hypothesis& with_gps);
  [[nodiscard]] bool gps_is_right(Stamp now) const;
  void bound_keeping_gps(const FilterState& belief);
  [[nodiscard]] UndetectedError undetected_by_tests(Stamp stamp) const;
  void bound_given_up(const FilterState& belief);
  [[nodiscard]] bool sides_with_given_up(const Model& model, const GpsFix& z,
                                         const FilterState& belief);
  std::optional<FilterState> judge(const Model& model, const Measurement& m,
                                   const FilterState& belief);
  void forget_silent(const FilterState& belief);
  void step_monitors(const Excluded& excluded, Stamp now);
  FilterState found(Finding finding, const FilterState& next, const FilterState& belief,
                    const ModeParams& modes);

  static constexpr Duration kFresh = from_seconds(2.0);
  static constexpr Duration kSettling = from_seconds(5.0);  // after a gap of the INS
  // After the first fixes, and the readmission of GPS. A sub-filter that branched before its fixes
  // were fused keeps what they correct, above all the heading, and would contradict them within
  // seconds.
  static constexpr Duration kFixesSettle = from_seconds(3.0);
  static constexpr Duration kYoung =
      from_seconds(1.0);  // age before which a sub-filter is not tested
  static constexpr Duration kNewInertial = from_milliseconds(2500.0);
  static constexpr double kContradicts = 2.5;  // ratio of INS and LADAR; smaller ones are frequent
  static constexpr double kSuspectAcross = 0.2;  // 2.3 standard deviations: another source decides
  static constexpr double kFollowsConstraint = 0.1;       // 1.5 of them: the INS is not suspect
  static constexpr double kQuiet = 0.15;                  // ratio without any sign of a fault
  static constexpr Duration kBefore = from_seconds(1.5);  // a fault shows so much later
  /// A source that was excluded so short before another one was so because of it.
  static constexpr Duration kConsequence = from_seconds(10.0);
  static constexpr double kMajority = 0.5;  // of low-passed votes, from -1 to 1
  static constexpr double kInsCalm = 0.7;
  static constexpr double kCalm = 0.3;  // test ratio below which sub-filters are branched
  static constexpr double kCalmLater = 0.5;
  static constexpr double kObserved_m = 0.25;  // sigma ahead of a match that confirms a motion
  static constexpr int kHeldFixes = 10;  // positions and velocities that keeps_gps_ has accepted

  FaultDetectionParams params_;
  SourceMonitors monitors_;
  double limit_1_, limit_2_, limit_3_;  // chi-square limits, by degrees of freedom
  // Two generations: the older one is tested, because an error that has already entered the filter
  // also enters a sub-filter that is branched later.
  Inertial inertial_new_, inertial_young_, inertial_;  // new: sensitive to sudden faults
  Subfilter without_gps_young_, without_gps_;
  Subfilter neither_young_, neither_;  ///< without GPS and INS: decides between the two
  Subfilter without_ins_young_, without_ins_;
  /// Younger ones, the newest first: the filter continues from one of them after an exclusion,
  /// since the attitude drifts without INS. They are not tested.
  std::array<Subfilter, 3> without_ins_recent_;
  Stamp ins_quiet_ = Stamp::min();  ///< newest time without any sign of a fault of the INS
  Subfilter without_ladar_young_, without_ladar_;
  Stamp gps_quiet_ = Stamp::min();  ///< newest time without any sign of a fault of GPS
  double young_began_m_ = 0.0, without_gps_began_m_ = 0.0;  // distance driven at their branches
  Subfilter before_;  ///< the state from before kFilterFaulty, until the probation of GPS ends
  /// The same for longer, if the fixes only persisted: they may have been wrong all the time. It
  /// goes on through a gap of the INS, as it is no test.
  Subfilter given_up_;
  int agree_with_given_up_ = 0;  ///< fixes in a row that contradict the filter, and agree with it
  Hypothesis gps_right_, ladar_right_, ins_right_, map_right_;
  /// While GPS is contradicted, or excluded although the INS may be the faulty one: the filter that
  /// keeps GPS and excludes the INS.
  Hypothesis keeps_gps_;
  CourseShape course_shape_;
  double wheels_mps_ = 0.0;  ///< newest speed
  Stamp wheels_received_ = Stamp::min();
  Quat rotation_ = Quat::Identity();  ///< by the INS while it is excluded
  Stamp rotated_ = Stamp::min();      ///< newest of its samples
  WheelsVote others_against_wheels_;
  Turns turns_of_ins_right_;  ///< when that hypothesis began
  TurnedPath turned_;         ///< while GPS is not fused
  InertialTest ins_by_ladar_, ins_by_gps_, ins_by_constraint_;
  InertialTest ins_rises_;  // the part of the last one upwards
  ScanRotation scan_;
  static constexpr double kNever_m = -1e9;
  double ladar_poor_m_ = kNever_m;  ///< distance driven when fixes last contradicted the LADAR
  MotionVotes votes_;               ///< of GPS and of the wheels, between INS and LADAR
  /// Low-passed velocity of the fixes relative to the motions by INS and by LADAR, horizontal.
  Vec2 off_by_ins_mps_ = Vec2::Zero(), off_by_ladar_mps_ = Vec2::Zero();
  double fix_vote_ = 0.0;     ///< of them, between INS and LADAR: 1 against the INS
  double wheels_vote_ = 0.0;  ///< low-passed, between INS and GPS: 1 against the INS
  struct Speeds {
    double fix_mps = 0.0;                       ///< of the newest fix
    double others_mps = 0.0, wheels_mps = 0.0;  ///< less it, low-passed
  } speeds_;
  std::array<bool, 6> agreeing_{};  // whether each of the newest fixes agreed
  std::size_t fixes_ = 0;
  Stamp agreeing_since_ = Stamp::min();
  /// Of the newest fix from the filter without GPS.
  struct Offset {
    Stamp stamp = Stamp::min();
    Vec2 at_m = Vec2::Zero();
    double rate_mps = 0.0;
  } offset_;
  Stamp jumped_ = Stamp::min();           ///< when the fixes last jumped
  int suspicious_fixes_ = 0;              ///< fixes in a row above the limit
  Stamp gps_contradicts_ = Stamp::max();  ///< since when they have been
  int map_contradicted_ = 0;              ///< fixes in a row
  bool gps_suspected_ = false;            ///< gps_suspected of the filter before the newest input
  Vec6 cusum_ = Vec6::Zero();  ///< of the GPS velocity: east, west, north, south, up, down
  Stamp ladar_suspected_since_ = Stamp::min(), map_suspected_since_ = Stamp::min();
  /// Since when GPS is excluded because its fixes were rejected, while the faulty source is not
  /// known; min(): it is not.
  Stamp gps_suspect_ = Stamp::min();
  struct StuckWheels {
    double speed_mps = 0.0, yaw_rate_radps = 0.0;
    Stamp since = Stamp::min(), received = Stamp::min();
    int map_epoch = -1;  ///< of the match from which the LADAR is compared
    Stamp from = Stamp::min();
    Vec3 from_m = Vec3::Zero();
    int differing = 0;  ///< comparisons in a row
  } stuck_;
  struct RefusedWheels {
    Stamp at = Stamp::min();  ///< newest sample
    double share = 0.0;       ///< of the samples that the filter rejects, low-passed
    /// Of the newest one that it has accepted, or of the first one after a gap.
    double wheels_mps = 0.0;  ///< its speed
    double ahead_mps = 0.0;   ///< that of the filter then
  } refused_;
  double odometry_agrees_s_ = 0.0;        ///< for how long, while it is excluded
  Stamp odometry_judged_ = Stamp::min();  ///< newest sample while it is excluded
  static constexpr Duration kUntested = from_seconds(10.0);
  bool branched_ = false;                ///< sub-filters exist, or have existed
  Stamp untested_since_ = Stamp::max();  ///< a gap of the INS; max(): sub-filters have branched
  Stamp gps_judged_ = Stamp::min();      ///< newest fix
  /// First fix, or readmitted; the filter moves to it for a while.
  Stamp gps_fused_from_ = Stamp::min();
  double gps_test_ratio_ = 0.0, ladar_test_ratio_ = 0.0, map_test_ratio_ = 0.0;
  double ladar_height_ratio_ = 0.0;  ///< the part of the height of that of the LADAR
  double alternative_m_ = 0.0, map_alternative_m_ = 0.0;
  static constexpr double kAnything_m = 1e3;  ///< before the first branch
  double detectable_m_ = kAnything_m;
  struct Bound {
    UndetectedError error;
    Vec2 rate_mps = Vec2::Zero();  ///< horizontal, vertical; of the newest comparison alone
  };
  Bound bound_without_ins_, bound_without_ladar_;
  UndetectedError bound_keeping_gps_, bound_given_up_;
  Finding finding_ = Finding::kNothing;
  int findings_ = 0;
  double finding_ratio_ = 0.0, finding_moved_m_ = 0.0;
};

}  // namespace rcs::wm
