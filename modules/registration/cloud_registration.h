#pragma once
// Registration of two point clouds without a vehicle. For tools, and for other programs.
//
//   const CloudRegistration r = register_clouds(model, data, Pose{}, CloudParams{});
//   if (r.accepted) use(r.best.T_target_vehicle);  // maps data into the model's frame
//
// Several hypotheses are carried through to the fine stage: an exhaustive search by occupancy
// proposes them, each is refined, and the one is chosen in which the clouds explain each other best
// and contradict each other least.

#include <vector>

#include "modules/registration/agreement.h"
#include "modules/registration/coarse_search.h"
#include "modules/registration/correlation_search.h"
#include "modules/registration/point_to_plane_icp.h"
#include "modules/registration/prepared_cloud.h"
#include "modules/registration/registration.h"

namespace rcs::registration {

struct CloudParams {
  CloudParams();
  PreparedCloudParams cloud;
  CorrelationParams correlation;
  IcpParams icp;
  WideMapParams wide_map;
  WideParams wide;
  AgreementParams agreement;
  /// Errors of a guess that are searched at first. If no hypothesis is convincing, all headings
  /// are.
  SearchRegion near = {6.0, radians(15.0)};
  double global_radius_m = 10.0;  ///< of a global search, [0, 100]
  int global_candidates = 15;     ///< of its proposals that are refined, [1, 100]
  double tolerance_m = 0.1;       ///< distance of a point to a surface that explains it
  /// Plausibility::score() above which no further hypotheses are searched (convincing), and below
  /// which the result is rejected (min_score). Chosen on KITTI drive 0005; see docs/experiments.
  double convincing = 0.3;
  double clearly = 0.7;  ///< largest share of the second best of a convincing one
  double min_score = 0.1;
  double max_contradicted = 0.45;    ///< largest share of contradicted over explained test points
  double min_least = 0.05;           ///< least Agreement::least of an accepted result
  double max_ambiguity = 0.8;        ///< see CloudRegistration::max_ambiguity
  double max_ambiguity_far = 0.5;    ///< likewise, of a result far outside of `near`
  double max_ambiguity_near = 0.65;  ///< likewise, by hypotheses within
  double nearby_m = 2.0;             ///< this distance
  double nearby_rad = 0.1;           ///< and this angle of the result
  double ambiguity_of_score = 1.1;   ///< likewise, of the score of a result
  /// Proposed hypotheses below this share of the best one's count are not refined.
  double min_count_share = 0.7;
  int points = 2500;          ///< of each cloud in the fine stage, approximately, [100, 1000000]
  double point_share = 0.02;  ///< and at least this share of them
  int few_points = 300;       ///< of the data when a hypothesis is refined
  double apart_m = 0.5;       ///< hypotheses nearer than this,
  double apart_rad = 0.05;    ///< and turned by less, count as one
};

/// Of a pose, whatever found it.
struct Verdict {
  Plausibility plausibility;
  Agreement agreement;
};

struct CloudRegistration {
  Registration best;  ///< T_target_vehicle is T_model_data
  Verdict verdict;
  bool accepted = false;
  double ambiguity = 0.0;  ///< score of the best other result over that of the best, [0, 1]
  /// From here on it is rejected as ambiguous: about its own score, at most 0.8. A result that
  /// explains little must be unambiguous: where the right pose is not within the region that was
  /// searched, the best of the wrong ones explain as little, and nearly the same. Likewise one that
  /// contradicts the guess, as in a building that is symmetric.
  double max_ambiguity = 0.0;
  std::vector<Hypothesis> ranked;  ///< refined with few points, the best first
};

/// Two clouds. Allocates: on the vehicle only without INS, and where nothing matches the
/// prediction.
class CloudMatcher {
 public:
  /// @param model, data  [m], finite; each from one position, which is its origin
  CloudMatcher(const Points& model, const Points& data, const CloudParams& params);

  /// Hypotheses from a guess with an error of metres and tens of degrees, refined and ranked.
  [[nodiscard]] std::vector<Hypothesis> search(const Pose& guess);
  /// Within global_radius_m of the guess, of any heading, tilted by up to 30 deg.
  [[nodiscard]] std::vector<Hypothesis> search_globally(const Pose& guess);
  /// The precise result from the best hypothesis, and whether it is accepted.
  [[nodiscard]] CloudRegistration conclude(std::vector<Hypothesis> ranked);
  /// Every method also returns a pose for unrelated clouds, hence the check.
  [[nodiscard]] Verdict judge(const Pose& T_model_data);
  /// From a guess with an error of decimetres.
  /// @return with T_target_vehicle = T_model_data
  [[nodiscard]] Registration refine(const Pose& guess);

 private:
  Registration refine_few(const Pose& guess);
  [[nodiscard]] double ambiguity(const CloudRegistration& found, double score);
  void add(const std::vector<Hypothesis>& proposed, std::vector<Hypothesis>* refined);
  void keep_distinct(std::vector<Hypothesis>* refined) const;
  [[nodiscard]] bool convinces(const std::vector<Hypothesis>& ranked);
  [[nodiscard]] bool is_far(const Pose& T_model_data, const Pose& guess) const;

  CloudParams params_;
  PreparedCloud model_;
  PreparedCloud data_;
  Points model_points_;
  Points data_points_;
  Points few_;
  bool far_ = false;  ///< from the guess is the best hypothesis of search()
  IcpWorkspace workspace_;
};

/// True if the pose explains enough, in every direction of translation that has surfaces, and
/// contradicts little.
[[nodiscard]] bool plausible(const Verdict& verdict, const CloudParams& params);
/// True if the clouds contradict each other at the pose: other than !plausible(), not if they
/// merely have little in common.
[[nodiscard]] bool contradictory(const Verdict& verdict, const CloudParams& params);
/// True if the pose is plausible and the clouds determine every direction of translation.
[[nodiscard]] bool accepted(const Verdict& verdict, const CloudParams& params);

/// search() and conclude().
/// @param model, data  [m], finite
/// @param guess  approximate T_model_data
[[nodiscard]] CloudRegistration register_clouds(const Points& model, const Points& data,
                                                const Pose& guess, const CloudParams& params);

}  // namespace rcs::registration
