#pragma once
// How far two clouds agree at a pose, whatever method found it.

#include "modules/sp/rolling_map.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::sp {

struct AgreementParams {
  double tolerance_m = 0.15;   ///< largest distance to a surface of the model, along its normal
  double tolerance_rad = 0.5;  ///< largest angle between the two surfaces' normals
  double min_variety = 2e-3;   ///< mean squared cosine below which a direction is not judged
};

/// Two scans of different places share their flat ground and little else: the ground makes their
/// overlap large, but across the ground nothing agrees. So the overlap is taken by direction.
struct Agreement {
  int surfaces = 0;      ///< points of the data that lie on a surface of the data
  double overlap = 0.0;  ///< share of them on a surface of the model with a like normal, [0, 1]
  /// The same share, weighted by the squared cosine between normal and direction, in that direction
  /// of translation in which it is least, [0, 1]; directions without surfaces are not judged.
  double least = 0.0;
};

/// @param model  a map of the model
/// @param data   a map of the data, made with the same parameters
/// @param points the data [m]
[[nodiscard]] Agreement agreement(RollingMap* model, RollingMap* data, const Points& points,
                                  const Pose& T_model_data, const AgreementParams& params);

}  // namespace rcs::sp
