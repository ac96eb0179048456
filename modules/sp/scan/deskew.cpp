#include "modules/sp/scan/deskew.h"

#include <algorithm>
#include <cstdint>

#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

struct Knot {
  Mat3f R = Mat3f::Identity();
  Vec3f t = Vec3f::Zero();
};

}  // namespace

void deskew(const MotionTable& motion, Scan* scan) {
  const std::size_t n = scan->points.size();
  RCS_CHECK(scan->dt_us.size() == n && motion.T_reference_vehicle.size() >= 2);
  const auto last_knot = static_cast<std::int64_t>(motion.T_reference_vehicle.size()) - 2;
  const float per_step = 1.0F / static_cast<float>(motion.step.count());
  std::int64_t current = -1;
  Knot a;
  Knot b;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t since = scan->dt_us[i] - motion.first.count();
    const std::int64_t k = std::clamp(since / motion.step.count(), std::int64_t{0}, last_knot);
    if (k != current) {  // seldom: points are nearly in order of time
      const Pose& T0 = motion.T_reference_vehicle[static_cast<std::size_t>(k)];
      const Pose& T1 = motion.T_reference_vehicle[static_cast<std::size_t>(k) + 1];
      a = {T0.rotation().cast<float>(), T0.p.cast<float>()};
      b = {T1.rotation().cast<float>(), T1.p.cast<float>()};
      current = k;
    }
    const float u = static_cast<float>(since - k * motion.step.count()) * per_step;
    const Vec3f p = scan->points[i];
    const Vec3f p0 = a.R * p + a.t;
    const Vec3f p1 = b.R * p + b.t;
    const Vec3f moved = p0 + u * (p1 - p0);
    scan->points.x[i] = moved.x();
    scan->points.y[i] = moved.y();
    scan->points.z[i] = moved.z();
  }
  std::fill(scan->dt_us.begin(), scan->dt_us.end(), 0);
}

}  // namespace rcs::sp
