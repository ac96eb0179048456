#pragma once
// Agreement of two clouds at a pose, independent of the registration method.

#include "modules/registration/rolling_map.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

struct AgreementParams {
  double tolerance_m = 0.15;   ///< largest distance to a surface of the model, along its normal
  double tolerance_rad = 0.5;  ///< largest angle between the two surfaces' normals
  /// Mean squared cosine below which a direction is not evaluated. Normals of noisy points vary,
  /// too: with 2 cm noise and few points in a voxel, those of a plane vary by 6 deg, sin^2
  /// = 1.0e-2, and a tunnel with its edges has 1.1e-2 along it. Scans of streets have 0.1 or more
  /// in every direction.
  double min_variety = 2e-2;
};

/// Two scans of different locations share their flat ground and little else: the ground makes their
/// overlap large, but horizontally nothing agrees. Therefore the overlap is computed by direction.
struct Agreement {
  int surfaces = 0;      ///< points of the data that lie on a surface of the data
  double overlap = 0.0;  ///< share of them on a surface of the model with a similar normal, [0, 1]
  /// The same share, weighted by the squared cosine between normal and direction, in the direction
  /// of translation with the smallest share, [0, 1]; directions without surfaces are not evaluated.
  double least = 0.0;
  /// Unit vector, frame of the data: translation along it is not determined, because the data have
  /// almost no surfaces across it (of several directions the one with the fewest). Zero: none.
  Vec3 undetermined = Vec3::Zero();
};

/// @param model  a map of the model
/// @param data   a map of the data, made with the same parameters
/// @param points the data [m]
[[nodiscard]] Agreement agreement(RollingMap* model, RollingMap* data, const Points& points,
                                  const Pose& T_model_data, const AgreementParams& params);

}  // namespace rcs::registration
