#include "modules/sp/points_node.h"

#include <algorithm>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "modules/sp/sp_messages_node.h"

namespace rcs::sp {

PointsWriter::PointsWriter(Bus* bus) : out_(bus, channel::kSpPoints) {
  message_.x_m.reserve(kPointsPerMessage);
  message_.y_m.reserve(kPointsPerMessage);
  message_.z_m.reserve(kPointsPerMessage);
  out_.reserve(12 * kPointsPerMessage + 256);
}

void PointsWriter::reserve(std::size_t points) {
  sampler_.reserve(points);
  thinned_.reserve(points);
}

void PointsWriter::publish(const Points& scan, double voxel_m, const Pose& T_rolling_vehicle,
                           std::int64_t utime, std::int64_t scan_id, std::int32_t map_epoch) {
  points_t& m = message_;
  m.utime = utime;
  m.scan_id = scan_id;
  m.map_epoch = map_epoch;
  to_message(T_rolling_vehicle, m.q_rolling_vehicle, m.p_rolling_vehicle_m);
  sampler_.sample(scan, voxel_m, &thinned_);
  const std::size_t parts = (thinned_.size() + kPointsPerMessage - 1) / kPointsPerMessage;
  m.part_count = static_cast<std::int16_t>(parts);
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t begin = part * kPointsPerMessage;
    const std::size_t end = std::min(begin + kPointsPerMessage, thinned_.size());
    m.part = static_cast<std::int16_t>(part);
    fill(thinned_, begin, end, &m);
    out_.publish(&m);
  }
}

}  // namespace rcs::sp
