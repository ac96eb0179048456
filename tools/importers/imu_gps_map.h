#pragma once
// The column map: assigns columns of files to the fields of the messages of an IMU, a GPS receiver
// and wheels (`rcs import imu-gps`; config/import/*.toml).

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/params/params.h"

namespace rcs::importers {

/// A column with its sign: "-ax" is ax, inverted.
struct SignedColumn {
  std::string name;
  double sign = 1.0;
};

struct StampColumn {
  std::string column;
  double unit_s = 1.0;
  bool time_of_day = false;  ///< digits hhmmssmmm instead of a count of units
};

/// Conversion of stamps to times of validity: minus the latency, by the clock of the device or of
/// the receiver.
struct StreamMap {
  std::string file;  ///< the end of its name; empty: the only file
  StampColumn stamp;
  Duration latency{};
};

/// Vehicle axes are forward, left, up. The specific force points up at rest, with the size of
/// gravity.
struct ImuMap {
  StreamMap stream;
  std::string rate_file;                      ///< of the rates; empty: the same
  std::array<SignedColumn, 3> force;          ///< forward, left, up
  std::array<SignedColumn, 3> rate;           ///< about forward, left, up
  double force_unit = 1.0;                    ///< in m/s^2
  double rate_unit = 1.0;                     ///< in rad/s
  Quat q_vehicle_imu = Quat::Identity();      ///< after the choice of columns
  Duration max_gap = from_milliseconds(200);  ///< longer ones are not bridged
};

struct GpsMap {
  StreamMap stream;
  std::optional<StampColumn> receiver;  ///< time of the fix by the receiver
  std::string lat, lon, height;         ///< [deg], [deg], [m]
  bool ellipsoidal = true;
  double undulation_m = 0.0;  ///< geoid above ellipsoid, for heights above the geoid
  std::string speed, course;  ///< over ground; empty: no velocity
  double speed_unit = 1.0;    ///< in m/s
  double sigma_speed_mps = 0.0;
  double climb = 0.2;                      ///< sigma of the vertical velocity, share of the speed
  std::vector<std::string> sigma_columns;  ///< east, north, up; empty: sigma_m
  bool variances = false;                  ///< of sigma_columns
  Vec3 sigma_m = Vec3::Zero();             ///< east, north, up
  Vec3 sigma_scale = Vec3::Ones();         ///< factors on sigma_columns
  std::vector<std::string> changed_by;     ///< a row is a fix if one of these has changed
  std::vector<std::string> zero_is_missing;
  std::string fix;  ///< column: below fix_min the receiver has no fix
  double fix_min = 0.0;
  std::string satellites, hdop, vdop;  ///< columns; empty: unknown
};

struct WheelMap {
  StreamMap stream;
  std::vector<std::string> speed;  ///< columns: their mean
  double speed_unit = 1.0;         ///< in m/s
  double sigma_speed_mps = 0.0;
  std::string yaw_rate;  ///< to the left; empty: unknown
  double yaw_rate_unit = 1.0;
  double sigma_yaw_rate_radps = 0.0;
};

struct ImuGpsMap {
  std::optional<ImuMap> imu;
  std::optional<GpsMap> gps;
  std::optional<WheelMap> wheels;
};

/// @return an error with file, line, key and allowed values
[[nodiscard]] Result<ImuGpsMap> load_imu_gps_map(const ParamFile& file);

}  // namespace rcs::importers
