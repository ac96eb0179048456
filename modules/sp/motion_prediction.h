#pragma once
// Prediction of the vehicle's pose at a scan's reference instant, and of the motion during the
// scan: from WM's belief and the INS, or, without one of these, by constant velocity.

#include <optional>

#include "modules/sp/scan/scan_motion.h"
#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::sp {

struct Expectation {
  /// False: the pose in the rolling map is unknown to both WM and SP. The pose is the last one, and
  /// no scan can be registered from it.
  bool known = true;
  /// The INS is silent, or has just been: the motion during the scan is extrapolated, and a
  /// deskewed scan of a rocking vehicle is distorted.
  bool ins_lost = false;
  bool ins_returned = false;  ///< ins_lost, and samples are received again
  bool by_belief = false;     ///< of WM
  bool by_scans = false;      ///< without INS: the motion of the last scans continues
  /// by_scans, and that may be wrong by more than a registration corrects: there is no motion yet,
  /// or the scans are too far apart in time.
  bool motion_unknown = false;
  [[nodiscard]] bool ins_silent() const { return ins_lost && !ins_returned; }
  MotionState at_reference;
  Mat6 covariance = Mat6::Identity();  ///< right perturbation (rho [m], phi [rad])
};

struct ExpectationParams {
  double coast_sigma_m = 0.5;     ///< of a constant-velocity prediction
  double coast_sigma_rad = 0.05;  ///< likewise
  double sigma_scale = 1.0;       ///< factor on the sigma of WM's prediction
};

/// @param inertial  at least one sample; @return true: the newest is too old for a scan of then
[[nodiscard]] bool ins_is_silent(const InertialBuffer& inertial, Stamp reference);

[[nodiscard]] Mat6 isotropic(double sigma_m, double sigma_rad);

/// Known motion in the frame of the current rolling map.
class MotionGuess {
 public:
  /// WM's newest belief; none: it has none in this map.
  void believe(const std::optional<MotionState>& belief, const Mat6& covariance);
  /// The pose of a registered scan.
  void remember(Stamp stamp, const Pose& T_rolling_vehicle);
  /// For a new map: the poses in the former one are invalid.
  void forget_poses();

  /// The motion at `stamp` if the vehicle is then at this pose: constant body velocity and rate
  /// since the last registered scan; none if that is too old.
  [[nodiscard]] std::optional<MotionState> motion_to(Stamp stamp,
                                                     const Pose& T_rolling_vehicle) const;
  /// Constant body velocity since the last two registered scans, without belief and INS; none if
  /// they are too old.
  [[nodiscard]] std::optional<Pose> continued(Stamp reference) const;
  [[nodiscard]] Expectation expect(Stamp reference, const InertialBuffer& inertial,
                                   const ExpectationParams& params) const;

 private:
  [[nodiscard]] std::optional<MotionState> own_motion() const;
  // The last two registered poses: the constant-velocity guess.
  struct Fix {
    Stamp stamp = Stamp::min();
    Pose T_rolling_vehicle;
  };
  Fix last_, before_last_;
  std::optional<MotionState> belief_;
  Mat6 belief_covariance_ = Mat6::Identity();
};

}  // namespace rcs::sp
