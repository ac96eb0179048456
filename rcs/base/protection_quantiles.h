#pragma once
// Quantiles of the protection levels, see integrity_t.

namespace rcs {

/// A Gaussian error exceeds this many standard deviations with a probability of 0.001: in the
/// plane, by the larger horizontal standard deviation, and along one axis.
inline constexpr double kHorizontalQuantile = 3.717;
inline constexpr double kVerticalQuantile = 3.291;

}  // namespace rcs
