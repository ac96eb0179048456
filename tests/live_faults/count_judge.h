#pragma once
// Checks that nothing is counted or executed twice: scans, measurements, counters, commands and
// waypoints. Pure.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/linear.h"

namespace rcs::live_faults {

class CountJudge {
 public:
  /// @param course_world  waypoints, driven round and round
  CountJudge(std::vector<Vec2> course_world, double radius_m)
      : course_(std::move(course_world)), radius_m_(radius_m), far_(course_.size(), true) {}

  void take(const registration_t& m);
  void take(const innovation_t& m);
  void take(const cycle_t& m);
  void take(const process_t& m);
  void take(const command_t& m);
  void take(const status_t& m);
  void take(const truth_t& m);

  /// The next waypoint to be reached, by ground truth.
  [[nodiscard]] std::size_t next_waypoint() const { return next_; }
  [[nodiscard]] std::int64_t waypoints() const { return waypoints_; }
  /// Number of returns of the vehicle to the waypoint before the next.
  [[nodiscard]] std::int64_t returns() const { return returns_; }
  [[nodiscard]] std::int64_t scans() const { return scans_; }
  [[nodiscard]] std::int64_t commands() const { return static_cast<std::int64_t>(taken_.size()); }
  [[nodiscard]] const std::vector<std::string>& breaches() const { return breaches_; }

 private:
  struct Life {
    std::int64_t seq = 0;
    std::int64_t begun = 0;
    std::vector<std::int64_t> counts;
  };
  /// Counters of one process of a node never decrease; a restart is another process.
  void watch(const std::string& what, std::int64_t seq, std::vector<std::int64_t> counts);
  void breach(const std::string& text);

  std::vector<Vec2> course_;
  double radius_m_;
  std::vector<bool> far_;  // for each waypoint: the vehicle has been away from it since it was near
  std::size_t next_ = 0;
  double nearest_to_next_m_ = 1e9;
  std::int64_t waypoints_ = 0;
  std::int64_t returns_ = 0;
  std::int64_t scans_ = 0;
  std::int64_t newest_scan_ = -1;
  std::set<std::pair<int, std::int64_t>>
      fused_;  // source and utime of the measurements that WM has accepted
  std::map<std::string, Life> lives_;
  std::map<std::string, std::set<int>> pids_;
  std::set<std::pair<std::string, std::int64_t>> taken_;                // issuer and serial
  std::map<std::pair<std::string, std::int64_t>, std::int64_t> tasks_;  // by issuer and serial
  std::map<std::pair<std::string, std::int64_t>, int> done_;            // by issuer and task
  std::vector<std::string> breaches_;
};

}  // namespace rcs::live_faults
