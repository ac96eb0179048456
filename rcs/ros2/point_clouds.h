#pragma once
// Point clouds that come in parts (facets of a LADAR, messages of SP_POINTS) as one PointCloud2 for
// each scan.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/sensor_types.h"

namespace rcs::ros2 {

/// A part of a scan. The arrays have as many elements as x_m, or none where "optional".
struct CloudPart {
  std::int64_t scan_id = 0;
  int part = 0;
  int part_count = 1;
  std::int64_t reference_utime = 0;  ///< [us] of the scan
  std::vector<float> x_m;
  std::vector<float> y_m;
  std::vector<float> z_m;
  std::vector<std::int64_t> utime;  ///< of each point [us]; optional
  std::vector<std::uint16_t> ring;  ///< optional
};

/// nullopt: the arrays of the message differ in length, or its numbering is invalid. Points that
/// are not finite are omitted.
[[nodiscard]] std::optional<CloudPart> to_cloud_part(const ladar_points_t& m);  ///< frame `ladar`
[[nodiscard]] std::optional<CloudPart> to_cloud_part(const points_t& m);  ///< frame `base_link`

/// Joins the parts of a scan. A scan is finished by its last missing part, by a part of another
/// scan, or by finish(); parts that were not received are missing in it.
class CloudJoiner {
 public:
  explicit CloudJoiner(std::string frame) : frame_(std::move(frame)) {}

  /// @return a scan that another one has ended before it was complete
  std::optional<msg::PointCloud2> add(const CloudPart& part, const ClockOffsets& clocks);
  /// The scan, if all its parts are here. Call it after each add().
  std::optional<msg::PointCloud2> completed(const ClockOffsets& clocks);
  /// The incomplete scan at the end of the data.
  std::optional<msg::PointCloud2> finish(const ClockOffsets& clocks);

 private:
  CloudPart scan_;          // all parts so far
  std::vector<bool> have_;  // by number of the part; empty: no scan
  int parts_ = 0;
  std::string frame_;
};

/// Fields x, y, z (float32) and, if known, t (uint32, [ns] after the stamp) and ring (uint16). The
/// stamp is that of the first point, or the reference instant of a scan without times of points.
[[nodiscard]] msg::PointCloud2 to_point_cloud(const CloudPart& scan, const std::string& frame,
                                              const ClockOffsets& clocks);

}  // namespace rcs::ros2
