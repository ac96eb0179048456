#include "modules/wm/wm_messages_node.h"

#include <cmath>
#include <cstddef>
#include <string_view>

#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/message_names.h"
#include "lcmtypes/plausible.h"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/subfilter_t.hpp"
#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/integrity.h"

namespace rcs::wm {
namespace {

// Published by value.
static_assert(same_value(Mode::kAlign, nav_state_t::MODE_ALIGN) &&
              same_value(Mode::kGpsIns, nav_state_t::MODE_GPS_INS) &&
              same_value(Mode::kGpsInsLadar, nav_state_t::MODE_GPS_INS_LADAR) &&
              same_value(Mode::kInsLadar, nav_state_t::MODE_INS_LADAR) &&
              same_value(Mode::kInsDeadReckoning, nav_state_t::MODE_INS_DR) &&
              same_value(Mode::kGpsLadar, nav_state_t::MODE_GPS_LADAR) &&
              same_value(Mode::kLadar, nav_state_t::MODE_LADAR) &&
              same_value(Mode::kLost, nav_state_t::MODE_LOST));
static_assert(same_value(Source::kGpsPosition, innovation_t::SOURCE_GPS_POSITION) &&
              same_value(Source::kGpsVelocity, innovation_t::SOURCE_GPS_VELOCITY) &&
              same_value(Source::kOdometry, innovation_t::SOURCE_ODOMETRY) &&
              same_value(Source::kNonHolonomic, innovation_t::SOURCE_NON_HOLONOMIC) &&
              same_value(Source::kRolling, innovation_t::SOURCE_ROLLING) &&
              same_value(Source::kPriorMap, innovation_t::SOURCE_PRIOR_MAP) &&
              same_value(Source::kZeroVelocity, innovation_t::SOURCE_ZERO_VELOCITY));
static_assert(same_value(Reason::kAccepted, innovation_t::REASON_ACCEPTED) &&
              same_value(Reason::kGate, innovation_t::REASON_GATE) &&
              same_value(Reason::kInvalid, innovation_t::REASON_INVALID) &&
              same_value(Reason::kLate, innovation_t::REASON_LATE) &&
              same_value(Reason::kRepeated, innovation_t::REASON_REPEATED) &&
              same_value(Reason::kNoDatum, innovation_t::REASON_NO_DATUM) &&
              same_value(Reason::kEpoch, innovation_t::REASON_EPOCH) &&
              same_value(Reason::kUnobserved, innovation_t::REASON_UNOBSERVED) &&
              same_value(Reason::kQuarantine, innovation_t::REASON_QUARANTINE));
static_assert(same_value(SourceStatus::kNone, integrity_t::STATUS_NONE) &&
              same_value(SourceStatus::kFully, integrity_t::STATUS_ACCEPTED) &&
              same_value(SourceStatus::kQuarantine, integrity_t::STATUS_QUARANTINE) &&
              same_value(SourceStatus::kProbation, integrity_t::STATUS_PROBATION) &&
              same_value(SourceStatus::kSuspect, integrity_t::STATUS_SUSPECT) &&
              same_value(SourceStatus::kReadmitting, integrity_t::STATUS_READMITTING));
static_assert(same_value(Validity::kNone, integrity_t::VALID_NONE) &&
              same_value(Validity::kLocal, integrity_t::VALID_LOCAL) &&
              same_value(Validity::kWorld, integrity_t::VALID_WORLD));
static_assert(same_value(kAlertHorizontal, integrity_t::ALERT_HORIZONTAL) &&
              same_value(kAlertVertical, integrity_t::ALERT_VERTICAL) &&
              same_value(kAlertGps, integrity_t::ALERT_GPS) &&
              same_value(kAlertLadar, integrity_t::ALERT_LADAR) &&
              same_value(kAlertInput, integrity_t::ALERT_INPUT) &&
              same_value(kAlertIns, integrity_t::ALERT_INS) &&
              same_value(kAlertOdometry, integrity_t::ALERT_ODOMETRY));
static_assert(same_value(Without::kAll, subfilter_t::KIND_INERTIAL) &&
              same_value(Without::kLadar, subfilter_t::KIND_WITHOUT_LADAR) &&
              same_value(Without::kGps, subfilter_t::KIND_WITHOUT_GPS));

bool is_sigma(double s, double limit) { return std::isfinite(s) && s > 0.0 && s <= limit; }

bool is_sigma(const Vec3& s, double limit) {
  return s.allFinite() && s.minCoeff() > 0.0 && s.maxCoeff() <= limit;
}

}  // namespace

std::optional<ImuSample> admit(const ins_t& m) {
  const ImuSample s{from_utime(m.utime), Duration(m.interval_us), from_message(m.delta_angle_rad),
                    from_message(m.delta_v_mps)};
  if (!plausible(m)) return std::nullopt;
  return s;
}

std::optional<GeodeticFix> admit(const gps_fix_t& m) {
  GeodeticFix z;
  z.antenna = {radians(m.lat_deg), radians(m.lon_deg), {m.height_m}};
  if (m.height_kind == gps_fix_t::HEIGHT_ORTHOMETRIC) {
    z.antenna.height = to_ellipsoidal(OrthometricHeight{m.height_m}, Undulation{m.undulation_m});
  } else if (m.height_kind != gps_fix_t::HEIGHT_ELLIPSOIDAL) {
    return std::nullopt;
  }
  z.fix.sigma_m = from_message(m.sigma_enu_m);
  const bool null_island = m.lat_deg == 0.0 && m.lon_deg == 0.0;  // a receiver without a position
  const bool good = plausible_stamp(m.utime) && plausible(z.antenna) && !null_island &&
                    m.fix_type > gps_fix_t::FIX_NONE && m.fix_type <= gps_fix_t::FIX_FIXED &&
                    is_sigma(z.fix.sigma_m, 200.0);
  if (!good) return std::nullopt;
  const auto geometry = [](double dop) { return dop > 0.0 && dop < 100.0 ? dop : 0.0; };
  const auto kind = static_cast<GpsQuality::Fix>(m.fix_type - gps_fix_t::FIX_SINGLE);
  const std::optional<Vec3> sigma_m =
      worth(z.fix.sigma_m, {kind, m.satellites, geometry(m.hdop), geometry(m.vdop)});
  if (!sigma_m) return std::nullopt;
  z.fix.sigma_m = *sigma_m;
  z.fix.v_world = from_message(m.v_enu_mps);
  z.fix.sigma_v_mps = from_message(m.sigma_v_enu_mps);
  z.fix.has_velocity = m.has_velocity == 1 && within(z.fix.v_world, kFastest_mps) &&
                       is_sigma(z.fix.sigma_v_mps, 50.0);
  return z;
}

std::optional<OdometrySample> admit(const odometry_t& m) {
  const OdometrySample z{m.speed_mps, m.sigma_speed_mps, m.yaw_rate_radps, m.sigma_yaw_rate_radps};
  const bool yaw_good = std::isnan(z.yaw_rate_radps) || (std::abs(z.yaw_rate_radps) <= 10.0 &&
                                                         is_sigma(z.sigma_yaw_rate_radps, 10.0));
  const bool good = plausible_stamp(m.utime) && m.interval_us >= 0 && m.interval_us <= 1'000'000 &&
                    std::abs(z.speed_mps) <= 100.0 && is_sigma(z.sigma_speed_mps, 50.0) && yaw_good;
  if (!good) return std::nullopt;
  return z;
}

std::optional<Registration> admit(const registration_t& m) {
  Registration z;
  z.information = from_message(m.information);
  const bool good = plausible_stamp(m.utime) &&
                    from_message(m.q_target_vehicle, m.p_target_vehicle_m, &z.T_target_vehicle) &&
                    within(z.T_target_vehicle.p, kFarthest_m) && z.information.allFinite() &&
                    z.information.cwiseAbs().maxCoeff() < 1e15 &&
                    z.information.diagonal().minCoeff() >= 0.0 && m.map_bias_sigma_m >= 0.0 &&
                    m.map_bias_sigma_m <= 1e3 && m.map_bias_length_m >= 0.0 &&
                    m.map_bias_length_m <= 1e7;
  if (!good) return std::nullopt;
  if (!m.tile_id.empty()) z.tile_id = m.tile_id.front();
  return z;
}

void report_rejected(const InboxBase& inbox, Reason reason, Stamp now, Report* report) {
  if (reason == Reason::kAccepted || reason == Reason::kNoDatum) return;
  // A reader of an event has not read innovation_t.
  const std::string_view text = reason == Reason::kInvalid
                                    ? "invalid (not finite, implausible, or far in the future)"
                                    : innovation_reason_name(static_cast<int>(reason));
  report_rejected(inbox, text, now, report);
}

void report_rejected(const InboxBase& inbox, std::string_view reason, Stamp now, Report* report) {
  report->publish(now, event::kWmInputRejected, "{} rejected: {}; not fused, newest utime {}",
                  inbox.channel(), reason, to_utime(inbox.account().newest));
}

}  // namespace rcs::wm
