#pragma once
// Converts LADAR measurements to points in the vehicle frame: mount, pan/tilt and calibration.

#include <cstdint>
#include <vector>

#include "modules/sp/scan/scan.h"
#include "rcs/base/pose.h"

namespace rcs::sp {

/// A range-imaging LADAR on a pan/tilt head (paper, section 3), or a driver of Cartesian points.
struct LadarParams {
  int sensor_id = 0;                 ///< facets of other LADARs are rejected
  int rows = 32;                     ///< of the range image, row 0 lowest
  int cols = 180;                    ///< column 0 leftmost
  double fov_v_rad = radians(20.0);  ///< rows cover it in equal cells
  double fov_h_rad = radians(90.0);  ///< columns likewise
  double min_range_m = 1.0;          ///< nearer returns are of the vehicle itself
  double max_range_m = 60.0;
  /// A return that differs from all its neighbours by more than this and 5 % of its range is a
  /// mixed pixel: light of an edge and of the surface behind it. 0: all are kept
  double isolated_m = 0.3;
  Pose T_vehicle_mount;  ///< of the pan/tilt head at pan = tilt = 0
};

/// One facet of a range image; a view onto a message.
struct RangeFacet {
  const float* range_m = nullptr;  ///< facet_rows x cols by rows; 0: no return
  int first_row = 0;
  int facet_rows = 0;   ///< 0: no returns in this facet
  Duration start{};     ///< first shot, after the scan's reference instant
  Duration duration{};  ///< column c is measured at start + duration * c / cols
  double pan_rad = 0.0;
  double tilt_rad = 0.0;  ///< positive up
  double pan_rate_radps = 0.0;
  double tilt_rate_radps = 0.0;
};

/// A part of a scan that is received as points; a view onto a message.
struct PointFacet {
  const float* x_m = nullptr;  ///< ladar frame
  const float* y_m = nullptr;
  const float* z_m = nullptr;
  const std::int32_t* dt_us = nullptr;  ///< after `start`; null: all at the reference instant
  std::size_t n = 0;
  Duration start{};
};

struct ConversionCount {
  std::int64_t returns = 0;
  std::int64_t missing = 0;     ///< no return (range 0)
  std::int64_t lone = 0;        ///< mixed pixels
  std::int64_t rejected = 0;    ///< not finite, or outside [min_range_m, max_range_m]
  std::int64_t not_finite = 0;  ///< of those rejected
};

/// Converts facets to points in the vehicle frame, each at its own time.
class Calibration {
 public:
  explicit Calibration(const LadarParams& params);

  /// Appends the facet's returns to `scan`. A facet that does not fit the image (rows outside) is a
  /// bug of the caller: SpNode checks messages.
  ConversionCount append(const RangeFacet& facet, Scan* scan) const;
  ConversionCount append(const PointFacet& facet, Scan* scan) const;

  [[nodiscard]] const LadarParams& params() const { return params_; }

 private:
  [[nodiscard]] bool is_lone(const RangeFacet& facet, int row, int col) const;
  [[nodiscard]] Pose vehicle_from_ladar(const RangeFacet& facet, double t_s) const;

  LadarParams params_;
  std::vector<Vec3f> direction_ladar_;  // of each cell, rows x cols
};

}  // namespace rcs::sp
