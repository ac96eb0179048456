#pragma once
// Detects recovery: all nodes run at their rates, WM is localized and the vehicle drives under BG,
// for one uninterrupted second. Pure.

#include <deque>
#include <map>
#include <optional>
#include <string>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"

namespace rcs::live_faults {

class Recovery {
 public:
  static constexpr Duration kHeld = std::chrono::seconds(1);
  static constexpr double kDriving_mps = 0.5;

  /// Messages received before no longer count.
  void reset() { *this = Recovery(); }

  void take(const cycle_t& m, Stamp arrival);
  void take(const nav_state_t& m, Stamp arrival);
  void take(const status_t& m, Stamp arrival);

  /// Call periodically.
  void look(Stamp now, double speed_mps);
  /// The beginning of the first second in which all conditions held; none: not yet.
  [[nodiscard]] std::optional<Stamp> recovered() const { return recovered_; }
  /// The missing condition at the last check; empty: none.
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  [[nodiscard]] std::string what_is_missing(Stamp now, double speed_mps) const;

  std::map<std::string, std::deque<Stamp>> cycles_;  // arrivals of the last second
  std::optional<nav_state_t> nav_;
  Stamp nav_arrival_ = Stamp::min();
  std::optional<status_t> status_;
  Stamp status_arrival_ = Stamp::min();
  std::optional<Stamp> well_since_;
  std::optional<Stamp> recovered_;
  std::string missing_ = "everything";
};

}  // namespace rcs::live_faults
