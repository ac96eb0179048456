#pragma once
// Two point clouds in, the motion between them out: the production method without a vehicle around
// it. For tools, and for others' programs.
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
  /// A global answer is given when it explains so much of the data, and the next best place is
  /// worth less than this share of it. Chosen on frames 5, 15, 25, ... of the KITTI drive.
  double accept_score = 0.7;
  double accept_ratio = 0.97;
  /// A pose is refused when the clouds agree less there: Agreement::overlap and ::least. Chosen on
  /// related and unrelated scans of six sensors (DECISIONS.md).
  AgreementParams agreement;
  double min_overlap = 0.2;
  double min_least = 0.2;
  int points = 2500;  ///< of the data in the fine stage, about, [100, 1000000]
};

struct GlobalRegistration {
  Registration best;  ///< T_model_data
  bool accepted = false;
  double ambiguity = 0.0;          ///< score of the second best place over the best's, [0, 1]
  std::vector<Hypothesis> ranked;  ///< refined, the best first
};

/// A model that data is registered to. Allocates; not for a cycle.
class CloudMatcher {
 public:
  /// @param model  [m], finite
  CloudMatcher(const Points& model, const CloudParams& params);

  /// From a guess that is metres and tens of degrees off.
  [[nodiscard]] WideAnswer search(const Points& data, const Pose& guess) const;
  /// From next to none: within GlobalParams::radius_m, of any heading.
  [[nodiscard]] GlobalRegistration search_globally(const Points& data, const Pose& guess);
  /// From one that is decimetres off.
  /// @return with T_target_vehicle = T_model_data
  [[nodiscard]] Registration refine(const Points& data, const Pose& guess);
  /// From two of them: the first answer, unless the other pairs clearly more of the data.
  [[nodiscard]] Registration refine_better(const Points& data, const Pose& one, const Pose& other);

 private:
  CloudParams params_;
  RollingMap map_;
  WideMap wide_;
  IcpWorkspace workspace_;
};

/// From where search() leads, and from the guess itself, if that is better: what only one of the
/// clouds has seen misleads a search from afar.
/// @param data  [m], finite, from one place: its origin is where the LADAR stood
/// @param guess  T_model_data, about
/// @return with T_target_vehicle = T_model_data
[[nodiscard]] Registration register_clouds(const Points& model, const Points& data,
                                           const Pose& guess, const CloudParams& params);

/// How far the clouds agree at a pose: a search ends somewhere for unrelated clouds, too.
/// @param model, data  [m], finite, at least one point each
[[nodiscard]] Agreement clouds_at(const Points& model, const Points& data, const Pose& T_model_data,
                                  const CloudParams& params);
[[nodiscard]] bool agree(const Agreement& agreement, const CloudParams& params);

}  // namespace rcs::registration
