#include "tools/mcap/ladar_facets.h"

#include "modules/sp/scan/scan.h"
#include "modules/sp/sp_messages_node.h"

namespace rcs::mcap {
namespace {

sp::LadarParams unmounted(sp::LadarParams ladar) {
  ladar.T_vehicle_mount = Pose{};
  ladar.isolated_m = 0.0;
  return ladar;
}

}  // namespace

FacetPoints::FacetPoints(const sp::LadarParams& ladar) : calibration_(unmounted(ladar)) {}

std::optional<ros2::CloudPart> FacetPoints::operator()(const ladar_ranges_t& m) const {
  const std::optional<sp::FacetId> id = sp::identify(m, calibration_.params());
  if (!id) return std::nullopt;
  ros2::CloudPart out;
  out.scan_id = id->scan;
  out.part = id->facet;
  out.part_count = id->facet_count;
  out.reference_utime = m.reference_utime;
  sp::RangeFacet row = sp::view(m);
  const int rows = row.facet_rows;
  row.facet_rows = 1;
  sp::Scan scan;
  // Row by row, so that the row of each point is known.
  for (int k = 0; k < rows; ++k) {
    scan.clear();
    (void)calibration_.append(row, &scan);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      out.x_m.push_back(scan.points.x[i]);
      out.y_m.push_back(scan.points.y[i]);
      out.z_m.push_back(scan.points.z[i]);
      out.utime.push_back(m.reference_utime + scan.dt_us[i]);
      out.ring.push_back(static_cast<std::uint16_t>(row.first_row));
    }
    ++row.first_row;
    row.range_m += m.cols;
  }
  return out;
}

}  // namespace rcs::mcap
