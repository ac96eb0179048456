#include "rcs/ros2/cloud_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "rcs/base/byte_codec.h"
#include "rcs/ros2/frames.h"

namespace rcs::ros2 {
namespace {

enum Datatype : std::uint8_t { kUint32 = 6, kFloat32 = 7, kFloat64 = 8 };

enum class TimeKind { kNone, kNanoseconds, kSeconds, kTimestamp };

struct Layout {
  std::array<const msg::PointField*, 3> xyz{};
  const msg::PointField* time = nullptr;
  TimeKind kind = TimeKind::kNone;
};

const msg::PointField* find(const msg::PointCloud2& cloud, std::string_view name) {
  const auto at = std::find_if(cloud.point_fields.begin(), cloud.point_fields.end(),
                               [&](const msg::PointField& f) { return f.name == name; });
  return at == cloud.point_fields.end() ? nullptr : &*at;
}

std::uint32_t size_of(const msg::PointField& field) { return field.datatype == kFloat64 ? 8 : 4; }

bool inside(const msg::PointField& field, std::uint32_t point_step) {
  return field.count <= 1 && std::uint64_t{field.offset} + size_of(field) <= point_step;
}

CloudFault read_layout(const msg::PointCloud2& cloud, Layout* out) {
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  for (std::size_t i = 0; i < 3; ++i) {
    const msg::PointField* f = find(cloud, kAxes[i]);
    if (f == nullptr || (f->datatype != kFloat32 && f->datatype != kFloat64)) {
      return CloudFault::kNoCoordinates;
    }
    if (!inside(*f, cloud.point_step)) return CloudFault::kPointStep;
    out->xyz[i] = f;
  }
  struct Known {
    const char* name;
    Datatype type;
    TimeKind kind;
  };
  constexpr Known kTimes[] = {{"t", kUint32, TimeKind::kNanoseconds},
                              {"offset_time", kUint32, TimeKind::kNanoseconds},
                              {"time", kFloat32, TimeKind::kSeconds},
                              {"timestamp", kFloat64, TimeKind::kTimestamp}};
  for (const Known& known : kTimes) {
    const msg::PointField* f = find(cloud, known.name);
    if (f == nullptr) continue;
    // Without its times a moving scan would be taken for a rigid one: not ignored.
    if (f->datatype != known.type) return CloudFault::kTimeType;
    if (!inside(*f, cloud.point_step)) return CloudFault::kPointStep;
    out->time = f;
    out->kind = known.kind;
    break;
  }
  return CloudFault::kNone;
}

/// Whether all points are within the bytes of the message.
bool sizes_agree(const msg::PointCloud2& cloud) {
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;  // below 2^64
  if (row > cloud.row_step) return false;
  return std::uint64_t{cloud.row_step} * cloud.height == cloud.data.size();
}

float coordinate(const std::uint8_t* point, const msg::PointField& field) {
  const std::uint8_t* at = point + field.offset;
  return field.datatype == kFloat64 ? static_cast<float>(wire::take<double>(at))
                                    : wire::take<float>(at);
}

/// Time after the stamp [us]; nullopt: not finite, or longer than any cloud.
std::optional<std::int64_t> after_stamp_us(const std::uint8_t* point, const Layout& layout,
                                           double stamp_s) {
  const std::uint8_t* at = point + layout.time->offset;
  if (layout.kind == TimeKind::kNanoseconds) return wire::take<std::uint32_t>(at) / 1000;
  double after_s = layout.kind == TimeKind::kSeconds ? static_cast<double>(wire::take<float>(at))
                                                     : wire::take<double>(at);
  if (layout.kind == TimeKind::kTimestamp) {
    // Seconds since 1970 have 10 digits in this century, and nanoseconds 19.
    constexpr double kMinEpoch_s = 1e8;
    constexpr double kMinEpoch_ns = 1e15;
    if (after_s >= kMinEpoch_ns) after_s *= 1e-9;
    if (after_s >= kMinEpoch_s) after_s -= stamp_s;
  }
  constexpr double kLongest_s = 1000.0;
  if (!(std::abs(after_s) <= kLongest_s)) return std::nullopt;
  return static_cast<std::int64_t>(std::lround(after_s * 1e6));
}

}  // namespace

std::string_view name_of(CloudFault fault) {
  switch (fault) {
    case CloudFault::kNone:
      return "valid";
    case CloudFault::kBigEndian:
      return "big-endian points";
    case CloudFault::kTooManyPoints:
      return "more points than max_points";
    case CloudFault::kNoCoordinates:
      return "no fields x, y and z of float32 or float64";
    case CloudFault::kTimeType:
      return "time field of an unknown type";
    case CloudFault::kPointStep:
      return "field outside of point_step";
    case CloudFault::kSize:
      return "row_step or data contradicts height, width and point_step";
    case CloudFault::kTimes:
      return "times of points too far from the stamp";
    case CloudFault::kEmpty:
      return "no valid point";
  }
  return "unknown";
}

CloudFault read_cloud(const msg::PointCloud2& cloud, const CloudLimits& limits, CloudPoints* out) {
  out->x_m.clear();
  out->y_m.clear();
  out->z_m.clear();
  out->dt_us.clear();
  out->omitted = 0;
  if (cloud.is_bigendian) return CloudFault::kBigEndian;
  if (std::uint64_t{cloud.height} * cloud.width > limits.max_points) {
    return CloudFault::kTooManyPoints;
  }
  Layout layout;
  if (const CloudFault fault = read_layout(cloud, &layout); fault != CloudFault::kNone) {
    return fault;
  }
  if (!sizes_agree(cloud)) return CloudFault::kSize;
  const double stamp_s = cloud.header.stamp.sec + 1e-9 * cloud.header.stamp.nanosec;
  const double max_range2_m2 = limits.max_range_m * limits.max_range_m;
  std::int64_t first_us = 0;
  std::int64_t last_us = 0;
  for (std::uint32_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* point = cloud.data.data() + std::size_t{row} * cloud.row_step;
    for (std::uint32_t i = 0; i < cloud.width; ++i, point += cloud.point_step) {
      const float x = coordinate(point, *layout.xyz[0]);
      const float y = coordinate(point, *layout.xyz[1]);
      const float z = coordinate(point, *layout.xyz[2]);
      const double range2_m2 = double{x} * x + double{y} * y + double{z} * z;
      if (!(range2_m2 > 0.0 && range2_m2 <= max_range2_m2)) {  // also NaN
        ++out->omitted;
        continue;
      }
      if (layout.time != nullptr) {
        const std::optional<std::int64_t> after_us = after_stamp_us(point, layout, stamp_s);
        if (!after_us || std::abs(*after_us) > limits.max_duration.count()) {
          return CloudFault::kTimes;
        }
        if (out->dt_us.empty()) first_us = last_us = *after_us;
        first_us = std::min(first_us, *after_us);
        last_us = std::max(last_us, *after_us);
        out->dt_us.push_back(static_cast<std::int32_t>(*after_us));
      }
      out->x_m.push_back(x);
      out->y_m.push_back(y);
      out->z_m.push_back(z);
    }
  }
  if (out->x_m.empty()) return CloudFault::kEmpty;
  return last_us - first_us > limits.max_duration.count() ? CloudFault::kTimes : CloudFault::kNone;
}

}  // namespace rcs::ros2
