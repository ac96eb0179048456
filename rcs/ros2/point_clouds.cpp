#include "rcs/ros2/point_clouds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcmtypes/rcs/message_fields.hpp"
#include "rcs/base/byte_codec.h"

namespace rcs::ros2 {
namespace {

constexpr int kMaxParts = 4096;
constexpr std::size_t kMaxPoints = std::size_t{1} << 24;  // of a scan; a message has 4 GB at most
enum Datatype : std::uint8_t { kUint16 = 4, kUint32 = 6, kFloat32 = 7 };

bool numbered(int part, int part_count) {
  return part >= 0 && part < part_count && part_count <= kMaxParts;
}

/// Appends `more`, or forgets all if only one of the two has a value for each of its points.
template <class T>
void append_optional(const std::vector<T>& more, std::size_t points, std::size_t points_before,
                     std::vector<T>* all) {
  if (more.size() == points && all->size() == points_before) {
    all->insert(all->end(), more.begin(), more.end());
  } else {
    all->clear();
  }
}

}  // namespace

std::optional<CloudPart> to_cloud_part(const ladar_points_t& m) {
  if (!lengths_match(m) || !numbered(m.facet, m.facet_count)) return std::nullopt;
  CloudPart out;
  out.scan_id = m.scan_id;
  out.part = m.facet;
  out.part_count = m.facet_count;
  out.reference_utime = m.reference_utime;
  const bool times = m.n_time == m.n;
  const bool rings = m.n_index == m.n;
  for (std::size_t i = 0; i < m.x_m.size(); ++i) {
    if (!std::isfinite(m.x_m[i]) || !std::isfinite(m.y_m[i]) || !std::isfinite(m.z_m[i])) continue;
    out.x_m.push_back(m.x_m[i]);
    out.y_m.push_back(m.y_m[i]);
    out.z_m.push_back(m.z_m[i]);
    if (times) out.utime.push_back(shifted(m.utime, m.dt_us[i]));
    if (rings) out.ring.push_back(static_cast<std::uint16_t>(std::max<std::int16_t>(m.row[i], 0)));
  }
  return out;
}

std::optional<CloudPart> to_cloud_part(const points_t& m) {
  if (!lengths_match(m) || !numbered(m.part, m.part_count)) return std::nullopt;
  CloudPart out;
  out.scan_id = m.scan_id;
  out.part = m.part;
  out.part_count = m.part_count;
  out.reference_utime = m.utime;
  for (std::size_t i = 0; i < m.x_m.size(); ++i) {
    if (!std::isfinite(m.x_m[i]) || !std::isfinite(m.y_m[i]) || !std::isfinite(m.z_m[i])) continue;
    out.x_m.push_back(m.x_m[i]);
    out.y_m.push_back(m.y_m[i]);
    out.z_m.push_back(m.z_m[i]);
  }
  return out;
}

std::optional<msg::PointCloud2> CloudJoiner::add(const CloudPart& part,
                                                 const ClockOffsets& clocks) {
  std::optional<msg::PointCloud2> ended;
  const auto count = static_cast<std::size_t>(part.part_count);
  if (!have_.empty() && (part.scan_id != scan_.scan_id || count != have_.size())) {
    ended = finish(clocks);
  }
  if (have_.empty()) {
    scan_ = CloudPart{};
    scan_.scan_id = part.scan_id;
    scan_.reference_utime = part.reference_utime;
    have_.assign(count, false);
    parts_ = 0;
  }
  const auto number = static_cast<std::size_t>(part.part);
  if (have_[number]) return ended;  // a repeated datagram
  if (scan_.x_m.size() + part.x_m.size() > kMaxPoints) return ended;
  have_[number] = true;
  ++parts_;
  const std::size_t before = scan_.x_m.size();
  const std::size_t points = part.x_m.size();
  scan_.x_m.insert(scan_.x_m.end(), part.x_m.begin(), part.x_m.end());
  scan_.y_m.insert(scan_.y_m.end(), part.y_m.begin(), part.y_m.end());
  scan_.z_m.insert(scan_.z_m.end(), part.z_m.begin(), part.z_m.end());
  append_optional(part.utime, points, before, &scan_.utime);
  append_optional(part.ring, points, before, &scan_.ring);
  return ended;
}

std::optional<msg::PointCloud2> CloudJoiner::completed(const ClockOffsets& clocks) {
  if (have_.empty() || parts_ < static_cast<int>(have_.size())) return std::nullopt;
  return finish(clocks);
}

std::optional<msg::PointCloud2> CloudJoiner::finish(const ClockOffsets& clocks) {
  if (have_.empty()) return std::nullopt;
  have_.clear();
  return to_point_cloud(scan_, frame_, clocks);
}

msg::PointCloud2 to_point_cloud(const CloudPart& scan, const std::string& frame,
                                const ClockOffsets& clocks) {
  const std::size_t n = scan.x_m.size();
  const bool times = n > 0 && scan.utime.size() == n;
  const bool rings = n > 0 && scan.ring.size() == n;
  const std::int64_t first =
      times ? *std::min_element(scan.utime.begin(), scan.utime.end()) : scan.reference_utime;
  msg::PointCloud2 out;
  out.header = {to_time(shifted(first, clocks.sensor_us)), frame};
  out.height = 1;
  out.width = static_cast<std::uint32_t>(n);
  out.is_dense = true;
  std::uint32_t at = 0;
  const auto add_field = [&](const char* name, std::uint8_t type, std::uint32_t bytes) {
    out.point_fields.push_back({name, at, type, 1});
    at += bytes;
    return at - bytes;
  };
  add_field("x", kFloat32, 4);
  add_field("y", kFloat32, 4);
  add_field("z", kFloat32, 4);
  const std::uint32_t t_at = times ? add_field("t", kUint32, 4) : 0;
  const std::uint32_t ring_at = rings ? add_field("ring", kUint16, 2) : 0;
  at = (at + 3U) / 4U * 4U;  // floats of all points are aligned
  out.point_step = at;
  out.row_step = at * out.width;
  out.data.resize(std::size_t{at} * n);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint8_t* p = out.data.data() + i * at;
    wire::put(scan.x_m[i], p);
    wire::put(scan.y_m[i], p + 4);
    wire::put(scan.z_m[i], p + 8);
    if (times) {
      // Unsigned: hostile stamps may differ by more than the range of int64.
      const std::uint64_t after_us =
          static_cast<std::uint64_t>(scan.utime[i]) - static_cast<std::uint64_t>(first);
      constexpr std::uint64_t kMax_us = std::numeric_limits<std::uint32_t>::max() / 1000U;
      wire::put(static_cast<std::uint32_t>(std::min(after_us, kMax_us) * 1000U), p + t_at);
    }
    if (rings) wire::put(scan.ring[i], p + ring_at);
  }
  return out;
}

}  // namespace rcs::ros2
