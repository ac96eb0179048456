#pragma once
// Registration of two point clouds with the production method, without a vehicle. For tools, and
// for other programs.
//
//   const Registration r = register_clouds(model, data, Pose{}, CloudParams{});
//   const bool good = usable(r.stop) &&
//                     agree(clouds_at(model, data, r.T_target_vehicle, CloudParams{}),
//                     CloudParams{});
//   if (good) use(r.T_target_vehicle);  // maps data into the model's frame

#include <vector>

#include "modules/registration/agreement.h"
#include "modules/registration/coarse_search.h"
#include "modules/registration/global_search.h"
#include "modules/registration/point_to_plane_icp.h"
#include "modules/registration/registration.h"
#include "modules/registration/rolling_map.h"

namespace rcs::registration {

struct CloudParams {
  CloudParams();
  WideMapParams wide_map;
  WideParams wide;
  GlobalParams global;
  RollingMapParams map;
  IcpParams icp;
  /// A global result is accepted if it explains this share of the data, and the score of the second
  /// best pose is below this share of its score. Chosen on frames 5, 15, 25, ... of the KITTI
  /// drive.
  double accept_score = 0.7;
  double accept_ratio = 0.97;
  /// A pose is rejected if the clouds agree less there: Agreement::overlap and ::least. Chosen on
  /// related and unrelated scans of six sensors (ADR 60).
  AgreementParams agreement;
  double min_overlap = 0.2;
  double min_least = 0.2;
  int points = 2500;  ///< of the data in the fine stage, approximately, [100, 1000000]
};

struct GlobalRegistration {
  Registration best;  ///< T_model_data
  bool accepted = false;
  double ambiguity = 0.0;          ///< score of the second best pose over the best's, [0, 1]
  std::vector<Hypothesis> ranked;  ///< refined, the best first
};

/// A model to which data are registered. Allocates; not for a cycle.
class CloudMatcher {
 public:
  /// @param model  [m], finite
  CloudMatcher(const Points& model, const CloudParams& params);

  /// From a guess with an error of metres and tens of degrees.
  [[nodiscard]] WideAnswer search(const Points& data, const Pose& guess) const;
  /// Almost without a guess: within GlobalParams::radius_m, of any heading.
  [[nodiscard]] GlobalRegistration search_globally(const Points& data, const Pose& guess);
  /// From a guess with an error of decimetres.
  /// @return with T_target_vehicle = T_model_data
  [[nodiscard]] Registration refine(const Points& data, const Pose& guess);
  /// From two guesses: the first result, unless the other pairs clearly more of the data.
  [[nodiscard]] Registration refine_better(const Points& data, const Pose& one, const Pose& other);

 private:
  CloudParams params_;
  RollingMap map_;
  WideMap wide_;
  IcpWorkspace workspace_;
};

/// From the result of search(), and from the guess itself, if that is better: structure in only one
/// of the clouds can mislead a search with a large initial error.
/// @param data  [m], finite, from one position: its origin is the position of the LADAR
/// @param guess  approximate T_model_data
/// @return with T_target_vehicle = T_model_data
[[nodiscard]] Registration register_clouds(const Points& model, const Points& data,
                                           const Pose& guess, const CloudParams& params);

/// Agreement of the clouds at a pose: registration of unrelated clouds returns a pose, too.
/// @param model, data  [m], finite, at least one point each
[[nodiscard]] Agreement clouds_at(const Points& model, const Points& data, const Pose& T_model_data,
                                  const CloudParams& params);
[[nodiscard]] bool agree(const Agreement& agreement, const CloudParams& params);

}  // namespace rcs::registration
