#pragma once
// Names of the constants of messages, as terminals, events and reports show them. A value that is
// not a constant is "?".

#include <cstddef>
#include <string>
#include <string_view>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_point_t.hpp"
#include "lcmtypes/rcs/route_t.hpp"
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

/// @param verdict  route_t::VERDICT_*
[[nodiscard]] constexpr std::string_view route_verdict_name(int verdict) {
  return constant_name<route_t::VERDICT_PENDING>({"chosen", "dearer", "above limit", "pending"},
                                                 verdict);
}

/// @param status  integrity_t::STATUS_*, of a source
[[nodiscard]] constexpr std::string_view source_status_name(int status) {
  return constant_name<integrity_t::STATUS_READMITTING>(
      {"none", "accepted", "quarantine", "probation", "suspect", "readmitting"}, status);
}

/// @param type  gps_fix_t::FIX_*
[[nodiscard]] constexpr std::string_view gps_fix_name(int type) {
  return constant_name<gps_fix_t::FIX_FIXED>(
      {"NONE", "SINGLE", "DIFFERENTIAL", "RTK_FLOAT", "RTK_FIXED"}, type);
}

/// @param limit  plan_point_t::LIMIT_*
[[nodiscard]] constexpr std::string_view speed_limit_name(int limit) {
  return constant_name<plan_point_t::LIMIT_END>(
      {"task", "ground", "unseen ground", "vegetation", "obstacle beside", "turn", "steering rate",
       "reversing", "sight", "speed zone", "uncertain pose", "end of the path"},
      limit);
}

/// @param stop  status_t::STOP_*
[[nodiscard]] constexpr std::string_view emergency_stop_name(int stop) {
  return constant_name<status_t::STOP_PERSISTED>({"none", "LATCHED IN MEMORY", "LATCHED"}, stop);
}

/// The names of the bits, separated by commas; "none".
/// @param alerts  integrity_t::ALERT_*
[[nodiscard]] inline std::string alert_names(int alerts) {
  std::string text;
  const auto add = [&](int bit, const char* name) {
    if ((alerts & bit) != 0) text += (text.empty() ? "" : ", ") + std::string(name);
  };
  add(integrity_t::ALERT_HORIZONTAL, "horizontal");
  add(integrity_t::ALERT_VERTICAL, "vertical");
  add(integrity_t::ALERT_GPS, "GPS");
  add(integrity_t::ALERT_LADAR, "LADAR");
  add(integrity_t::ALERT_INPUT, "input");
  add(integrity_t::ALERT_INS, "INS");
  add(integrity_t::ALERT_ODOMETRY, "odometry");
  return text.empty() ? "none" : text;
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
      {"accepted", "gate", "invalid", "late", "repeated", "no world pose", "epoch", "unobserved",
       "quarantine"},
      reason);
}

}  // namespace rcs
