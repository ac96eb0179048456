#pragma once
// KITTI raw recordings: sweeps of a Velodyne HDL-64E as files of (x, y, z, intensity), and the
// poses of the GPS/INS.

#include <cstdint>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "rcs/base/geodesy.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::importers {

constexpr int kSweepRows = 64;
/// The azimuth encoder of the HDL-64E counts 0.09 deg, with a return at every second count; at this
/// width 0.3 % of the returns share a cell (at 2000 columns 8 %).
constexpr int kSweepCols = 4000;
constexpr int kSweepFacets = 48;
constexpr std::size_t kMaxDatagramBytes = 60'000;

/// One revolution: clockwise seen from above, from rear to rear, so that the middle of its time is
/// ahead.
struct Sweep {
  Points points_ladar;            ///< x ahead, y left, z up [m]; finite, none at the origin
  std::vector<double> phase;      ///< of each point: share of the revolution, [0, 1)
  std::vector<std::int16_t> row;  ///< 0 lowest; empty if the sweep is not organized
  std::vector<std::int16_t> col;  ///< 0 at the begin of the sweep (rear left); empty as row
  std::int64_t not_finite = 0;    ///< points dropped
  std::int64_t no_return = 0;     ///< points at the origin, dropped

  [[nodiscard]] bool organized() const { return !row.empty(); }
};

/// Parses a .bin file. The file contains one row after another, top row first, each by
/// ascending azimuth from straight ahead: a new row begins where the azimuth wraps. A file with
/// another number of rows than 64 is kept as points without row and column.
/// @return an error if the size is not whole records of a .bin
[[nodiscard]] Result<Sweep> parse_sweep(const std::vector<std::uint8_t>& bytes,
                                        std::string_view name);

struct SweepTiming {
  std::int64_t scan_id = 0;
  Stamp start;               ///< of the revolution
  Duration period{};         ///< of the revolution; the reference instant is its middle
  bool point_times = false;  ///< false: all points have the time of the reference instant
};

/// The sweep in 48 azimuth sectors, in order of time; each point in exactly one.
/// @return an error if a sector exceeds one datagram
[[nodiscard]] Result<std::vector<ladar_points_t>> slice_sweep(const Sweep& sweep,
                                                              const SweepTiming& timing);

/// Time of the last measurement of a facet.
[[nodiscard]] Stamp facet_end(const SweepTiming& timing, int facet);

/// Geodetic pose of the frame `odom` of a recording (first pose of the IMU): the first OXTS packet.
struct OdomOrigin {
  Geodetic place;
  double roll_rad = 0.0;
  double pitch_rad = 0.0;
  double yaw_rad = 0.0;  ///< 0 east, counter-clockwise
};

/// A fix of differential quality at the IMU: the geodetic position of T_odom_imu.
[[nodiscard]] gps_fix_t to_fix(const Pose& T_odom_imu, const OdomOrigin& origin, Stamp stamp,
                               double sigma_m);

/// Reads calib_imu_to_velo.txt: lines "R: 9 numbers" and "T: 3 numbers" of T_ladar_vehicle.
/// @return T_vehicle_ladar
[[nodiscard]] Result<Pose> parse_imu_to_velo(std::string_view text, std::string_view name);

}  // namespace rcs::importers
