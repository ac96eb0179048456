#pragma once
// A synthetic drive with faulty sensors: what the fault detection found, and the errors.

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "modules/wm/estimator.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {

struct Disturbance {
  std::function<Vec3(double t_s)> fix_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<Vec3(double t_s)> velocity_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<bool(double t_s)> has_fix = [](double) { return true; };
  /// Of positions and velocities of the fixes, about where the vehicle was at 40 s.
  std::function<double(double t_s)> turned_rad = [](double) { return 0.0; };
  double sigma_v_mps = 0.0;  ///< of the velocities of the fixes; 0: they have none
  std::function<bool(double t_s)> has_match = [](double) { return true; };
  std::function<Vec3(double t_s)> match_off = [](double) { return Vec3(Vec3::Zero()); };
  std::function<void(double t_s, RollingMatch* match)> match = [](double, RollingMatch*) {};
  std::function<Vec3(double t_s)> map_off;  ///< empty: there is no a priori map
  std::function<bool(double t_s)> has_ins = [](double) { return true; };
  std::function<void(double t_s, ImuSample* imu)> ins = [](double, ImuSample*) {};
  std::function<void(double t_s, OdometrySample* wheels)> wheels = [](double, OdometrySample*) {};
};

struct InsFault {
  std::string name;
  std::function<void(ImuSample* imu)> apply;
  bool large = true;  ///< must be found
};
InsFault gyro_bias(const Vec3& dps);
InsFault accel_bias(const Vec3& mps2);
InsFault exchanged_axes();  ///< x and y

struct Seen {
  std::vector<std::pair<double, Finding>> findings;
  double first_alert_s = -1.0;  ///< ALERT_GPS
  double first_ladar_alert_s = -1.0;
  double first_ins_alert_s = -1.0;
  double worst_m = 0.0;                                             ///< horizontal error
  double worst_local_step_m = 0.0;                                  ///< in addition to the motion
  double end_m = 0.0;                                               ///< error at the end
  double end_up_m = 0.0;                                            ///< of the height
  int beyond_protection = 0;                                        ///< samples, horizontal
  int above_protection = 0;                                         ///< samples, vertical
  double highest_level_up_m = 0.0;                                  ///< vertical protection level
  double lowest_level_m = std::numeric_limits<double>::infinity();  ///< horizontal
  int samples = 0;
  SourceStatus gps = SourceStatus::kNone;  ///< at the end
  SourceStatus ladar = SourceStatus::kNone;
  SourceStatus ins = SourceStatus::kNone;
  bool forces_excluded = false;  ///< at any time, without the rotation of the INS

  [[nodiscard]] bool found(Finding what) const {
    return std::any_of(findings.begin(), findings.end(),
                       [what](const auto& f) { return f.second == what; });
  }
};

/// @param from_s  begin of the evaluation
/// @param edge_rad  pitch at edges of the ground, DriveScript
Seen drive(double length_s, const Disturbance& d, unsigned seed = 1, double from_s = 20.0,
           double edge_rad = 0.0);

}  // namespace rcs::wm
