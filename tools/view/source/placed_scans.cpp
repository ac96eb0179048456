#include "tools/view/source/placed_scans.h"

#include <optional>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/base/byte_codec.h"
#include "tools/view/source/pose_history.h"

namespace rcs::view {
namespace {

constexpr std::size_t kMaxPoints = 1500;  // of a part
constexpr Duration kPoses = std::chrono::seconds(1);

template <class T>
void append(T value, std::string* out) {
  std::uint8_t bytes[sizeof(T)];
  wire::put(value, bytes);
  out->append(reinterpret_cast<const char*>(bytes), sizeof(T));
}

void append_part(const points_t& m, const Pose& T_world_vehicle, double stamp_s, std::string* out) {
  const std::size_t n = m.x_m.size();
  const std::size_t stride = (n + kMaxPoints - 1) / kMaxPoints;
  const std::size_t kept = (n + stride - 1) / stride;
  append(stamp_s, out);
  append(static_cast<std::uint32_t>(kept), out);
  append(std::uint32_t{0}, out);
  const Mat3 R = T_world_vehicle.rotation();
  for (std::size_t i = 0; i < n; i += stride) {
    const Vec3 p = R * Vec3(m.x_m[i], m.y_m[i], m.z_m[i]) + T_world_vehicle.p;
    for (int k = 0; k < 3; ++k) append(static_cast<float>(p[k]), out);
  }
}

}  // namespace

std::string placed_scans(LogIndex* index, const ros2::ClockOffsets& clocks, Duration time,
                         Duration span) {
  static const ChannelSet kPoints = channels_of(channel::kSpPoints);
  static const ChannelSet kNav = channels_of(channel::kWmNavState);
  PoseHistory poses((span + 2 * kPoses).count());
  LogEvent event;
  for (const std::size_t e : index->recent(time + kPoses, span + 2 * kPoses, kNav)) {
    if (index->read(e, &event)) poses.add_nav_state(event.data.data(), event.data.size());
  }
  std::string out;
  for (const std::size_t e : index->recent(time, span, kPoints)) {
    if (!index->read(e, &event)) continue;
    points_t m{};
    const int bytes = static_cast<int>(event.data.size());
    if (m.decode(event.data.data(), 0, bytes) != bytes || m.x_m.empty() ||
        m.y_m.size() != m.x_m.size() || m.z_m.size() != m.x_m.size()) {
      continue;
    }
    const std::optional<Pose> T_world_vehicle = poses.at(m.utime);
    if (!T_world_vehicle) continue;
    append_part(m, *T_world_vehicle,
                static_cast<double>(ros2::shifted(m.utime, clocks.sensor_us)) * 1e-6, &out);
  }
  return out;
}

}  // namespace rcs::view
