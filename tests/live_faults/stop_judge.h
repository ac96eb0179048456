#pragma once
// Judges a live vehicle around emergency stops: from the cycle of a stop on BG commands full brake
// only, and once the vehicle is at rest it does not move before every stop has been released by its
// issuer or by an authority. Pure.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/linear.h"
#include "tests/bg/stop_sequence.h"

namespace rcs::live_faults {

class StopJudge {
 public:
  static constexpr Duration kBrakeWithin = from_seconds(1.0);
  static constexpr Duration kReleaseWithin = from_seconds(3.0);  ///< they are valid for 2.5 s
  static constexpr double kRest_mps = 0.02;
  static constexpr double kMoved_m = 0.1;

  StopJudge(const std::string& authority, std::int64_t boot_id)
      : boot_id_(boot_id), law_(authority, kReleaseWithin) {
    law_.restarted(boot_id, false);
  }

  /// In the order of arrival.
  void take(const command_t& m, Stamp arrival);
  void take(const drive_t& m, Stamp arrival);
  void take(const status_t& m, Stamp arrival);
  void take(const truth_t& m);

  [[nodiscard]] const bg::test::StopLaw& law() const { return law_; }
  [[nodiscard]] bool stopped() const { return stopped_.has_value(); }
  [[nodiscard]] double speed_mps() const { return speed_mps_; }
  /// Number of times that a moving vehicle was stopped.
  [[nodiscard]] int stops_in_motion() const { return stops_in_motion_; }
  /// From the arrival of a stop to that of the first full brake [ms].
  [[nodiscard]] const std::vector<double>& latencies_ms() const { return latencies_ms_; }
  [[nodiscard]] const std::vector<std::string>& breaches() const { return breaches_; }

 private:
  void note_publisher(std::int64_t publisher_id, Stamp now);
  void note_change(Stamp now);
  void breach(const std::string& text);

  std::int64_t boot_id_;
  bg::test::StopLaw law_;
  std::int64_t bg_ = 0;           // publisher_id of the BG that runs; 0: unknown
  std::optional<Stamp> stopped_;  // since then a stop is in force
  bool brakes_ = false;           // BG has begun to brake for it
  double speed_mps_ = 0.0;
  Vec2 place_world_ = Vec2::Zero();
  std::optional<Vec2> rest_world_;
  int stops_in_motion_ = 0;
  std::vector<double> latencies_ms_;
  std::vector<std::string> breaches_;
};

}  // namespace rcs::live_faults
