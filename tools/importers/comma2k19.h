#pragma once
// A minute of comma2k19's drives (Schafer et al. 2018) as messages: a phone behind the windscreen
// with IMU and u-blox receiver, the car's wheel speeds, and the poses that the data set gives as
// the truth. Pure.

#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "tools/base/trajectory.h"
#include "tools/importers/imu_gps_import.h"

namespace rcs::importers {

/// Files of a folder, as they are to be given.
struct CommaTables {
  std::vector<tools::CsvTable> sensors;  ///< imu_acc, imu_gyro, gnss_ublox, can_wheel_speed
  tools::CsvTable truth;                 ///< truth_pose
};
[[nodiscard]] Result<CommaTables> load_comma2k19(const std::string& folder);

/// What the files do not say. Defaults: measured on the first 20 s of Example_1 (segment 40 of
/// b0c9d2329ad1606b|2018-08-02--08-34-47) by check_setup().
struct CommaSetup {
  /// The device looks 3.7 deg down and 0.9 deg to the left of where the car drives. (Its roll is
  /// not to be told from the road's.)
  Vec3 mount_rpy_rad{0.0, radians(3.68), radians(0.85)};
  /// From the fix to the device, beyond the least delay that was seen.
  double gps_latency_s = 0.072;
  bool receiver_stamps = true;  ///< stamps by utc_ms; else by arrival
  /// u-blox M8 by its data sheet: 2.0 m circular error (50 %) with SBAS, that is 1.7 m an axis;
  /// up by the usual ratio of the dilutions, 1.5.
  double gps_sigma_m = 1.7;
  double gps_sigma_speed_mps = 0.1;    ///< the data sheet says 0.05, for a steady speed
  double wheel_sigma_speed_mps = 0.1;  ///< between truth and wheels in the first 20 s: 0.05
};

struct CommaCounts {
  ImportCounts sensors;
  RowCounts truth;
};

/// Adds INS, GPS_FIX, ODOMETRY and SIM_TRUTH to `log`. The vehicle frame is at the device, with
/// the car's axes.
[[nodiscard]] Result<CommaCounts> import_comma2k19(const CommaTables& tables,
                                                   const CommaSetup& setup,
                                                   recording::SensorLog* log);

/// What a stretch of the log says about the setup, held against its truth.
struct SetupCheck {
  std::size_t fixes = 0;
  double mount_pitch_rad = 0.0;  ///< beyond the setup's: 0 when the setup is right
  double mount_yaw_rad = 0.0;
  /// Beyond the setup's, with the antenna at the device. A constant error along the track would be
  /// taken for a latency: the residual says how well one latency explains all.
  double gps_latency_s = 0.0;
  double residual_along_m = 0.0;  ///< with that latency
  Vec3 fix_minus_truth_m =
      Vec3::Zero();        ///< mean, with that latency: forward, left, up of the course
  double raw_rms_m = 0.0;  ///< of the fixes as stamped, horizontally
};
/// @param begin, length  of the stretch, after the first truth
/// @return an error when fewer than 10 fixes at more than 2 m/s are in it
[[nodiscard]] Result<SetupCheck> check_setup(const recording::SensorLog& log, Duration begin,
                                             Duration length);

}  // namespace rcs::importers
