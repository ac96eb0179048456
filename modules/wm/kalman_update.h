#pragma once
// The measurement update, common to all sources.

#include <Eigen/Cholesky>
#include <limits>

#include "modules/wm/nav_state.h"

namespace rcs::wm {

/// Why a measurement was or was not fused; the values are those of innovation_t.
enum class Reason : int {
  kAccepted = 0,
  kGate = 1,        ///< NIS above the gate
  kInvalid = 2,     ///< not finite, implausible, or a stamp far in the future
  kLate = 3,        ///< older than the history
  kRepeated = 4,    ///< the same stamp again, or the same part of the map
  kNoDatum = 5,     ///< absolute, but the world is not georeferenced yet
  kEpoch = 6,       ///< not of the current map epoch
  kUnobserved = 7,  ///< no direction was observed
  kQuarantine = 8
};

/// One linearized measurement: r = measured - predicted ~ H * error + noise(R). Rows that are not
/// observed have r = 0, H = 0 and a unit diagonal in R, so that they have no effect; `dof` counts
/// the others.
template <int M>
struct Residual {
  static constexpr int kRows = M;
  Vec<M> r = Vec<M>::Zero();
  Mat<M, kSize> H = Mat<M, kSize>::Zero();
  Mat<M, M> R = Mat<M, M>::Identity();
  int dof = M;
};

template <int M>
struct Fusion {
  Belief belief;     ///< updated, or the given one when rejected
  double nis = 0.0;  ///< normalized innovation squared; chi-square with `dof` if the models hold
  Vec<M> sigma = Vec<M>::Zero();  ///< predicted standard deviation of the innovation
  Reason reason = Reason::kInvalid;
};

/// Moves the covariance into the tangent space of the state that was moved by `d` (reset of the
/// error, Sola 2017, section 6.3).
inline void reset_error(const ErrorState& d, Cov* P) {
  const Mat3 J = right_jacobian_so3(d.segment<3>(kAttitude));
  P->middleRows<3>(kAttitude) = (J * P->middleRows<3>(kAttitude)).eval();
  P->middleCols<3>(kAttitude) = (P->middleCols<3>(kAttitude) * J.transpose()).eval();
  Mat6 ad = Mat6::Zero();
  ad.topLeftCorner<3, 3>() = ad.bottomRightCorner<3, 3>() = hat(d.segment<3>(kRolling + 3));
  ad.topRightCorner<3, 3>() = hat(d.segment<3>(kRolling));
  const Mat6 K = Mat6::Identity() - 0.5 * ad + (1.0 / 6.0) * ad * ad;  // right Jacobian of SE(3)
  P->middleRows<6>(kRolling) = (K * P->middleRows<6>(kRolling)).eval();
  P->middleCols<6>(kRolling) = (P->middleCols<6>(kRolling) * K.transpose()).eval();
}

/// The part of a Kalman update that does not depend on the kind of the state.
template <int M>
struct Gain {
  Mat<kSize, M> K = Mat<kSize, M>::Zero();
  Cov P;  ///< updated, in the tangent space of the prior; not set when rejected
  double nis = 0.0;
  Vec<M> sigma = Vec<M>::Zero();
  Reason reason = Reason::kInvalid;
};

/// Joseph form.
/// @param gate  on the NIS; a measurement above it is rejected (kGate)
template <int M>
[[nodiscard]] Gain<M> gain_of(const Cov& P, const Residual<M>& z, double gate) {
  Gain<M> out;
  if (z.dof == 0) {
    out.reason = Reason::kUnobserved;
    return out;
  }
  Mat<kSize, M> PHt;
  PHt.noalias() = P * z.H.transpose();
  Mat<M, M> S = z.R;
  S.noalias() += z.H * PHt;
  out.sigma = S.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::LLT<Mat<M, M>> llt(S);
  if (llt.info() != Eigen::Success || !z.r.allFinite()) return out;
  out.nis = z.r.dot(llt.solve(z.r));
  if (!(out.nis <= gate)) {
    out.reason = Reason::kGate;
    return out;
  }
  out.K = llt.solve(PHt.transpose()).transpose();
  // (I - K H) P (I - K H)^T + K R K^T, as products of rank M.
  Cov AP = P;
  AP.noalias() -= out.K * PHt.transpose();
  Mat<kSize, M> AP_Ht_minus_KR;
  AP_Ht_minus_KR.noalias() = AP * z.H.transpose();
  AP_Ht_minus_KR.noalias() -= out.K * z.R;
  AP.noalias() -= AP_Ht_minus_KR * out.K.transpose();
  out.P = 0.5 * (AP + AP.transpose());
  out.reason = Reason::kAccepted;
  return out;
}

/// Kalman update; a measurement that is rejected changes nothing.
template <int M>
[[nodiscard]] Fusion<M> update(const Belief& b, const Residual<M>& z, double gate) {
  const Gain<M> g = gain_of(b.P, z, gate);
  Fusion<M> out{b, g.nis, g.sigma, g.reason};
  if (g.reason != Reason::kAccepted) return out;
  const ErrorState d = g.K * z.r;
  out.belief.x = boxplus(b.x, d);
  out.belief.P = g.P;
  reset_error(d, &out.belief.P);
  return out;
}

/// Attitude change by an update [rad].
inline double turn_of(const Belief& before, const Belief& after) {
  return log_so3(before.x.T_world_vehicle.q.conjugate() * after.x.T_world_vehicle.q).norm();
}

/// The velocity error in vehicle axes, R^T dv + (R^T v) x phi, instead of in world axes (invariant
/// error, Barrau and Bonnabel 2017): a vehicle whose heading is unknown drives along it, with the
/// speed that it has. In world axes that is true to first order only. A heading that is corrected
/// by 0.15 rad then changes the speed, and by the measured speed the filter seems to observe a
/// heading that it does not know.
class VehicleVelocity {
 public:
  explicit VehicleVelocity(const NavState& x)
      : R_(x.T_world_vehicle.q.toRotationMatrix()), v_(R_.transpose() * x.v_world) {}

  [[nodiscard]] ErrorState from_world(ErrorState d) const {
    d.segment<3>(kVelocity) =
        R_.transpose() * d.segment<3>(kVelocity) + v_.cross(d.segment<3>(kAttitude));
    return d;
  }
  [[nodiscard]] Cov from_world(Cov P) const {
    P.middleRows<3>(kVelocity) =
        (R_.transpose() * P.middleRows<3>(kVelocity) + hat(v_) * P.middleRows<3>(kAttitude)).eval();
    P.middleCols<3>(kVelocity) =
        (P.middleCols<3>(kVelocity) * R_ + P.middleCols<3>(kAttitude) * hat(v_).transpose()).eval();
    return P;
  }
  [[nodiscard]] Cov to_world(Cov P) const {
    P.middleRows<3>(kVelocity) =
        (R_ * (P.middleRows<3>(kVelocity) - hat(v_) * P.middleRows<3>(kAttitude))).eval();
    P.middleCols<3>(kVelocity) =
        ((P.middleCols<3>(kVelocity) - P.middleCols<3>(kAttitude) * hat(v_).transpose()) *
         R_.transpose())
            .eval();
    return P;
  }
  /// @param H  of errors at this state, the velocity in world axes
  template <int M>
  [[nodiscard]] Mat<M, kSize> from_world(Mat<M, kSize> H) const {
    const Mat<M, 3> of_velocity = H.template middleCols<3>(kVelocity) * R_;
    H.template middleCols<3>(kVelocity) = of_velocity;
    H.template middleCols<3>(kAttitude) -= of_velocity * hat(v_);
    return H;
  }
  [[nodiscard]] NavState moved(const NavState& x, const ErrorState& d) const {
    NavState y = boxplus(x, d);
    y.v_world = y.T_world_vehicle.q * (v_ + d.segment<3>(kVelocity));
    return y;
  }

 private:
  Mat3 R_;
  Vec3 v_;
};

/// Iterated update (Bell and Cathey 1993) for an attitude known to tens of degrees, where one
/// linearized step can end anywhere: linearizes again at the result of the last step. A small first
/// step is final. The gate applies to the NIS of the first linearization.
/// @param residual_at  NavState -> Residual<M>
/// @param max_turn_rad  the covariance of a measurement that rotates the attitude by more is
///   inflated until it does not: a measurement that does not observe the attitude contributes no
///   more at once
template <int M, class F>
[[nodiscard]] Fusion<M> update_iterated(const Belief& b, const F& residual_at, double gate,
                                        double max_turn_rad) {
  constexpr double kLinear_rad = 0.03;
  constexpr int kMaxIterations = 6;
  constexpr double kConverged = 1e-4;  // [rad, m, m/s]: far below any sigma
  constexpr double kNoGate = std::numeric_limits<double>::infinity();
  const Residual<M> first_residual = residual_at(b.x);
  Fusion<M> first = update(b, first_residual, gate);
  if (first.reason != Reason::kAccepted || turn_of(b, first.belief) <= kLinear_rad) return first;
  const VehicleVelocity prior(b.x);
  const Cov P = prior.from_world(b.P);
  const auto iterate = [&](double inflation) {
    Gain<M> g;
    ErrorState d = prior.from_world(boxminus(first.belief.x, b.x));
    for (int i = 0; i < kMaxIterations; ++i) {
      const NavState x = prior.moved(b.x, d);
      Residual<M> z = residual_at(x);
      z.H = VehicleVelocity(x).from_world(z.H);
      // In the tangent space of the prior, in which the prior's covariance is.
      z.H.template middleCols<3>(kAttitude) =
          (z.H.template middleCols<3>(kAttitude) * right_jacobian_so3(d.segment<3>(kAttitude)))
              .eval();
      z.r += z.H * d;
      z.R *= inflation;
      g = gain_of(P, z, kNoGate);
      if (g.reason != Reason::kAccepted) break;
      const ErrorState next = g.K * z.r;
      const bool converged = (next - d).template lpNorm<Eigen::Infinity>() < kConverged;
      d = next;
      if (converged) break;
    }
    Fusion<M> f{b, first.nis, first.sigma, g.reason};
    if (g.reason != Reason::kAccepted) return f;
    f.belief.x = prior.moved(b.x, d);
    reset_error(d, &g.P);
    f.belief.P = VehicleVelocity(f.belief.x).to_world(g.P);
    return f;
  };
  Fusion<M> out = iterate(1.0);
  for (double inflation = 4.0; turn_of(b, out.belief) > max_turn_rad && inflation < 1e7;
       inflation *= 4.0) {
    out = iterate(inflation);
  }
  return out;
}

/// Chi-square quantile by the cube root of Wilson and Hilferty: at 1e-4 up to 7 % too wide (dof 1).
/// @param false_alarm  upper tail, (0, 0.5)
[[nodiscard]] double chi_square_gate(int dof, double false_alarm);

}  // namespace rcs::wm
