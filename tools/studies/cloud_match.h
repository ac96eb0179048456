#pragma once
// Two point clouds registered by one of the methods, with the CPU time of its stages.

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

/// CloudMatch::stop of a search that ended where the clouds do not agree.
inline constexpr const char* kDisagreement = "disagreement";

/// What every method answers.
struct CloudMatch {
  std::string stop;
  /// It ended well, and the clouds agree at the pose, which they determine in every direction of
  /// translation.
  bool good = false;
  Pose T_model_data;
  int iterations = 0;
  int pairs = 0;
  double overlap = 0.0;  ///< pairs over points that were tried
  double mean_distance_of_pairs_m = 0.0;
  std::vector<std::pair<std::string, double>> cpu_ms;  ///< by stage
  std::optional<registration::Agreement> agreement;    ///< at the pose; of a search that ended well
  std::optional<registration::PaperResult> paper;      ///< of this method only
  std::optional<registration::Registration> planes;    ///< of production, or of gicp
  std::optional<registration::WideAnswer> wide;        ///< of production, from a guess
  std::optional<registration::GlobalRegistration> global;  ///< of the search that went before

  [[nodiscard]] double total_ms() const;
};

/// Madhavan and Messina's.
/// @param model, data  at least one point each
[[nodiscard]] CloudMatch match_as_in_paper(const Points& model, const Points& data,
                                           const Pose& guess,
                                           const registration::PaperParams& params);

/// Production: register_clouds() by stages.
[[nodiscard]] CloudMatch match_planes(const Points& model, const Points& data, const Pose& guess,
                                      const registration::CloudParams& params);

/// Production without a guess to speak of; good: it was accepted.
[[nodiscard]] CloudMatch match_globally(const Points& model, const Points& data, const Pose& guess,
                                        const registration::CloudParams& params);

/// Generalized ICP.
[[nodiscard]] CloudMatch match_gicp(const Points& model, const Points& data, const Pose& guess,
                                    const registration::GicpParams& params);

/// From where match_globally() leads, if it is accepted; else what that answers.
[[nodiscard]] CloudMatch match_gicp_globally(const Points& model, const Points& data,
                                             const Pose& guess,
                                             const registration::CloudParams& search,
                                             const registration::GicpParams& params);

/// Of each of DATA's points in MODEL.
struct ClosestPoints {
  std::vector<std::uint32_t> index;
  std::vector<float> distance_m;

  [[nodiscard]] double mean_m() const;
};
[[nodiscard]] ClosestPoints closest_points(const KdTree& model, const Points& data,
                                           const Pose& T_model_data);

}  // namespace rcs::studies
