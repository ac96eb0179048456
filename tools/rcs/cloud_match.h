#pragma once
// Two point clouds registered by one of the methods, with the CPU time of its stages.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "modules/sp/cloud_registration.h"
#include "modules/sp/icp_paper.h"
#include "modules/sp/kd_tree.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::tools {

/// What every method answers.
struct CloudMatch {
  std::string stop;
  bool good = false;  ///< the pose is worth reading
  Pose T_model_data;
  int iterations = 0;
  int pairs = 0;
  double overlap = 0.0;  ///< pairs over points that were tried
  double mean_distance_of_pairs_m = 0.0;
  std::vector<std::pair<std::string, double>> cpu_ms;  ///< by stage
  std::optional<sp::PaperResult> paper;                ///< of this method only
  std::optional<sp::WideAnswer> wide;                  ///< planes only, as the next
  std::optional<sp::Registration> planes;

  [[nodiscard]] double total_ms() const;
};

/// Madhavan and Messina's.
/// @param model, data  at least one point each
[[nodiscard]] CloudMatch match_as_in_paper(const Points& model, const Points& data,
                                           const Pose& guess, const sp::PaperParams& params);

/// Production: register_clouds() by stages.
[[nodiscard]] CloudMatch match_planes(const Points& model, const Points& data, const Pose& guess,
                                      const sp::CloudParams& params);

/// From each of DATA's points to the closest of MODEL's [m].
[[nodiscard]] std::vector<float> closest_distances(const sp::KdTree& model, const Points& data,
                                                   const Pose& T_model_data);

}  // namespace rcs::tools
