#pragma once
// Names of the constants of messages, as terminals, events and reports show them. A value that is
// not a constant is "?".

#include <cstddef>
#include <string_view>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"

namespace rcs {

/// @param kLast  the last constant of the message, so that an added constant needs a name
template <int kLast, std::size_t kNames>
constexpr std::string_view constant_name(const std::string_view (&names)[kNames], int value) {
  static_assert(kLast + 1 == static_cast<int>(kNames));
  return value >= 0 && value <= kLast ? names[static_cast<std::size_t>(value)] : "?";
}

/// @param mode  nav_state_t::MODE_*
[[nodiscard]] constexpr std::string_view nav_mode_name(int mode) {
  return constant_name<nav_state_t::MODE_LOST>(
      {"ALIGN", "GPS_INS", "GPS_INS_LADAR", "INS_LADAR", "INS_DR", "GPS_LADAR", "LADAR", "LOST"},
      mode);
}

/// @param status  status_t::STATUS_*
[[nodiscard]] constexpr std::string_view status_name(int status) {
  return constant_name<status_t::STATUS_ERROR>({"UNINITIALIZED", "EXEC", "DONE", "ERROR"}, status);
}

/// @param status  integrity_t::STATUS_*, of a source
[[nodiscard]] constexpr std::string_view source_status_name(int status) {
  return constant_name<integrity_t::STATUS_PROBATION>(
      {"none", "accepted", "quarantine", "probation"}, status);
}

/// @param source  innovation_t::SOURCE_*
[[nodiscard]] constexpr std::string_view innovation_source_name(int source) {
  return constant_name<innovation_t::SOURCE_ZERO_VELOCITY>(
      {"gps position", "gps velocity", "odometry", "non-holonomic", "rolling map", "a priori map",
       "zero velocity"},
      source);
}

/// @param reason  innovation_t::REASON_*
[[nodiscard]] constexpr std::string_view innovation_reason_name(int reason) {
  return constant_name<innovation_t::REASON_QUARANTINE>(
      {"accepted", "gate", "invalid", "late", "repeated", "no datum", "epoch", "unobserved",
       "quarantine"},
      reason);
}

}  // namespace rcs
