#pragma once
// Order statistics of a set of values.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rcs::tools {

struct Summary {
  std::size_t count = 0;
  double mean = 0.0;
  double rms = 0.0;
  double p50 = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
  double max = 0.0;
};

/// The smallest value with at least `share` of the values at or below it (nearest rank).
/// @param ascending  not empty
/// @param share  in (0, 1]
[[nodiscard]] inline double percentile(const std::vector<double>& ascending, double share) {
  const double rank = std::ceil(share * static_cast<double>(ascending.size()));
  const std::size_t i = rank < 1.0 ? 0 : static_cast<std::size_t>(rank) - 1;
  return ascending[std::min(i, ascending.size() - 1)];
}

/// All zero for no values.
[[nodiscard]] inline Summary summarize(std::vector<double> values) {
  Summary s;
  s.count = values.size();
  if (values.empty()) return s;
  std::sort(values.begin(), values.end());
  const double n = static_cast<double>(values.size());
  for (const double v : values) {
    s.mean += v / n;
    s.rms += v * v / n;
  }
  s.rms = std::sqrt(s.rms);
  s.p50 = percentile(values, 0.50);
  s.p95 = percentile(values, 0.95);
  s.p99 = percentile(values, 0.99);
  s.max = values.back();
  return s;
}

}  // namespace rcs::tools
