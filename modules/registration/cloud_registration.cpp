#include "modules/registration/cloud_registration.h"

#include <algorithm>
#include <limits>

namespace rcs::registration {
namespace {

RollingMap map_of(const Points& model, RollingMapParams params) {
  const auto most = std::max(1000, static_cast<int>(model.size()));
  // Dense scans have many points in a voxel, and tables that are too large cost time.
  constexpr int kDense = 20'000;
  params.capacity = most > kDense ? most / 4 : most;
  RollingMap map(params);
  map.insert(model, Pose{});
  if (!map.full() || params.capacity == most) return map;
  params.capacity = most;
  RollingMap larger(params);
  larger.insert(model, Pose{});
  return larger;
}

}  // namespace

CloudParams::CloudParams() {
  // One scan is the whole model: few points must suffice.
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

GlobalRegistration CloudMatcher::search_globally(const Points& data, const Pose& guess) {
  GlobalSearch search(data, &wide_, guess, params_.global, params_.wide);
  while (!search.go_on(std::numeric_limits<WorkUnits>::max())) {
  }
  GlobalRegistration out;
  Descent judge(thinned(data, params_.wide.points), &wide_, params_.wide.robust);
  double best_score = -1.0;
  for (const Hypothesis& h : search.ranked()) {
    const Registration r = refine(data, h.T_target_vehicle);
    if (!usable(r.stop)) continue;
    const double score = judge.score(WideMap::kVoxel_m.size() - 1, r.T_target_vehicle);
    out.ranked.push_back({r.T_target_vehicle, score});
    if (score <= best_score) continue;
    best_score = score;
    out.best = r;
  }
  keep_distinct(params_.global, out.ranked.size(), &out.ranked);
  if (out.ranked.empty()) return out;
  if (out.ranked.size() > 1) out.ambiguity = out.ranked[1].score / out.ranked[0].score;
  out.accepted =
      out.ranked[0].score >= params_.accept_score && out.ambiguity < params_.accept_ratio;
  return out;
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

Registration CloudMatcher::refine_better(const Points& data, const Pose& one, const Pose& other) {
  // Chosen on simulated scans with outliers, moving objects and half of the data outside the model:
  // there wrong results pair 50 to 70 % of the data, correct ones more.
  constexpr double kEnough = 0.7;
  constexpr double kClearly = 1.03;  // two results for about the same pose differ by less
  Registration a = refine(data, one);
  if (a.stop == Stop::kConverged && a.overlap > kEnough) return a;
  Registration b = refine(data, other);
  const auto worth = [](const Registration& r) { return usable(r.stop) ? r.overlap : 0.0; };
  return worth(b) > kClearly * worth(a) ? b : a;
}

Registration register_clouds(const Points& model, const Points& data, const Pose& guess,
                             const CloudParams& params) {
  if (model.empty() || data.empty()) return {};
  CloudMatcher matcher(model, params);
  return matcher.refine_better(data, matcher.search(data, guess).T_target_vehicle, guess);
}

Agreement clouds_at(const Points& model, const Points& data, const Pose& T_model_data,
                    const CloudParams& params) {
  RollingMap of_model = map_of(model, params.map);
  RollingMap of_data = map_of(data, params.map);
  return agreement(&of_model, &of_data, thinned(data, params.points), T_model_data,
                   params.agreement);
}

bool agree(const Agreement& agreement, const CloudParams& params) {
  return agreement.overlap >= params.min_overlap && agreement.least >= params.min_least;
}

}  // namespace rcs::registration
