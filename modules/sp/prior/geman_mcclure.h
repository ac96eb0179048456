#pragma once
// Geman-McClure's robust cost.

namespace rcs::sp {

/// Half the squared residual, bounded by half of `robust` squared.
inline double robust_cost(double u, double robust) {
  const double v = u / robust;
  return 0.5 * u * u / (1.0 + v * v);
}
/// Its weight in iteratively reweighted least squares.
inline double robust_weight(double u, double robust) {
  const double v = u / robust;
  const double k = 1.0 + v * v;
  return 1.0 / (k * k);
}

}  // namespace rcs::sp
