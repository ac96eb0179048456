#pragma once
// Reads the points of a sensor_msgs/PointCloud2 from an untrusted publisher, with the layouts of
// common drivers.

#include <cstdint>
#include <string_view>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/ros2/sensor_types.h"

namespace rcs::ros2 {

struct CloudLimits {
  std::size_t max_points = 300'000;                  ///< height * width
  double max_range_m = 1000.0;                       ///< farther points are omitted
  Duration max_duration = from_milliseconds(500.0);  ///< between two points, and to the stamp
};

/// Why a cloud is rejected as a whole.
enum class CloudFault {
  kNone,
  kBigEndian,
  kTooManyPoints,
  kNoCoordinates,  ///< x, y or z is missing or is not float32 or float64
  kTimeType,       ///< a known time field of an unknown type
  kPointStep,      ///< a field is outside of its point
  kSize,           ///< row_step or the number of bytes contradicts height, width and point_step
  kTimes,          ///< times of points are not finite or too far from the stamp
  kEmpty,          ///< no point is valid
};
[[nodiscard]] std::string_view name_of(CloudFault fault);

/// The valid points of a cloud, in the order of the message and in its frame.
struct CloudPoints {
  std::vector<float> x_m;
  std::vector<float> y_m;
  std::vector<float> z_m;
  /// After the stamp of the message, may be negative [us]; empty: the cloud has no times.
  std::vector<std::int32_t> dt_us;
  std::size_t omitted = 0;  ///< not finite, too far, or (0, 0, 0): a ray without a return
};

/// Time fields: `t` and `offset_time` (uint32, [ns] after the stamp), `time` (float32, [s] after
/// the stamp), `timestamp` (float64, [s] or [ns] since 1970, or [s] after the stamp; by its size).
/// No allocation beyond what the bytes of the message and the limits allow.
/// @param out  its buffers are reused; valid only for CloudFault::kNone
[[nodiscard]] CloudFault read_cloud(const msg::PointCloud2& cloud, const CloudLimits& limits,
                                    CloudPoints* out);

}  // namespace rcs::ros2
