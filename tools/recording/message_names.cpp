#include "tools/recording/message_names.h"

#include <cstddef>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "modules/registration/registration.h"

namespace rcs::recording {
namespace {

/// @param kLast  last constant of the message, so that an added constant fails to compile
template <int kLast, std::size_t kNames>
std::string_view name(const std::string_view (&names)[kNames], int value) {
  static_assert(kLast + 1 == static_cast<int>(kNames));
  return value >= 0 && value <= kLast ? names[static_cast<std::size_t>(value)] : "?";
}

}  // namespace

std::string_view nav_mode_name(int mode) {
  return name<nav_state_t::MODE_LOST>(
      {"ALIGN", "GPS_INS", "GPS_INS_LADAR", "INS_LADAR", "INS_DR", "GPS_LADAR", "LADAR", "LOST"},
      mode);
}

std::string_view status_name(int status) {
  return name<status_t::STATUS_ERROR>({"UNINITIALIZED", "EXEC", "DONE", "ERROR"}, status);
}

std::string_view source_status_name(int status) {
  return name<integrity_t::STATUS_PROBATION>({"none", "accepted", "quarantine", "probation"},
                                             status);
}

std::string_view innovation_source_name(int source) {
  return name<innovation_t::SOURCE_ZERO_VELOCITY>(
      {"gps position", "gps velocity", "odometry", "non-holonomic", "rolling map", "a priori map",
       "zero velocity"},
      source);
}

std::string_view innovation_reason_name(int reason) {
  return name<innovation_t::REASON_QUARANTINE>({"accepted", "gate", "invalid", "late", "repeated",
                                                "no datum", "epoch", "unobserved", "quarantine"},
                                               reason);
}

std::string_view stop_name(int stop) {
  // The same values: see SP's conversion.
  return registration::name_of(static_cast<registration::Stop>(stop));
}

}  // namespace rcs::recording
