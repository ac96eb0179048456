#pragma once
// Collects messages of several sensors for one log.

#include <string>
#include <variant>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::recording {

/// Accepts one sensor after the other and writes all messages in the order of arrival; equal
/// arrivals in the order in which they were added.
class SensorLog {
 public:
  using Message = std::variant<ins_t, gps_fix_t, odometry_t, truth_t>;
  struct Event {
    Stamp arrival;
    Message message;
  };

  void add(Stamp arrival, const Message& message) { events_.push_back({arrival, message}); }
  /// In the order in which they were added.
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }
  [[nodiscard]] Outcome write(const std::string& path) const;

 private:
  std::vector<Event> events_;
};

}  // namespace rcs::recording
