#include "rcs/ros2/frames.h"

#include <algorithm>
#include <limits>

namespace rcs::ros2 {

msg::Time to_time(std::int64_t utime) {
  constexpr std::int64_t kMax = std::numeric_limits<std::int32_t>::max();
  if (utime < 0) return {};
  const std::int64_t sec = std::min(utime / 1'000'000, kMax);
  return {static_cast<std::int32_t>(sec), static_cast<std::uint32_t>(utime % 1'000'000) * 1000U};
}

std::int64_t shifted(std::int64_t utime, std::int64_t offset_us) {
  std::int64_t sum = 0;
  if (!__builtin_add_overflow(utime, offset_us, &sum)) return sum;
  return offset_us > 0 ? std::numeric_limits<std::int64_t>::max()
                       : std::numeric_limits<std::int64_t>::min();
}

msg::Pose to_pose(const Pose& T) {
  return {{T.p.x(), T.p.y(), T.p.z()}, {T.q.x(), T.q.y(), T.q.z(), T.q.w()}};
}

msg::Vector3 to_vector3(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

msg::TransformStamped to_transform(const msg::Time& stamp, const char* frame, const char* child,
                                   const Pose& T) {
  const msg::Pose pose = to_pose(T);
  return {{stamp, frame}, child, {to_vector3(T.p), pose.orientation}};
}

std::array<double, 36> fixed_axes_covariance(const Pose& T, const Mat6& cov) {
  Mat6 turn = Mat6::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = T.rotation();
  const Mat6 turned = turn * cov * turn.transpose();
  std::array<double, 36> out{};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) out[static_cast<std::size_t>(6 * i + j)] = turned(i, j);
  }
  return out;
}

}  // namespace rcs::ros2
