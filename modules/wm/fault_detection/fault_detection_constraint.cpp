// The INS against the non-holonomic constraint: needs no other source, so that it decides where the
// LADAR is poor and GPS is lost or suspect.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection/fault_detection.h"

namespace rcs::wm {
namespace {

// What the slip of the constraint's model does not contain.
constexpr double kFloor_mps = 0.05;
constexpr double kFloorShare = 0.005;  // of the speed
constexpr double kMean_s = 1.0;        // time constant: bumps average out

double floor_variance(const NavState& x) {
  const double share = kFloorShare * x.v_world.norm();
  return kFloor_mps * kFloor_mps + share * share;
}

}  // namespace

std::optional<double> FaultDetection::Drift::add(Stamp stamp, double value) {
  if (since == Stamp::min() || stamp < newest) *this = {stamp, stamp, value, value};
  mean += std::min(1.0, seconds(stamp - newest) / kMean_s) * (value - mean);
  newest = stamp;
  const double age_s = seconds(stamp - since);
  if (age_s < kMean_s) first = mean;
  if (age_s < 2.0 * kMean_s) return std::nullopt;
  return mean - first;
}

/// The velocity of the inertial motion across the vehicle's axis. A ground vehicle has none for
/// long.
void FaultDetection::test_ins_by_constraint(const OdometryParams& params, Stamp stamp) {
  if (!params.constrained) return;
  Vec2 ratio = Vec2::Constant(-1.0);  // to the left, upwards
  for (Inertial* inertial : {&inertial_new_, &inertial_young_, &inertial_}) {
    if (!inertial->subfilter.alive()) continue;
    const FilterState& s = inertial->subfilter.state;
    const Residual<2> r =
        non_holonomic(s.belief.x, params, std::sqrt(s.bookkeeping.stillness.variance_force));
    const Mat<2, 2> S = r.H * s.belief.P * r.H.transpose() + r.R;
    const double floor = floor_variance(s.belief.x);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      const std::optional<double> drift = inertial->across[k].add(stamp, r.r[axis]);
      if (drift) ratio[axis] = std::max(ratio[axis], *drift * *drift / (S(axis, axis) + floor));
    }
  }
  if (ratio.maxCoeff() < 0.0) return;
  ins_by_constraint_.add(ratio.maxCoeff() / limit_1_, stamp);
  ins_rises_.add(ratio.y() / limit_1_, stamp);
}

/// A slide violates it, too, but the LADAR then confirms the INS. No vehicle slides upwards: a
/// LADAR that confirms that follows the INS.
bool FaultDetection::violates_constraint(double ratio) const {
  const bool confirmed =
      ins_by_ladar_.tested != Stamp::min() && ins_by_ladar_.ratio < kCalm && !ladar_is_poor();
  return ins_by_constraint_.ratio > ratio && (!confirmed || ins_rises_.ratio > 1.0);
}

}  // namespace rcs::wm
