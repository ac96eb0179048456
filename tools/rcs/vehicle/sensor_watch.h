#pragma once
// Sensors from which the nodes have received nothing since the start of `rcs up`, by the accounts
// of the nodes. WM reports a sensor that falls silent later. Pure.

#include <array>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "rcs/base/stamp.h"

namespace rcs::cli {

class SensorWatch {
 public:
  /// Longer than the start of the nodes and the period of any sensor.
  static constexpr Duration kPatience = std::chrono::seconds(8);

  /// @param with_ladar  the vehicle runs SP
  SensorWatch(Stamp start, bool with_ladar) : start_(start), with_ladar_(with_ladar) {}

  void on_cycle(const cycle_t& cycle);
  /// The reports due at `now`, one sentence each: a sensor without data, once, and its first data
  /// after that.
  [[nodiscard]] std::vector<std::string> due(Stamp now);

 private:
  /// One sensor: the vehicle has a driver for one of its channels.
  struct Sensor {
    std::string_view name;
    std::array<std::string_view, 2> channels;  // an empty one: none
    std::string_view driver;
    bool received = false;
    bool reported = false;
  };

  Stamp start_;
  bool with_ladar_;
  std::array<Sensor, 4> sensors_ = {{
      {"INS", {channel::kIns, ""}, "the INS driver (100 to 200 Hz)"},
      {"GPS", {channel::kGpsFix, ""}, "the GPS driver (1 to 10 Hz)"},
      {"odometry",
       {channel::kOdometry, ""},
       "the odometry driver (10 to 50 Hz); a vehicle without odometry needs none"},
      {"LADAR",
       {channel::kLadarRanges, channel::kLadarPoints},
       "the LADAR driver (10 scans per second)"},
  }};
};

}  // namespace rcs::cli
