#pragma once
// One minute of comma2k19 (Schafer et al. 2018) as messages: a phone behind the windscreen with IMU
// and u-blox receiver, wheel speeds of the car, and the poses of the data set as the truth. Pure.

#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "tools/base/trajectory.h"
#include "tools/importers/imu_gps_import.h"

namespace rcs::importers {

/// The files of a folder.
struct CommaTables {
  std::vector<tools::CsvTable> sensors;  ///< imu_acc, imu_gyro, gnss_ublox, can_wheel_speed
  tools::CsvTable truth;                 ///< truth_pose
};
[[nodiscard]] Result<CommaTables> load_comma2k19(const std::string& folder);

/// Parameters that are not in the files. Defaults: measured on the first 20 s of Example_1 (segment
/// 40 of b0c9d2329ad1606b|2018-08-02--08-34-47) by check_setup().
struct CommaSetup {
  /// The device points 3.7 deg below and 0.9 deg to the left of the direction of motion. (Its roll
  /// cannot be separated from that of the road.)
  Vec3 mount_rpy_rad{0.0, radians(3.68), radians(0.85)};
  /// From the fix to its arrival at the device, in addition to the minimum observed delay.
  double gps_latency_s = 0.072;
  bool receiver_stamps = true;  ///< stamps by utc_ms; else by arrival
  /// u-blox M8, data sheet: 2.0 m circular error (50 %) with SBAS, i.e. 1.7 m per axis; up by the
  /// usual ratio of the dilutions, 1.5.
  double gps_sigma_m = 1.7;
  double gps_sigma_speed_mps = 0.1;    ///< data sheet: 0.05 at constant speed
  double wheel_sigma_speed_mps = 0.1;  ///< between truth and wheels in the first 20 s: 0.05
};

struct CommaCounts {
  ImportCounts sensors;
  RowCounts truth;
};

/// Adds INS, GPS_FIX, ODOMETRY and SIM_TRUTH to `log`. The vehicle frame is at the device, with the
/// axes of the car.
[[nodiscard]] Result<CommaCounts> import_comma2k19(const CommaTables& tables,
                                                   const CommaSetup& setup,
                                                   recording::SensorLog* log);

/// Errors of the setup, estimated from an interval of the log against the truth.
struct SetupCheck {
  std::size_t fixes = 0;
  double mount_pitch_rad = 0.0;  ///< error of the setup; 0 if it is correct
  double mount_yaw_rad = 0.0;
  /// Error of the setup, with the antenna at the device. A constant along-track error is not
  /// distinguished from a latency; the residual shows how well one latency explains the errors.
  double gps_latency_s = 0.0;
  double residual_along_m = 0.0;  ///< with that latency
  Vec3 fix_minus_truth_m =
      Vec3::Zero();        ///< mean, with that latency: forward, left, up of the course
  double raw_rms_m = 0.0;  ///< of the fixes as stamped, horizontally
};
/// @param begin, length  of the interval, after the first truth
/// @return an error if it has fewer than 10 fixes at more than 2 m/s
[[nodiscard]] Result<SetupCheck> check_setup(const recording::SensorLog& log, Duration begin,
                                             Duration length);

}  // namespace rcs::importers
