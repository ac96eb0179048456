#pragma once
// Do no harm: filters that go without a source watch the belief that uses it, and a source that
// contradicts them is no longer believed. They see each input once its place in time is final, a
// history's lag late; what they find changes the belief there, and all since is fused again.

#include <array>
#include <optional>

#include "modules/wm/filter.h"

namespace rcs::wm {

/// The values are subfilter_t's. Without GPS: without the a priori map, too, by motion alone.
enum class Without : int { kAll = 0, kLadar = 1, kGps = 2 };
constexpr std::size_t kSubfilters = 3;

/// A copy of the belief that goes without some source from a moment at which all was well.
struct Subfilter {
  FilterState state;
  Stamp branch = Stamp::min();  ///< min(): there is none

  [[nodiscard]] bool alive() const { return branch != Stamp::min(); }
  /// It has passed a gap of the INS: its difference from the belief then measures the gap.
  [[nodiscard]] bool passed_gap() const {
    return alive() && std::max(state.memory.ins_lost, state.memory.ins_gap_end) >= branch;
  }
};

/// The values are integrity_t's.
enum class Trusted : int { kNone = 0, kFully = 1, kQuarantine = 2, kProbation = 3 };

enum class Finding : int {
  kNothing = 0,
  kGpsGuilty,       ///< it led the belief away: the belief from before is taken up again
  kGpsBack,         ///< its fixes agree with the belief and with the motion
  kGpsRight,        ///< they contradict the belief, but never one another: the belief was wrong
  kGpsBackRevoked,  ///< within its probation it was found guilty
  kLadarGuilty,
  kLadarBack,
  kMapGuilty  ///< the a priori map; it is not believed any more
};

class Trust {
 public:
  explicit Trust(const TrustParams& params);

  /// The belief has begun anew: there is nothing to compare it with.
  void clear();

  /// @param m  the next input whose place in time is final
  /// @param next_imu  as for advance()
  /// @param belief  after m
  /// @return the state to go on from instead
  [[nodiscard]] std::optional<FilterState> add(const Model& model, const Measurement& m,
                                               const ImuSample* next_imu,
                                               const FilterState& belief);

  [[nodiscard]] const Subfilter& subfilter(Without what) const;
  [[nodiscard]] Trusted gps(const FilterState& belief, const ModeParams& modes) const;
  [[nodiscard]] Trusted ladar(const FilterState& belief, const ModeParams& modes) const;
  /// Test statistics over their limits; above 1 for a while the source is guilty.
  [[nodiscard]] double gps_test_ratio() const { return gps_test_ratio_; }
  [[nodiscard]] double ladar_test_ratio() const { return ladar_test_ratio_; }
  /// How far fixes may lead the belief away, horizontally, before they are found out.
  [[nodiscard]] double detectable_m() const { return detectable_m_; }
  /// How far from the belief the vehicle is if refused fixes that agree with one another are right.
  [[nodiscard]] double rival_m() const { return rival_m_; }
  /// How far from the belief the motion alone has led, once that puts the a priori map in doubt.
  [[nodiscard]] double map_rival_m() const { return map_rival_m_; }
  [[nodiscard]] Finding newest_finding() const { return finding_; }
  [[nodiscard]] int findings() const { return findings_; }

 private:
  /// What the belief would be if a source that is not believed were.
  struct Hypothesis {
    FilterState state;
    Stamp began = Stamp::min();
    double began_m = 0.0;
    int agreed = 0;
    int refused = 0;           ///< of its measurements
    int refused_in_row = 0;    ///< the newest of them
    Vec2 off = Vec2::Zero();   ///< of the belief, when it had settled [m]
    double variance_m2 = 0.0;  ///< the belief's then, the larger axis

    [[nodiscard]] bool alive() const { return began != Stamp::min(); }
    void count(bool accepted);
  };

  void move(const Model& model, const Measurement& m, const ImuSample* next_imu);
  void drop_what_passed_a_gap();
  void renew(const FilterState& belief);
  void grow_up();
  void branch_all(const FilterState& belief);
  [[nodiscard]] bool well(const FilterState& belief) const;
  [[nodiscard]] bool lasts(bool astray, Stamp now, Stamp* since) const;
  [[nodiscard]] bool knows_attitude(const FilterState& belief) const;
  std::optional<FilterState> judge_fix(const Model& model, const GpsFix& z,
                                       const FilterState& belief);
  void suppose_gps_right(const Model& model, const GpsFix& z, const FilterState& belief);
  bool keeps_its_shape(const Model& model, const GpsFix& z, const FilterState& belief);
  std::optional<FilterState> judge_quarantined_fix(const Model& model, const GpsFix& z,
                                                   const FilterState& belief);
  std::optional<FilterState> map_is_to_blame(const Model& model, const GpsFix& z,
                                             const FilterState& belief);
  FilterState without_map(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_prior_match(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_match(const FilterState& belief, const ModeParams& modes);
  std::optional<FilterState> judge_quarantined_match(const FilterState& belief,
                                                     const ModeParams& modes);
  FilterState convict(const Model& model, const GpsFix& z, const FilterState& belief);
  [[nodiscard]] bool moves_along(const Model& model, const GpsFix& z,
                                 const FilterState& belief) const;
  void sum_velocity(const Model& model, const GpsFix& z);
  [[nodiscard]] bool ladar_is_to_blame(const Model& model, const GpsFix& z) const;
  FilterState found(Finding finding, const FilterState& next, const FilterState& belief,
                    const ModeParams& modes);

  static constexpr Duration kFresh = from_seconds(2.0);
  static constexpr Duration kSettling = from_seconds(5.0);  // after a gap of the INS
  static constexpr Duration kYoung = from_seconds(1.0);     // a sub-filter is not tested yet
  static constexpr double kCalm = 0.3;  // doubt below which a belief is worth a branch

  TrustParams params_;
  double limit_1_, limit_2_;  // chi square's, by degrees of freedom
  // Of two generations: the older ones watch, for what leads the belief away leads along whatever
  // branches from it after that.
  Subfilter inertial_young_, inertial_;
  Subfilter without_gps_young_, without_gps_;
  Subfilter without_ladar_;
  double young_began_m_ = 0.0, without_gps_began_m_ = 0.0;  // driven at their branches
  Subfilter before_;  ///< the state that the fixes contradicted before they were accepted
  Hypothesis gps_right_, ladar_right_;
  std::array<bool, 6> agreeing_{};  // the newest fixes
  std::size_t fixes_ = 0;
  Stamp agreeing_since_ = Stamp::min();
  int doubted_ = 0;                ///< fixes in a row
  int map_contradicted_ = 0;       ///< by fixes in a row
  bool accused_ = false;           ///< GPS, by the belief, before the newest input
  Vec<4> cusum_ = Vec<4>::Zero();  ///< of the fixes' velocity: east, west, north, south
  Stamp ladar_doubted_since_ = Stamp::min(), map_doubted_since_ = Stamp::min();
  Stamp gps_probation_ = Stamp::min(), ladar_probation_ = Stamp::min();
  double gps_test_ratio_ = 0.0, ladar_test_ratio_ = 0.0, map_test_ratio_ = 0.0;
  double rival_m_ = 0.0, map_rival_m_ = 0.0;
  static constexpr double kAnything_m = 1e3;  ///< before the watch has begun
  double detectable_m_ = kAnything_m;
  Finding finding_ = Finding::kNothing;
  int findings_ = 0;
};

}  // namespace rcs::wm
