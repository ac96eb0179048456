#pragma once
// The result of every registration, independent of its method and its target.

#include <cstdint>
#include <string_view>

#include "rcs/base/pose.h"
#include "rcs/base/work_units.h"

namespace rcs::registration {

/// A program compiled for another instruction set than the library aligns Eigen's types differently
/// and would read wrong poses. Such a program does not link: the symbol of its alignment is
/// missing.
template <int kBytes>
struct BuiltWithAlignment {
  static const char symbol;
};
[[gnu::used]] static const char* const kAlignment =
    &BuiltWithAlignment<EIGEN_MAX_ALIGN_BYTES>::symbol;

/// Why a registration ended. The order is that of registration_t.
enum class Stop : std::int8_t {
  kConverged = 0,
  kMaxIterations = 1,
  kBudget = 2,  ///< the grant is used up; the result is the best so far
  kLimitCycle = 3,
  kTooFew = 4,      ///< fewer than min_pairs
  kDegenerate = 5,  ///< converged, but at least one direction has no information
  kEmpty = 6,       ///< no points, or nothing to match them to
  kDiverged = 7,    ///< ended farther from the prediction than its gate allows
  kSeeded = 8,      ///< no registration: this scan starts a map
  kHeld = 9,        ///< no registration: its deadline could not be met
};

[[nodiscard]] std::string_view name_of(Stop stop);

/// True if the pose is meaningful (along its observed directions).
[[nodiscard]] constexpr bool usable(Stop stop) {
  return stop == Stop::kConverged || stop == Stop::kMaxIterations || stop == Stop::kBudget ||
         stop == Stop::kDegenerate || stop == Stop::kLimitCycle;
}

/// Always filled; read `stop` first.
struct Registration {
  Stop stop = Stop::kEmpty;
  Pose T_target_vehicle;              ///< at the scan's reference instant
  Mat6 information = Mat6::Zero();    ///< of the scan's residuals alone (no prior), right
                                      ///< perturbation (rho, phi); zero along unobserved directions
  Vec6 observability = Vec6::Zero();  ///< ascending, in [0, 1]: mean squared alignment of the
                                      ///< residuals with the six principal directions
  int iterations = 0;
  int points = 0;  ///< given
  int pairs = 0;   ///< matched in the last iteration
  WorkUnits granted = 0;
  WorkUnits used = 0;
  double mean_distance_m = 0.0;  ///< along the normals, of the pairs
  double rms_m = 0.0;
  double overlap = 0.0;       ///< pairs / points
  double correction_m = 0.0;  ///< from the prediction
  double correction_rad = 0.0;
};

/// Start and regularization of the search. The prediction regularizes the search but adds no
/// information to the result along observed directions.
struct Prediction {
  Pose T_target_vehicle;
  Mat6 covariance = Mat6::Identity();  ///< right perturbation (rho, phi); positive definite
};

/// Information of a registration whose scan is distorted by an independent error of covariance
/// `distortion` (right perturbation (rho [m], phi [rad]), positive definite): (I^-1 + D)^-1, also
/// where I is singular.
[[nodiscard]] Mat6 with_distortion(const Mat6& information, const Mat6& distortion);

/// The optimal combination of prediction and registration, at which the scan is inserted into the
/// map. A weakly observed direction must not disturb the map.
[[nodiscard]] Pose fused_pose(const Prediction& prediction, const Registration& registration);

}  // namespace rcs::registration
