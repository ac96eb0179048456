#pragma once
// Where the vehicle is expected at a scan's reference instant, and how it moves meanwhile: from
// WM's belief and the INS, or, without one of them, as it moved last.

#include <optional>

#include "modules/sp/scan/scan_motion.h"
#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::sp {

struct Expectation {
  /// False: neither WM nor SP knows where in the rolling map the vehicle is. The pose is the last
  /// one, and no scan can be registered from it.
  bool known = true;
  /// The INS is, or has just been, silent: the motion during the scan is extrapolated, and a
  /// deskewed scan of a rocking vehicle is distorted.
  bool ins_lost = false;
  bool ins_returned = false;  ///< ins_lost, and it has just been received again
  MotionState at_reference;
  Mat6 covariance = Mat6::Identity();  ///< right perturbation (rho [m], phi [rad])
};

struct ExpectationParams {
  double coast_sigma_m = 0.5;     ///< of a constant-velocity prediction
  double coast_sigma_rad = 0.05;  ///< likewise
  double sigma_scale = 1.0;       ///< on WM's sigma of the prediction
};

[[nodiscard]] Mat6 isotropic(double sigma_m, double sigma_rad);

/// What is known of the motion in the frame of the rolling map in hand.
class MotionGuess {
 public:
  /// WM's newest; none: it has none of this map.
  void believe(const std::optional<MotionState>& belief, const Mat6& covariance);
  /// Where a scan was registered.
  void remember(Stamp stamp, const Pose& T_rolling_vehicle);
  /// A new map: the poses of the one before mean nothing.
  void forget_poses();

  [[nodiscard]] Expectation expect(Stamp reference, const InertialBuffer& inertial,
                                   const ExpectationParams& params) const;

 private:
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
