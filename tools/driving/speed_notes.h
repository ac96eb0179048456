#pragma once
// What limited the speed of a closed-loop drive, and for how long.

#include <map>
#include <string>

#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/tap.h"

namespace rcs::driving {

/// Records a run from its bus.
class SpeedNotes {
 public:
  explicit SpeedNotes(Bus* bus);
  /// By speed_limit_name(), and "at rest", "acceleration" (slower than commanded) or "obstacle
  /// ahead" (commanded to be slower than planned).
  [[nodiscard]] const std::map<std::string, double>& limited_s() const { return limited_s_; }

 private:
  void accept(const plan_t& m);
  void accept(const nav_state_t& m);
  [[nodiscard]] std::string limit_of(const nav_state_t& m);

  std::map<std::string, double> limited_s_;
  plan_t plan_{};
  std::size_t at_ = 0;
  drive_t drive_{};
  std::int64_t nav_utime_ = 0;
  Tap<plan_t> plans_;
  Tap<nav_state_t> nav_states_;
  Tap<drive_t> drives_;
};

}  // namespace rcs::driving
