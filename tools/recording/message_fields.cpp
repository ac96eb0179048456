#include "tools/recording/message_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/ledger_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_sureness_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/scan_account_t.hpp"
#include "lcmtypes/rcs/shadow_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"

namespace rcs::recording {
namespace {

class FieldWriter {
 public:
  template <class T>
  FieldWriter& operator()(std::string_view name, const T& value) {
    if constexpr (std::is_same_v<T, std::int8_t>) {
      fields_.emplace_back(name, fmt::format("{}", static_cast<int>(value)));
    } else {
      fields_.emplace_back(name, fmt::format("{}", value));
    }
    return *this;
  }
  template <std::size_t N>
  FieldWriter& operator()(std::string_view name, const double (&values)[N]) {
    for (std::size_t i = 0; i < N; ++i) (*this)(fmt::format("{}_{}", name, i), values[i]);
    return *this;
  }
  template <std::size_t N, std::size_t M>
  FieldWriter& operator()(std::string_view name, const double (&values)[N][M]) {
    for (std::size_t i = 0; i < N; ++i) (*this)(fmt::format("{}_{}", name, i), values[i]);
    return *this;
  }
  FieldWriter& operator()(std::string_view name, const ledger_t& m);
  FieldWriter& operator()(std::string_view name, const scan_account_t& m);
  [[nodiscard]] Fields take() { return std::move(fields_); }

 private:
  Fields fields_;
};

// A column is called what its field is called.
#define G(field) fmt::format("{}_{}", name, #field), m.field
FieldWriter& FieldWriter::operator()(std::string_view name, const ledger_t& m) {
  return (*this)(G(measured_utime))(G(first_facet_utime))(G(last_facet_utime))(G(sp_start_utime))(
      G(wm_arrival_utime))(G(wm_start_utime))(G(bg_arrival_utime))(G(bg_start_utime));
}

FieldWriter& FieldWriter::operator()(std::string_view name, const scan_account_t& m) {
  return (*this)(G(answered))(G(degraded))(G(held))(G(failed))(G(dropped))(G(facets_lost))(
      G(facets_refused));
}
#undef G

#define F(name) #name, m.name
void write(const ladar_ranges_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(scan_id))(F(reference_utime))(F(facet))(F(facet_count))(F(rows))(F(cols))(
      F(first_row))(F(facet_rows))(F(duration_us))(F(pan_rad))(F(tilt_rad))(F(pan_rate_radps))(
      F(tilt_rate_radps))(F(n));
}

void write(const ladar_points_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(scan_id))(F(reference_utime))(F(facet))(F(facet_count))(F(rows))(F(cols))(
      F(n))(F(n_index))(F(n_time));
}

void write(const ins_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(interval_us))(F(delta_angle_rad))(F(delta_v_mps))(F(valid));
}

void write(const gps_fix_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(lat_deg))(F(lon_deg))(F(height_m))(F(height_kind))(F(undulation_m))(
      F(sigma_enu_m))(F(has_velocity))(F(v_enu_mps))(F(sigma_v_enu_mps))(F(fix_type))(
      F(satellites))(F(hdop))(F(vdop));
}

void write(const odometry_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(interval_us))(F(speed_mps))(F(sigma_speed_mps))(F(yaw_rate_radps))(
      F(sigma_yaw_rate_radps));
}

void write(const registration_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(scan_id))(F(target))(F(map_epoch))(F(n_tiles))(F(map_bias_sigma_m))(
      F(map_bias_length_m))(F(q_target_vehicle))(F(p_target_vehicle_m))(F(information))(
      F(observability))(F(stop))(F(iterations))(F(points))(F(pairs))(F(granted_units))(
      F(used_units))(F(mean_distance_m))(F(rms_m))(F(overlap))(F(correction_m))(F(correction_rad))(
      F(facets_lost))(F(degrade_level))(F(ledger))(F(account));
}

void write(const points_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(scan_id))(F(map_epoch))(F(part))(F(part_count))(F(q_rolling_vehicle))(
      F(p_rolling_vehicle_m))(F(n));
}

void write(const nav_state_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(mode))(F(pose_valid))(F(world_valid))(F(rolling_valid))(F(q_world_vehicle))(
      F(p_world_vehicle_m))(F(q_local_vehicle))(F(p_local_vehicle_m))(F(local_utime))(F(map_epoch))(
      F(q_rolling_vehicle))(F(p_rolling_vehicle_m))(F(v_world_mps))(F(rate_vehicle_radps))(F(
      accel_vehicle_mps2))(F(gyro_bias_radps))(F(accel_bias_mps2))(F(map_offset_m))(F(wheel_scale))(
      F(cov_world_pose))(F(cov_v_world))(F(cov_rolling_pose))(F(world_resets))(F(last_reset_m))(
      F(last_reset_rad))(F(last_reset_utime))(F(age_ins_us))(F(ins_shift_us))(F(age_gps_us))(
      F(age_odometry_us))(F(age_rolling_us))(F(age_prior_map_us))(F(distance_since_gps_m))(
      F(datum_lat_deg))(F(datum_lon_deg))(F(datum_height_m))(F(ledger))(F(publish_utime));
}

void write(const innovation_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(source))(F(accepted))(F(reason))(F(dof))(F(nis))(F(gate))(F(innovation))(
      F(sigma));
}

void write(const integrity_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(validity))(F(protection_horizontal_m))(F(protection_vertical_m))(
      F(limit_horizontal_m))(F(limit_vertical_m))(F(alerts))(F(gps))(F(ladar))(F(gps_since_utime))(
      F(ladar_since_utime))(F(gps_doubt))(F(ladar_doubt))(F(sigma_in_60s_m))(F(alert_in_s));
}

void write(const shadow_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(kind))(F(branch_utime))(F(q_world_vehicle))(F(p_world_vehicle_m))(
      F(cov_world_pose));
}

void write(const map_patch_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(local_utime))(F(cell_m))(F(first_i))(F(first_j))(F(width))(F(height))(
      F(base_m))(F(n));
}

void write(const path_query_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(issuer))(F(serial))(F(n));
}

void write(const path_sureness_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(issuer))(F(serial))(F(state))(F(has_map))(F(map_bias_sigma_m))(F(n));
}

void write(const cycle_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(node))(F(index))(F(wakeup_utime))(F(deadline_utime))(F(late_us))(
      F(used_wall_us))(F(used_cpu_us))(F(slack_us))(F(missed))(F(overruns))(F(degrade_level))(
      F(n_stages))(F(n_inputs));
}

void write(const event_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(node))(F(severity))(F(code))(F(text))(F(repeated));
}

void write(const command_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(issuer))(F(serial))(F(kind))(F(valid_until_utime))(F(frame))(F(n));
}

void write(const status_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(node))(F(issuer))(F(echo_serial))(F(new_command))(F(status))(
      F(degrade_level))(F(state))(F(source_line))(F(reason));
}

void write(const plan_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(issuer))(F(serial))(F(cost))(F(n));
}

void write(const drive_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(valid_until_utime))(F(speed_mps))(F(curvature_1pm))(F(accel_limit_mps2))(
      F(brake))(F(ledger));
}

void write(const truth_t& m, FieldWriter& w) {
  w(F(utime))(F(seq))(F(q_world_vehicle))(F(p_world_vehicle_m))(F(v_world_mps))(
      F(rate_vehicle_radps))(F(datum_lat_deg))(F(datum_lon_deg))(F(datum_height_m))(F(clearance_m))(
      F(foliage_contact));
}
#undef F

template <class T>
std::optional<Fields> decode_fields(const std::vector<std::uint8_t>& data) {
  T m{};
  if (m.decode(data.data(), 0, static_cast<int>(data.size())) != static_cast<int>(data.size())) {
    return std::nullopt;
  }
  FieldWriter writer;
  write(m, writer);
  return writer.take();
}

struct Type {
  std::string_view channel;
  std::int64_t hash;
  std::optional<Fields> (*fields)(const std::vector<std::uint8_t>& data);
};

template <class T>
Type type_of(std::string_view channel) {
  return {channel, T::getHash(), decode_fields<T>};
}

const Type* find_type(std::string_view channel) {
  static const std::array types = {
      type_of<ladar_ranges_t>(channel::kLadarRanges),
      type_of<ladar_points_t>(channel::kLadarPoints),
      type_of<ins_t>(channel::kIns),
      type_of<gps_fix_t>(channel::kGpsFix),
      type_of<odometry_t>(channel::kOdometry),
      type_of<registration_t>(channel::kSpRegistration),
      type_of<points_t>(channel::kSpPoints),
      type_of<event_t>(channel::kSpEvent),
      type_of<cycle_t>(channel::kSpCycle),
      type_of<nav_state_t>(channel::kWmNavState),
      type_of<innovation_t>(channel::kWmInnovation),
      type_of<integrity_t>(channel::kWmIntegrity),
      type_of<shadow_t>(channel::kWmShadow),
      type_of<map_patch_t>(channel::kWmMapPatch),
      type_of<path_query_t>(channel::kWmPathQuery),
      type_of<path_sureness_t>(channel::kWmPathSureness),
      type_of<event_t>(channel::kWmEvent),
      type_of<cycle_t>(channel::kWmCycle),
      type_of<command_t>(channel::kBgCommand),
      type_of<status_t>(channel::kBgStatus),
      type_of<plan_t>(channel::kBgPlan),
      type_of<drive_t>(channel::kBgDrive),
      type_of<event_t>(channel::kBgEvent),
      type_of<cycle_t>(channel::kBgCycle),
      type_of<truth_t>(channel::kSimTruth),
  };
  const Type* found = std::find_if(types.begin(), types.end(),
                                   [&](const Type& type) { return type.channel == channel; });
  return found == types.end() ? nullptr : found;
}

std::int64_t read_int64(const std::uint8_t* p) {
  std::uint64_t value = 0;
  for (int i = 0; i < 8; ++i) value = value << 8 | p[i];
  return static_cast<std::int64_t>(value);
}

}  // namespace

bool known_channel(std::string_view channel) { return find_type(channel) != nullptr; }

std::optional<MessageHead> read_head(std::string_view channel,
                                     const std::vector<std::uint8_t>& data) {
  constexpr std::size_t kHeadBytes = 24;  // fingerprint of the type, utime, seq
  const Type* type = find_type(channel);
  if (type == nullptr || data.size() < kHeadBytes || read_int64(data.data()) != type->hash) {
    return std::nullopt;
  }
  return MessageHead{read_int64(data.data() + 8), read_int64(data.data() + 16)};
}

std::optional<Fields> read_fields(std::string_view channel, const std::vector<std::uint8_t>& data) {
  const Type* type = find_type(channel);
  return type == nullptr ? std::nullopt : type->fields(data);
}

}  // namespace rcs::recording
