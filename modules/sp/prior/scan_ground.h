#pragma once
// The ground of one scan as cells with slopes. The slopes of a scan do not contain the errors of a
// map to which it is matched.

#include <cstdint>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/points.h"

namespace rcs::sp {

struct ScanGroundCell {
  Vec3 p = Vec3::Zero();      ///< mean of its points: frame of R_level, origin of the vehicle [m]
  Vec2 slope = Vec2::Zero();  ///< of a plane through the cells around it; 0: too few of them
};

struct ScanGroundWorkspace {
  struct Bin {
    Vec3f sum = Vec3f::Zero();
    int points = 0;
    std::int32_t cell = -1;  ///< index of the result; negative: empty
  };
  std::vector<Bin> bins;
  std::vector<char> object;  ///< by cell: not 0 for what is above the ground
};

constexpr double kScanGroundCell_m = 0.5;

/// @param lowest_vehicle  the lowest points of columns of a scan [m]
/// @param R_level_vehicle  to a frame with z upwards
/// @param cells  row by row
void find_scan_ground(const Points& lowest_vehicle, const Mat3& R_level_vehicle,
                      ScanGroundWorkspace* workspace, std::vector<ScanGroundCell>* cells);

}  // namespace rcs::sp
