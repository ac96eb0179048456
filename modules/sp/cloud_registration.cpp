#include "modules/sp/cloud_registration.h"

#include <algorithm>
#include <limits>

namespace rcs::sp {
namespace {

RollingMap map_of(const Points& model, RollingMapParams params) {
  params.capacity = std::max(1000, static_cast<int>(model.size()));
  RollingMap map(params);
  map.insert(model, Pose{});
  return map;
}

}  // namespace

CloudParams::CloudParams() {
  // One scan is the whole model: few points must do.
  map.min_points = 4;
  map.max_thickness = 0.3;
  map.min_extent = 0.05;
  map.radius_m = 500.0;
  icp.step_sigma = 0.3;
}

CloudMatcher::CloudMatcher(const Points& model, const CloudParams& params)
    : params_(params), map_(map_of(model, params.map)), wide_(map_, params.wide_map) {}

WideAnswer CloudMatcher::search(const Points& data, const Pose& guess) const {
  return search_wide(data, wide_, guess, params_.wide);
}

Registration CloudMatcher::refine(const Points& data, const Pose& guess) {
  Prediction prediction;
  prediction.T_target_vehicle = guess;
  constexpr double kSigma_m = 0.3;
  constexpr double kSigma_rad = 0.03;
  prediction.covariance.diagonal() << Vec3::Constant(kSigma_m * kSigma_m),
      Vec3::Constant(kSigma_rad * kSigma_rad);
  return register_points(thinned(data, params_.points), &map_, prediction, params_.icp,
                         std::numeric_limits<WorkUnits>::max(), &workspace_);
}

Registration register_clouds(const Points& model, const Points& data, const Pose& guess,
                             const CloudParams& params) {
  if (model.empty() || data.empty()) return {};
  CloudMatcher matcher(model, params);
  return matcher.refine(data, matcher.search(data, guess).T_target_vehicle);
}

}  // namespace rcs::sp
