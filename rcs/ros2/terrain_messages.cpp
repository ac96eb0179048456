#include "rcs/ros2/terrain_messages.h"

#include <cmath>
#include <limits>

#include "lcmtypes/plausible.h"
#include "lcmtypes/rcs/message_fields.hpp"

namespace rcs::ros2 {
namespace {

constexpr std::int16_t kUnknownHeight = -32768;

/// Sizes as published by WM, and a position that does not overflow.
bool sound(const map_patch_t& m) {
  return m.width > 0 && m.height > 0 && m.n == std::int64_t{m.width} * m.height &&
         lengths_match(m) && std::isfinite(m.base_m) && m.cell_m > 0.0 && m.cell_m < 1e3;
}

Vec3 corner(const map_patch_t& m) { return {m.first_i * m.cell_m, m.first_j * m.cell_m, 0.0}; }

bool known(const map_patch_t& m, std::size_t k) {
  return (m.flags[k] & map_patch_t::FLAG_UNKNOWN) == 0;
}
bool obstacle(const map_patch_t& m, std::size_t k) {
  return (m.flags[k] & map_patch_t::FLAG_OBSTACLE) != 0;
}

/// @param value  of cell k of the patch
template <class Value>
void add_layer(const char* name, const map_patch_t& m, Value value, msg::GridMap* out) {
  const auto rows = static_cast<std::size_t>(m.width);
  const auto columns = static_cast<std::size_t>(m.height);
  msg::Float32MultiArray layer;
  layer.layout.dim = {
      {"column_index", static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(m.n)},
      {"row_index", static_cast<std::uint32_t>(rows), static_cast<std::uint32_t>(rows)}};
  layer.data.reserve(rows * columns);
  for (std::size_t j = columns; j-- > 0;) {
    for (std::size_t i = rows; i-- > 0;) layer.data.push_back(value(j * rows + i));
  }
  out->layers.emplace_back(name);
  out->data.push_back(std::move(layer));
}

}  // namespace

std::optional<msg::OccupancyGrid> to_occupancy(const map_patch_t& m, const ClockOffsets& clocks) {
  if (!sound(m)) return std::nullopt;
  msg::OccupancyGrid out;
  out.header = {to_time(shifted(m.utime, clocks.sensor_us)), kOdomFrame};
  out.info.map_load_time = out.header.stamp;
  out.info.resolution = static_cast<float>(m.cell_m);
  out.info.width = static_cast<std::uint32_t>(m.width);
  out.info.height = static_cast<std::uint32_t>(m.height);
  out.info.origin = to_pose({Quat::Identity(), corner(m)});
  out.data.resize(m.flags.size());
  for (std::size_t k = 0; k < m.flags.size(); ++k) {
    out.data[k] = static_cast<std::int8_t>(obstacle(m, k) ? 100 : known(m, k) ? 0 : -1);
  }
  return out;
}

std::optional<msg::GridMap> to_grid_map(const map_patch_t& m, const ClockOffsets& clocks) {
  if (!sound(m)) return std::nullopt;
  msg::GridMap out;
  out.header = {to_time(shifted(m.utime, clocks.sensor_us)), kOdomFrame};
  const Vec3 size = {m.width * m.cell_m, m.height * m.cell_m, 0.0};
  out.info = {m.cell_m, size.x(), size.y(), to_pose({Quat::Identity(), corner(m) + 0.5 * size})};
  out.basic_layers = {"elevation"};
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr auto kRadPerDeg = static_cast<float>(kPi / 180.0);
  const auto base_m = static_cast<float>(m.base_m);
  add_layer(
      "elevation", m,
      [&](std::size_t k) {
        return m.height_cm[k] == kUnknownHeight
                   ? kNan
                   : base_m + 0.01F * static_cast<float>(m.height_cm[k]);
      },
      &out);
  add_layer(
      "step", m,
      [&](std::size_t k) { return known(m, k) ? 0.01F * static_cast<float>(m.step_cm[k]) : kNan; },
      &out);
  add_layer(
      "slope", m,
      [&](std::size_t k) {
        return known(m, k) ? kRadPerDeg * static_cast<float>(m.slope_deg[k]) : kNan;
      },
      &out);
  add_layer(
      "roughness", m,
      [&](std::size_t k) {
        return known(m, k) ? 0.01F * static_cast<float>(m.roughness_cm[k]) : kNan;
      },
      &out);
  add_layer(
      "obstacle", m,
      [&](std::size_t k) { return obstacle(m, k) ? 1.0F
                                  : known(m, k)  ? 0.0F
                                                 : kNan; }, &out);
  return out;
}

}  // namespace rcs::ros2
