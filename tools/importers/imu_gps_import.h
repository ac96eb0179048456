#pragma once
// Converts tables of an IMU, a GPS receiver and wheels to messages. Pure.

#include <cstdint>
#include <optional>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/base/csv_table.h"
#include "tools/importers/imu_gps_map.h"
#include "tools/recording/sensor_log.h"

namespace rcs::importers {

/// Counts of the rows of a sensor.
struct RowCounts {
  std::int64_t rows = 0;
  std::int64_t written = 0;
  std::int64_t missing = 0;           ///< skipped: a cell was missing
  std::int64_t backward = 0;          ///< written: stamp not after the newest before it
  std::int64_t gaps = 0;              ///< of an IMU: not bridged
  std::int64_t unpaired = 0;          ///< of an IMU in two files: skipped
  std::int64_t unchanged = 0;         ///< of GPS: skipped, a repetition of the previous fix
  std::int64_t no_fix = 0;            ///< of GPS: skipped, no fix by the status
  std::int64_t implausible = 0;       ///< of GPS: skipped, invalid position or sigma
  std::int64_t without_velocity = 0;  ///< of GPS: written, but speed or course was missing
  std::int64_t clock_steps = 0;       ///< of the clock of the receiver against that of the device
};

struct ImportCounts {
  std::optional<RowCounts> imu;
  std::optional<RowCounts> gps;
  std::optional<RowCounts> wheels;
};

/// Maps stamps of a receiver to the clock of the device. Delays of messages vary and are never
/// negative, so the offset between the clocks is the minimum observed so far. Valid for some
/// minutes, while the drift of the clocks is negligible.
class ReceiverClock {
 public:
  /// @param receiver  time by the clock of the receiver, of any origin
  [[nodiscard]] Stamp device_time(Stamp arrival, Duration receiver);
  /// Restarts at offsets that no delay explains (midnight, a clock that is set).
  [[nodiscard]] std::int64_t steps() const { return steps_; }

 private:
  std::optional<Stamp> origin_;  // device time of receiver time 0
  std::int64_t steps_ = 0;
};

/// Converts samples of rate and specific force to increments: the integral of the linear
/// interpolation from the newest sample to the next. A sample that is not after the newest is held
/// for the duration of the previous interval.
class InsIntegrator {
 public:
  explicit InsIntegrator(Duration max_gap) : max_gap_(max_gap) {}
  enum class Step { kFirst, kForward, kBackward, kGap };
  /// @return kFirst, kGap: `out` is not written
  [[nodiscard]] Step add(Stamp stamp, const Vec3& rate_vehicle, const Vec3& force_vehicle,
                         ins_t* out);

 private:
  Duration max_gap_;
  std::optional<Stamp> newest_;
  Vec3 rate_ = Vec3::Zero();
  Vec3 force_ = Vec3::Zero();
  Duration interval_{};
};

/// Adds all sensors of the map to `log`. Stamps that run backward are kept; arrivals never run
/// backward.
/// @return an error with file, line and column; or with the file that is missing or not used
[[nodiscard]] Result<ImportCounts> import_imu_gps(const ImuGpsMap& map,
                                                  const std::vector<tools::CsvTable>& tables,
                                                  recording::SensorLog* log);

/// A column of stamps as times; nullopt for missing ones.
[[nodiscard]] Result<std::vector<std::optional<Stamp>>> stamps_of(const tools::CsvTable& table,
                                                                  const StampColumn& column);

}  // namespace rcs::importers
