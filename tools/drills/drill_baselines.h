#pragma once
// WM's answer in a run of a drill against filters that go without some source: WM's own
// sub-filters, or runs of their own.

#include <array>
#include <string_view>

#include "tools/drills/drill_metrics.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// Squares of horizontal errors at the same instants, to be added up over seeds.
struct BaselineSums {
  std::size_t samples = 0;
  double fused_m2 = 0.0;
  double baseline_m2 = 0.0;

  [[nodiscard]] double fused_rms_m() const;
  [[nodiscard]] double baseline_rms_m() const;
  /// RMS of the fused answer over that of the baseline, neither below 0.2 m.
  [[nodiscard]] double ratio() const;
};
constexpr int kSubfilterKinds = 3;
using Baselines = std::array<BaselineSums, kSubfilterKinds>;  ///< by subfilter_t::KIND_*

/// While the stimuli last, against WM's own sub-filters.
[[nodiscard]] Baselines subfilter_baselines(const Drill& drill, const DrillRecord& record,
                                            const DrillErrors& errors);
/// The same against another run, twice a second.
[[nodiscard]] BaselineSums run_baseline(const Drill& drill, const DrillErrors& fused,
                                        const DrillRecord& baseline);

[[nodiscard]] std::string_view subfilter_name(int kind);

}  // namespace rcs::drills
