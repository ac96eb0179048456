#pragma once
// Tables of an IMU, a GPS receiver and wheels as messages. Pure.

#include <cstdint>
#include <optional>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/base/csv_table.h"
#include "tools/importers/imu_gps_map.h"
#include "tools/recording/sensor_log.h"

namespace rcs::importers {

/// What became of a sensor's rows.
struct RowCounts {
  std::int64_t rows = 0;
  std::int64_t written = 0;
  std::int64_t missing = 0;           ///< skipped: a cell was missing
  std::int64_t backward = 0;          ///< written: stamp not after the newest before it
  std::int64_t gaps = 0;              ///< of an IMU: not bridged
  std::int64_t unpaired = 0;          ///< of an IMU in two files: skipped
  std::int64_t unchanged = 0;         ///< of GPS: skipped, the fix before once more
  std::int64_t no_fix = 0;            ///< of GPS: skipped, the receiver says so
  std::int64_t implausible = 0;       ///< of GPS: skipped, not a place on the earth
  std::int64_t without_velocity = 0;  ///< of GPS: written, but speed or course was missing
  std::int64_t clock_steps = 0;       ///< of the receiver's clock against the device's
};

struct ImportCounts {
  std::optional<RowCounts> imu;
  std::optional<RowCounts> gps;
  std::optional<RowCounts> wheels;
};

/// The device's time of what a receiver stamps by a clock of its own. A message is late by a
/// varying time and never early, so the offset between the clocks is the least that was seen so
/// far. Good while the clocks drift apart by less than what counts: some minutes.
class ReceiverClock {
 public:
  /// @param receiver  time by the receiver's clock, of any origin
  [[nodiscard]] Stamp device_time(Stamp arrival, Duration receiver);
  /// Starts anew: offsets that no transport explains (midnight, a clock that is set).
  [[nodiscard]] std::int64_t steps() const { return steps_; }

 private:
  std::optional<Stamp> origin_;  // device time of receiver time 0
  std::int64_t steps_ = 0;
};

/// Samples of rate and specific force as increments: the integral of the straight line from the
/// newest sample to the next. A sample that is not after the newest counts as held for as long as
/// the interval before.
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

/// Adds all that the map names to `log`. Stamps that run backward stay as they are; what follows
/// them arrives no earlier.
/// @return an error that names file, line and column; or the file that is missing or not used
[[nodiscard]] Result<ImportCounts> import_imu_gps(const ImuGpsMap& map,
                                                  const std::vector<tools::CsvTable>& tables,
                                                  recording::SensorLog* log);

/// A column of stamps as times; where it is missing, none.
[[nodiscard]] Result<std::vector<std::optional<Stamp>>> stamps_of(const tools::CsvTable& table,
                                                                  const StampColumn& column);

}  // namespace rcs::importers
