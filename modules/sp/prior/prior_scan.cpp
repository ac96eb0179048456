#include "modules/sp/prior/prior_scan.h"

namespace rcs::sp {

void PriorScan::reserve(std::size_t points) {
  columns_.reserve(points);
  voxels_.reserve(points);
  for (Points* p : {&ground_, &all_standing_, &standing_}) p->reserve(points);
}

void PriorScan::take(const Points& scan, const Vec3& up_vehicle, int max_standing,
                     const PriorScanParams& params) {
  columns_.sample(scan, up_vehicle, params.column_m, &ground_);
  standing_.clear();
  if (max_standing <= 0) return;
  columns_.standing(scan, params.standing_m, &all_standing_);
  voxels_.sample(all_standing_, params.voxel_m, &standing_);
  registration::keep_evenly(static_cast<std::size_t>(max_standing), &standing_);
}

}  // namespace rcs::sp
