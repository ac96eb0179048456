#include "tools/drills/drill_baselines.h"

#include <algorithm>
#include <cmath>

#include "tools/drills/drill_limits.h"

namespace rcs::drills {
namespace {

double root_mean(double sum, std::size_t samples) {
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, samples)));
}

}  // namespace

double BaselineSums::fused_rms_m() const { return root_mean(fused_m2, samples); }

double BaselineSums::baseline_rms_m() const { return root_mean(baseline_m2, samples); }

double BaselineSums::ratio() const {
  return std::max(kRatioFloor_m, fused_rms_m()) / std::max(kRatioFloor_m, baseline_rms_m());
}

Baselines subfilter_baselines(const Drill& drill, const DrillRecord& record,
                              const DrillErrors& errors) {
  Baselines sums;
  const DrillWindow window{drill.begin_s(), drill.end_s()};
  for (const DrillSubfilter& s : record.subfilters) {
    if (s.kind < 0 || s.kind >= kSubfilterKinds || !window.contains(errors.time_s(s.stamp))) {
      continue;
    }
    const std::optional<DrillError> fused = errors.at(s.stamp);
    const std::optional<Pose> truth = errors.truth_at(s.stamp);
    if (!fused || !truth) continue;
    BaselineSums& sum = sums[static_cast<std::size_t>(s.kind)];
    ++sum.samples;
    sum.fused_m2 += fused->position_m.head<2>().squaredNorm();
    sum.baseline_m2 += (s.T_world_vehicle.p - truth->p).head<2>().squaredNorm();
  }
  return sums;
}

BaselineSums run_baseline(const Drill& drill, const DrillErrors& fused,
                          const DrillRecord& baseline) {
  constexpr double kEvery_s = 0.5;
  BaselineSums sum;
  const DrillErrors baseline_errors(baseline);
  const double end_s = std::min(drill.end_s(), baseline_errors.time_s(baseline.end));
  for (double t_s = drill.begin_s(); t_s < end_s; t_s += kEvery_s) {
    const std::optional<DrillError> a = fused.at(fused.stamp_at(t_s));
    const std::optional<DrillError> b = baseline_errors.at(baseline_errors.stamp_at(t_s));
    if (!a || !b) continue;
    ++sum.samples;
    sum.fused_m2 += a->position_m.head<2>().squaredNorm();
    sum.baseline_m2 += b->position_m.head<2>().squaredNorm();
  }
  return sum;
}

std::string_view subfilter_name(int kind) {
  static constexpr std::array<std::string_view, kSubfilterKinds> kNames = {
      "inertial", "without LADAR", "without GPS"};
  return kind >= 0 && kind < kSubfilterKinds ? kNames[static_cast<std::size_t>(kind)] : "unknown";
}

}  // namespace rcs::drills
