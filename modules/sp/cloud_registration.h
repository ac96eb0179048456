#pragma once
// Two point clouds in, the motion between them out: the production method without a vehicle around
// it. For tools, and for others' programs.
//
//   const Registration r = register_clouds(model, data, Pose{}, CloudParams{});
//   if (usable(r.stop)) use(r.T_target_vehicle);  // maps data into the model's frame

#include "modules/sp/icp.h"
#include "modules/sp/registration.h"
#include "modules/sp/rolling_map.h"
#include "modules/sp/wide_search.h"

namespace rcs::sp {

struct CloudParams {
  CloudParams();
  WideMapParams wide_map;
  WideParams wide;
  RollingMapParams map;
  IcpParams icp;
  int points = 2500;  ///< of the data in the fine stage, about, [100, 1000000]
};

/// A model that data is registered to. Allocates; not for a cycle.
class CloudMatcher {
 public:
  /// @param model  [m], finite
  CloudMatcher(const Points& model, const CloudParams& params);

  /// From a guess that is metres and tens of degrees off.
  [[nodiscard]] WideAnswer search(const Points& data, const Pose& guess) const;
  /// From one that is decimetres off.
  /// @return with T_target_vehicle = T_model_data
  [[nodiscard]] Registration refine(const Points& data, const Pose& guess);

 private:
  CloudParams params_;
  RollingMap map_;
  WideMap wide_;
  IcpWorkspace workspace_;
};

/// search() and refine().
/// @param data  [m], finite, from one place: its origin is where the LADAR stood
/// @param guess  T_model_data, about
/// @return with T_target_vehicle = T_model_data
[[nodiscard]] Registration register_clouds(const Points& model, const Points& data,
                                           const Pose& guess, const CloudParams& params);

}  // namespace rcs::sp
