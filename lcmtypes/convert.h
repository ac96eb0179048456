#pragma once
// Conversion between message fields and the types of rcs/base. Decoded quaternions are normalized;
// non-finite or zero ones are rejected, because a message is untrusted input.

#include <cmath>
#include <cstdint>

#include "lcmtypes/rcs/registration_t.hpp"
#include "rcs/base/pose.h"

namespace rcs {

/// For static_assert, next to a conversion of an enumeration by its value.
template <class E>
constexpr bool same_value(E ours, std::int8_t of_message) {
  return static_cast<int>(ours) == of_message;
}

inline void to_message(const Vec3& v, double (&out)[3]) {
  for (int i = 0; i < 3; ++i) out[i] = v[i];
}

inline void to_message(const Pose& T, double (&q_wxyz)[4], double (&p_m)[3]) {
  q_wxyz[0] = T.q.w();
  q_wxyz[1] = T.q.x();
  q_wxyz[2] = T.q.y();
  q_wxyz[3] = T.q.z();
  to_message(T.p, p_m);
}

template <int N>
void to_message(const Mat<N, N>& m, double (&out)[N][N]) {
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) out[i][j] = m(i, j);
  }
}

inline Vec3 from_message(const double (&v)[3]) { return {v[0], v[1], v[2]}; }

template <int N>
Mat<N, N> from_message(const double (&m)[N][N]) {
  Mat<N, N> out;
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) out(i, j) = m[i][j];
  }
  return out;
}

/// False (and `T` untouched) when a component is not finite or |q| is far from 1.
[[nodiscard]] inline bool from_message(const double (&q_wxyz)[4], const double (&p_m)[3], Pose* T) {
  const Quat q(q_wxyz[0], q_wxyz[1], q_wxyz[2], q_wxyz[3]);
  const Vec3 p = from_message(p_m);
  const double n = q.norm();
  if (!p.allFinite() || !std::isfinite(n) || std::abs(n - 1.0) > 1e-3) return false;
  *T = {q.normalized(), p};
  return true;
}

/// True for the results (registration_t::STOP_*) whose pose and information are meaningful.
[[nodiscard]] inline bool is_answer(int stop) {
  switch (stop) {
    case registration_t::STOP_CONVERGED:
    case registration_t::STOP_MAX_ITERATIONS:
    case registration_t::STOP_BUDGET:
    case registration_t::STOP_LIMIT_CYCLE:
    case registration_t::STOP_DEGENERATE:
    case registration_t::STOP_SEEDED:
      return true;
    default:
      return false;
  }
}

}  // namespace rcs
