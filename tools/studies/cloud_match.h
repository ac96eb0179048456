#pragma once
// Registration of two point clouds by one of the methods, with the CPU time of its stages.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "modules/registration/cloud_registration.h"
#include "modules/registration/gicp.h"
#include "modules/registration/madhavan_messina_icp.h"
#include "rcs/base/kd_tree.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::studies {

/// CloudMatch::stop if the method has converged and its result is not plausible.
inline constexpr const char* kDisagreement = "disagreement";

/// Result of every method.
struct CloudMatch {
  std::string stop;
  /// Converged, and the clouds are plausible at the pose and determine every direction of
  /// translation.
  bool good = false;
  Pose T_model_data;
  int iterations = 0;
  int pairs = 0;
  double overlap = 0.0;  ///< number of pairs over number of points
  double mean_distance_of_pairs_m = 0.0;
  std::vector<std::pair<std::string, double>> cpu_ms;       ///< by stage
  std::optional<registration::Verdict> verdict;             ///< at the pose; only if converged
  std::optional<registration::PaperResult> paper;           ///< only of this method
  std::optional<registration::Registration> planes;         ///< of production, or of gicp
  std::optional<registration::CloudRegistration> searched;  ///< of production

  [[nodiscard]] double total_ms() const;
};

/// Method of Madhavan and Messina.
/// @param model, data  at least one point each
[[nodiscard]] CloudMatch match_as_in_paper(const Points& model, const Points& data,
                                           const Pose& guess,
                                           const registration::PaperParams& params);

/// Production: register_clouds() by stages.
[[nodiscard]] CloudMatch match_planes(const Points& model, const Points& data, const Pose& guess,
                                      const registration::CloudParams& params);

/// Production with a global search.
[[nodiscard]] CloudMatch match_globally(const Points& model, const Points& data, const Pose& guess,
                                        const registration::CloudParams& params);

/// Generalized ICP.
[[nodiscard]] CloudMatch match_gicp(const Points& model, const Points& data, const Pose& guess,
                                    const registration::GicpParams& params);

/// Generalized ICP from the result of match_globally(), if accepted; else the latter's result.
[[nodiscard]] CloudMatch match_gicp_globally(const Points& model, const Points& data,
                                             const Pose& guess,
                                             const registration::CloudParams& search,
                                             const registration::GicpParams& params);

/// For each point of DATA the closest one of MODEL.
struct ClosestPoints {
  std::vector<std::uint32_t> index;
  std::vector<float> distance_m;

  [[nodiscard]] double mean_m() const;
};
[[nodiscard]] ClosestPoints closest_points(const KdTree& model, const Points& data,
                                           const Pose& T_model_data);

}  // namespace rcs::studies
