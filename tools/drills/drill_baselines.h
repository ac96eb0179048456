#pragma once
// Errors of WM in a run of a drill against those of filters that exclude some source: the
// sub-filters of WM, or separate runs.

#include <array>
#include <string_view>

#include "tools/drills/drill_metrics.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// Sums of squared horizontal errors at the same instants, to be added over seeds.
struct BaselineSums {
  std::size_t samples = 0;
  double fused_m2 = 0.0;
  double baseline_m2 = 0.0;

  [[nodiscard]] double fused_rms_m() const;
  [[nodiscard]] double baseline_rms_m() const;
  /// RMS of the fused solution over that of the baseline, both at least 0.2 m.
  [[nodiscard]] double ratio() const;
};
constexpr int kSubfilterKinds = 3;
using Baselines = std::array<BaselineSums, kSubfilterKinds>;  ///< by subfilter_t::KIND_*

/// During the stimuli, against the sub-filters of WM.
[[nodiscard]] Baselines subfilter_baselines(const Drill& drill, const DrillRecord& record,
                                            const DrillErrors& errors);
/// The same against another run, twice per second.
[[nodiscard]] BaselineSums run_baseline(const Drill& drill, const DrillErrors& fused,
                                        const DrillRecord& baseline);

[[nodiscard]] std::string_view subfilter_name(int kind);

}  // namespace rcs::drills
