#include "modules/registration/cloud_registration.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "modules/registration/voxel_sampler.h"

namespace rcs::registration {
namespace {

constexpr WorkUnits kNoLimit = std::numeric_limits<WorkUnits>::max();

Prediction prediction_at(const Pose& guess) {
  Prediction prediction;
  prediction.T_target_vehicle = guess;
  constexpr double kSigma_m = 0.3;
  constexpr double kSigma_rad = 0.03;
  prediction.covariance.diagonal() << Vec3::Constant(kSigma_m * kSigma_m),
      Vec3::Constant(kSigma_rad * kSigma_rad);
  return prediction;
}

Points fine_points(const Points& cloud, const CloudParams& params) {
  const auto share = static_cast<int>(params.point_share * static_cast<double>(cloud.size()));
  return thinned(cloud, std::max(params.points, share));
}

}  // namespace

CloudParams::CloudParams() { icp.step_sigma = 0.3; }

CloudMatcher::CloudMatcher(const Points& model, const Points& data, const CloudParams& params)
    : params_(params),
      model_(model, params.cloud),
      data_(data, params.cloud),
      model_points_(fine_points(model, params)),
      data_points_(fine_points(data, params)),
      few_(thinned(data, params.few_points)) {}

Registration CloudMatcher::refine_few(const Pose& guess) {
  return register_points(few_, model_.map(), prediction_at(guess), params_.icp, kNoLimit,
                         &workspace_);
}

Registration CloudMatcher::refine(const Pose& guess) {
  const Counterpart counterpart{&model_points_, data_.map()};
  return register_both_ways(data_points_, model_.map(), counterpart, prediction_at(guess),
                            params_.icp, kNoLimit, &workspace_);
}

void CloudMatcher::add(const std::vector<Hypothesis>& proposed, std::vector<Hypothesis>* refined) {
  for (const Hypothesis& h : proposed) {
    if (h.score < params_.min_count_share * proposed[0].score) break;
    const Registration r = refine_few(h.T_target_vehicle);
    if (!usable(r.stop)) continue;
    const Plausibility p = plausibility(&model_, &data_, r.T_target_vehicle, params_.tolerance_m);
    refined->push_back({r.T_target_vehicle, p.score()});
  }
  keep_distinct(refined);
}

void CloudMatcher::keep_distinct(std::vector<Hypothesis>* refined) const {
  std::stable_sort(refined->begin(), refined->end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.score > b.score; });
  std::vector<Hypothesis> kept;
  for (const Hypothesis& h : *refined) {
    const bool is_new = std::none_of(kept.begin(), kept.end(), [&](const Hypothesis& better) {
      const Pose off = better.T_target_vehicle.inverse() * h.T_target_vehicle;
      return off.p.norm() < params_.apart_m && log_so3(off.q).norm() < params_.apart_rad;
    });
    if (is_new) kept.push_back(h);
  }
  *refined = std::move(kept);
}

bool CloudMatcher::convinces(const std::vector<Hypothesis>& ranked) {
  if (ranked.empty() || ranked[0].score < params_.convincing) return false;
  const bool clear = ranked.size() == 1 || ranked[1].score < params_.clearly * ranked[0].score;
  return clear && accepted(judge(ranked[0].T_target_vehicle), params_);
}

bool CloudMatcher::is_far(const Pose& T_model_data, const Pose& guess) const {
  const Pose off = guess.inverse() * T_model_data;
  return off.p.norm() > 2.0 * params_.near.radius_m ||
         log_so3(off.q).norm() > 2.0 * params_.near.turn_rad;
}

std::vector<Hypothesis> CloudMatcher::search(const Pose& guess) {
  std::vector<Hypothesis> refined;
  far_ = false;
  const Pose base = on_common_ground(model_, data_, guess);
  add(correlate(model_, data_, base, params_.near, params_.correlation), &refined);
  // Where structure repeats itself, the cells of the search may prefer another period.
  add({{guess, 0.0}}, &refined);
  if (convinces(refined)) return refined;
  add(correlate(model_, data_, base, {params_.near.radius_m, kPi}, params_.correlation), &refined);
  far_ = !refined.empty() && is_far(refined[0].T_target_vehicle, guess);
  if (convinces(refined)) return refined;
  // Without a common ground, or with next to no structure.
  const WideMap wide(*model_.map(), params_.wide_map);
  const Pose coarse = search_wide(data_points_, wide, guess, params_.wide).T_target_vehicle;
  add({{coarse, 0.0}}, &refined);
  add(correlate(model_, data_, coarse, params_.near, params_.correlation), &refined);
  far_ = !refined.empty() && is_far(refined[0].T_target_vehicle, guess);
  return refined;
}

std::vector<Hypothesis> CloudMatcher::search_globally(const Pose& guess) {
  std::vector<Hypothesis> refined;
  far_ = false;
  CorrelationParams correlation = params_.correlation;
  correlation.candidates = params_.global_candidates;
  add(correlate(model_, data_, on_common_ground(model_, data_, guess),
                {params_.global_radius_m, kPi}, correlation),
      &refined);
  return refined;
}

Verdict CloudMatcher::judge(const Pose& T) {
  return {plausibility(&model_, &data_, T, params_.tolerance_m),
          agreement(model_.map(), data_.map(), few_, T, params_.agreement)};
}

/// Another hypothesis counts if it is another result. It is refined with few points only, and may
/// still be on its way to the best one; and next to that one every street has weaker optima.
double CloudMatcher::ambiguity(const CloudRegistration& found, double score) {
  constexpr double kSame_m = 0.1;
  constexpr double kSame_rad = 0.01;
  for (std::size_t k = 1; k < found.ranked.size(); ++k) {
    const Hypothesis& other = found.ranked[k];
    const double share = std::clamp(other.score / score, 0.0, 1.0);
    if (share < found.max_ambiguity) return share;
    const auto within = [&](const Pose& T, double m, double rad) {
      const Pose off = found.best.T_target_vehicle.inverse() * T;
      return off.p.norm() < m && log_so3(off.q).norm() < rad;
    };
    const bool near = within(other.T_target_vehicle, params_.nearby_m, params_.nearby_rad);
    if (near && share < params_.max_ambiguity_near) continue;
    const Registration r = refine(other.T_target_vehicle);
    if (!usable(r.stop) || !within(r.T_target_vehicle, kSame_m, kSame_rad)) return share;
  }
  return 0.0;
}

CloudRegistration CloudMatcher::conclude(std::vector<Hypothesis> ranked) {
  CloudRegistration out;
  out.ranked = std::move(ranked);
  if (out.ranked.empty()) return out;
  out.best = refine(out.ranked[0].T_target_vehicle);
  if (!usable(out.best.stop)) return out;
  out.verdict = judge(out.best.T_target_vehicle);
  const double score = out.verdict.plausibility.score();
  out.max_ambiguity = std::clamp(params_.ambiguity_of_score * score, 0.0,
                                 far_ ? params_.max_ambiguity_far : params_.max_ambiguity);
  if (score > 0.0) out.ambiguity = ambiguity(out, score);
  out.accepted = out.best.stop == Stop::kConverged &&
                 registration::accepted(out.verdict, params_) && out.ambiguity < out.max_ambiguity;
  return out;
}

bool plausible(const Verdict& verdict, const CloudParams& params) {
  const Plausibility& p = verdict.plausibility;
  return p.score() >= params.min_score && p.contradicted <= params.max_contradicted * p.explained &&
         verdict.agreement.least >= params.min_least;
}

bool contradictory(const Verdict& verdict, const CloudParams& params) {
  constexpr double kMin = 0.05;  // moving objects
  const Plausibility& p = verdict.plausibility;
  return p.contradicted > kMin && p.contradicted > params.max_contradicted * p.explained;
}

bool accepted(const Verdict& verdict, const CloudParams& params) {
  return plausible(verdict, params) && verdict.agreement.undetermined.isZero();
}

CloudRegistration register_clouds(const Points& model, const Points& data, const Pose& guess,
                                  const CloudParams& params) {
  if (model.empty() || data.empty()) return {};
  CloudMatcher matcher(model, data, params);
  return matcher.conclude(matcher.search(guess));
}

}  // namespace rcs::registration
