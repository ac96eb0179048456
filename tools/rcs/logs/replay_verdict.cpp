#include "tools/rcs/logs/replay_verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/registration/registration.h"
#include "rcs/node/time_text.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::cli {
namespace {

/// At this distance the vertical at the fix differs by 1.6 mrad from that at the datum, which WM
/// would estimate as an accelerometer bias of 15 mm/s^2.
constexpr double kMaxDatumDistance_m = 10'000.0;
/// Scans of a vehicle within this distance of a map still overlap it.
constexpr double kOverlap_m = 50.0;
constexpr double kStep_m = 1.0;

template <class T>
std::optional<T> decoded(const std::uint8_t* data, std::size_t size) {
  T message{};
  const int bytes = static_cast<int>(size);
  if (message.decode(data, 0, bytes) != bytes) return std::nullopt;
  return message;
}

std::optional<Geodetic> place(double lat_deg, double lon_deg, double height_m) {
  const Geodetic g{radians(lat_deg), radians(lon_deg), EllipsoidalHeight{height_m}};
  return plausible(g) ? std::optional<Geodetic>(g) : std::nullopt;
}

double distance_to_tile(const Vec2& p, const MapLevel& level, Cell tile) {
  const Cell first = first_cell(tile);
  const double side_m = level.cell_m * kTileSide;
  const Vec2 low = level.origin_m + level.cell_m * Vec2(first.i, first.j);
  const Vec2 outside = (low - p).cwiseMax(p - low - Vec2::Constant(side_m)).cwiseMax(0.0);
  return outside.norm();
}

}  // namespace

void ReplayVerdict::on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                               std::size_t size) {
  if (!begin_) begin_ = due;
  count(due, channel, data, size);
  next_->on_deliver(due, channel, data, size);
}

void ReplayVerdict::count(Stamp due, std::string_view channel, const std::uint8_t* data,
                          std::size_t size) {
  const auto& sensors = channel::kSensors;
  if (std::find(sensors.begin(), sensors.end(), channel) != sensors.end()) ++sensor_messages_;
  if (channel == channel::kLadarRanges || channel == channel::kLadarPoints) {
    ++ladar_messages_;
  } else if (channel == channel::kGpsFix && !first_fix_) {
    const auto fix = decoded<gps_fix_t>(data, size);
    if (fix && fix->fix_type != gps_fix_t::FIX_NONE) {
      first_fix_ = place(fix->lat_deg, fix->lon_deg, fix->height_m);
    }
  } else if (channel == channel::kSpRegistration) {
    const auto r = decoded<registration_t>(data, size);
    if (r && r->target == registration_t::TARGET_ROLLING) {
      ++scans_;
      if (registration::usable(static_cast<registration::Stop>(r->stop))) ++registered_;
    }
  } else if (channel == channel::kSpEvent) {
    const auto e = decoded<event_t>(data, size);
    if (e && e->severity != event_t::SEVERITY_INFO) {
      ladar_event_ = fmt::format("{} UTC ({:.1f} s): {}: {}", time_of_day(to_utime(due)),
                                 seconds(due - *begin_), e->code, e->text);
    }
  } else if (channel == channel::kWmNavState) {
    ++poses_;
    const auto m = decoded<nav_state_t>(data, size);
    if (m && m->world_valid != 0) {
      world_datum_ = place(m->datum_lat_deg, m->datum_lon_deg, m->datum_height_m);
      const Vec3 p = from_message(m->p_world_vehicle_m);
      if (p.allFinite() && (course_.empty() || (p - course_.back()).norm() >= kStep_m)) {
        course_.push_back(p);
      }
    }
  }
}

std::string ReplayVerdict::pose_fault() const {
  if (poses_ > 0 || registered_ > 0) return "";
  return fmt::format(
      "no pose: WM published none from {} sensor messages (malformed ones are counted above)",
      sensor_messages_);
}

std::string ReplayVerdict::ladar_fault() const {
  if (ladar_messages_ == 0 || registered_ > 0) return "";
  const std::string why =
      ladar_event_.empty() ? "" : fmt::format("; the last warning of SP, at {}", ladar_event_);
  return fmt::format("0 registrations: {} LADAR messages gave {} scans, none was registered{}",
                     ladar_messages_, scans_, why);
}

std::string ReplayVerdict::datum_fault(const Geodetic& datum) const {
  if (!first_fix_) return "";
  const double distance_m = LocalFrame(datum).to_world(*first_fix_).norm();
  if (distance_m <= kMaxDatumDistance_m) return "";
  return fmt::format(
      "the configured datum ({:.5f}, {:.5f} deg) contradicts the GPS fixes: the first one "
      "({:.5f}, {:.5f} deg) is {:.1f} km from it (at most {:.0f} km)",
      degrees(datum.lat_rad), degrees(datum.lon_rad), degrees(first_fix_->lat_rad),
      degrees(first_fix_->lon_rad), 1e-3 * distance_m, 1e-3 * kMaxDatumDistance_m);
}

std::string ReplayVerdict::map_fault(const MapIndex& map) const {
  if (ladar_messages_ == 0 || course_.empty() || !world_datum_ || map.levels.empty()) return "";
  const Pose T_map_world = LocalFrame(map.frame.datum).from(LocalFrame(*world_datum_));
  const MapLevelIndex& finest = map.levels.front();
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const Vec3& p_world : course_) {
    const Vec2 p = (T_map_world * p_world).head<2>();
    if (finest.find(tile_of(finest.level.cell_at(p.x(), p.y()))) != nullptr) return "";
    for (const MapTileEntry& e : finest.tiles) {
      nearest_m = std::min(nearest_m, distance_to_tile(p, finest.level, e.tile));
    }
  }
  if (nearest_m <= kOverlap_m) return "";
  return fmt::format(
      "the a priori map does not overlap the drive: its nearest tile is {:.0f} m "
      "from the course (at most {:.0f} m)",
      nearest_m, kOverlap_m);
}

std::vector<std::string> ReplayVerdict::faults(const std::optional<Geodetic>& datum,
                                               const MapIndex* map) const {
  std::vector<std::string> all = {pose_fault(), ladar_fault()};
  if (datum) all.push_back(datum_fault(*datum));
  if (map != nullptr) all.push_back(map_fault(*map));
  all.erase(std::remove(all.begin(), all.end(), std::string()), all.end());
  return all;
}

}  // namespace rcs::cli
