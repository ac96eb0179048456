#pragma once
// The method of Madhavan and Messina ("Iterative Registration of 3D LADAR Data for Autonomous
// Navigation", section 2.1), as printed or with its errors corrected, one by one. It is kept for
// comparison: the vehicle registers with point_to_plane_icp.h.

#include <cstdint>
#include <string_view>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

enum class MotionSolver { kSvd, kQuaternion };

struct PaperParams {
  /// The paper's D, the average distance of neighbouring scan points, [0.001, 100]; 0: measured.
  double spacing_m = 0.0;
  MotionSolver solver = MotionSolver::kSvd;

  int max_iterations = 200;       ///< [1, 100000]
  double relative_change = 1e-3;  ///< of R and T, of an iteration to all so far; 0: never, [0, 1]
  double mean_distance_m = 0.0;   ///< of the accepted pairs; 0: never, [0, 10]
  double min_move_m = 1e-5;       ///< a smaller motion is no change, for any total
  double min_turn_rad = 1e-6;

  // Corrections. Each can be disabled, to measure its effect.
  bool data_to_model = true;  ///< as printed, the motion from model to data is applied to the data
  bool guard_reflection = true;  ///< as printed, R may have determinant -1
  bool accepted_only = true;     ///< as printed, H sums over all N_D pairs
  bool gated_statistics = true;  ///< as printed, mean and deviation are of all pairs, not of those
                                 ///< within the last D_max
  bool detect_cycles = true;     ///< the branches of D_max can alternate forever

  /// As printed.
  [[nodiscard]] static PaperParams literal() {
    PaperParams p;
    p.data_to_model = p.guard_reflection = p.accepted_only = p.gated_statistics = false;
    p.detect_cycles = false;
    return p;
  }
};

/// Which of the four lines of the pseudo-code set D_max.
enum class PaperBranch : std::int8_t { kMu3Sigma, kMu2Sigma, kMuSigma, kValley };

enum class PaperStop : std::int8_t {
  kRelativeChange,  ///< step 4: R and T no longer change
  kMeanDistance,    ///< the mean distance of the pairs is small enough
  kMaxIterations,
  kLimitCycle,  ///< an earlier pose recurred
  kTooFew,      ///< fewer than three pairs are accepted
  kDegenerate,  ///< they lie on a line
  kDiverged,    ///< farther away than any of the points
  kEmpty,       ///< no model or no data
};
[[nodiscard]] std::string_view name_of(PaperBranch branch);
[[nodiscard]] std::string_view name_of(PaperStop stop);

struct PaperIteration {
  PaperBranch branch = PaperBranch::kMu3Sigma;
  double mu_m = 0.0;
  double sigma_m = 0.0;
  double d_max_m = 0.0;
  int pairs = 0;                 ///< accepted
  double mean_distance_m = 0.0;  ///< of them, before the iteration's motion
  double moved_m = 0.0;
  double turned_rad = 0.0;
};

struct PaperResult {
  PaperStop stop = PaperStop::kEmpty;
  Pose T_model_data;
  double spacing_m = 0.0;  ///< D
  std::vector<PaperIteration> history;
  std::vector<std::uint32_t> closest;    ///< of every data point, at the end
  std::vector<float> distance_before_m;  ///< of every data point to the model, at the guess
  std::vector<float> distance_after_m;   ///< and at the end
  double d_max_m = 0.0;                  ///< the last one
  int pairs = 0;                         ///< accepted by it
  double mean_distance_m = 0.0;          ///< of the accepted pairs, at the end
};

/// @param model, data  [m], all finite
/// @param guess        T_model_data at the start
/// Deterministic.
[[nodiscard]] PaperResult register_as_in_paper(const Points& model, const Points& data,
                                               const Pose& guess, const PaperParams& params);

/// Median distance of a point to its nearest neighbour, of at most 1000 of the points [m]; 0 for
/// fewer than two points.
[[nodiscard]] double measured_spacing(const Points& points);

/// Zhang's (1994) threshold for a start far from the solution: the first bin after the histogram's
/// peak that holds less than 60 % of it.
/// @param bin_m   width of the bins, and the smallest result
/// @param max_m  the largest result; greater distances are not counted
[[nodiscard]] double histogram_valley(const std::vector<float>& distances_m, double bin_m,
                                      double max_m);

}  // namespace rcs::registration
