#include "modules/bg/zone_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"

namespace rcs::bg {
namespace {

constexpr double kExact_m = 30.0;   // larger clearances need not be exact
constexpr std::size_t kText = 256;  // bytes; a name has up to 64
constexpr double kByFix_m = 20.0;   // clearance without a heading
constexpr double kSigmas = 3.0;     // of a fix
constexpr Duration kFixAge = from_seconds(1.5);
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

Pose2d planar(const Pose& T) {
  const Vec3 ahead = T.q * Vec3::UnitX();
  return {T.p.x(), T.p.y(), std::atan2(ahead.y(), ahead.x()), 0.0};
}

}  // namespace

ZoneWatch::ZoneWatch(GeodeticZones zones, const Shape& shape, Bus* bus)
    : drawn_(std::move(zones)), body_(shape, kExact_m) {
  reason_.reserve(kText);
  objection_.reserve(kText);
  bool forbids = false;
  slowest_mps_ = kUnbounded;
  for (const Zone& zone : drawn_.zones) {
    forbids = forbids || rcs::forbids(zone.kind);
    if (zone.kind == ZoneKind::kSpeed) slowest_mps_ = std::min(slowest_mps_, zone.speed_mps);
  }
  if (forbids) fixes_.emplace(bus, channel::kGpsFix, 2);
}

void ZoneWatch::follow_datum(const Geodetic& datum) {
  const bool same = world_ && datum.lat_rad == world_->datum().lat_rad &&
                    datum.lon_rad == world_->datum().lon_rad &&
                    datum.height.m == world_->datum().height.m;
  if (same) return;
  world_.emplace(datum);
  named_ = nullptr;
  zones_ = drawn_.in_world(*world_);
  guard_.reset();
  marked_ = false;
}

void ZoneWatch::take_fixes() {
  if (!fixes_) return;
  for (; !fixes_->empty(); fixes_->pop()) {
    // WM reports invalid fixes.
    if (const auto fix = read_fix(*fixes_->front(), fixes_->front_arrival())) fix_ = fix;
  }
}

void ZoneWatch::update(const Nav& nav, const Integrity& integrity, bool initializes_heading,
                       Stamp now) {
  if (drawn_.empty()) return;
  take_fixes();
  local_from_world_.reset();
  by_fix_ = false;
  // Of a message, and the origin of a frame must be a place.
  const Geodetic datum{radians(nav.datum.x()), radians(nav.datum.y()), {nav.datum.z()}};
  const bool known =
      nav.arrival != Stamp::min() && nav.pose_valid && nav.world_valid && plausible(datum);
  level_m_ = known && integrity.arrival != Stamp::min() ? integrity.horizontal_m : kUnbounded;
  if (known) {
    follow_datum(datum);
    if (nav.world_resets != world_resets_) guard_.reset();
    world_resets_ = nav.world_resets;
    local_from_world_ =
        LocalFromWorld::between(planar(nav.T_world_vehicle), planar(nav.T_local_vehicle));
  }
  if (!fixes_) return;
  if (known) {
    watch_position(nav);
  } else if (initializes_heading) {
    watch_fix(now);
  } else {
    set(Position::kUnknown, nullptr);
  }
}

void ZoneWatch::watch_position(const Nav& nav) {
  if (!std::isfinite(level_m_)) return set(Position::kUnbounded, nullptr);
  const Pose2d here = planar(nav.T_world_vehicle);
  guard_.update(zone_clearance(zones_, body_, here), level_m_);
  if (!guard_.too_near()) return set(Position::kFree, nullptr);
  set(guard_.clearance_m() < 0.0 ? Position::kInside : Position::kNear,
      zones_.clearance({here.x_m, here.y_m}).zone);
}

void ZoneWatch::watch_fix(Stamp now) {
  by_fix_ = true;
  if (!fix_ || now - fix_->arrival > kFixAge) return set(Position::kWithoutFix, nullptr);
  if (!world_) follow_datum(fix_->antenna);
  const ZoneClearance nearest = zones_.clearance(world_->to_world(fix_->antenna).head<2>());
  const bool far = nearest.m > kByFix_m + kSigmas * fix_->sigma_m;
  set(far ? Position::kFree : Position::kNearWithoutHeading, far ? nullptr : nearest.zone);
}

void ZoneWatch::set(Position position, const Zone* zone) {
  if (position == position_ && zone == named_) return;
  position_ = position;
  named_ = zone;
  const bool fence = zone != nullptr && zone->kind == ZoneKind::kFence;
  const std::string_view name = zone != nullptr ? std::string_view(zone->name) : "";
  reason_.clear();
  const auto out = std::back_inserter(reason_);
  switch (position) {
    case Position::kFree:
      break;
    case Position::kUnknown:
      reason_ = "waiting because zones are configured and the pose in frame world is unknown";
      break;
    case Position::kWithoutFix:
      reason_ = "waiting because zones are configured and neither heading nor GPS is known";
      break;
    case Position::kNearWithoutHeading:
      fmt::format_to(out, "waiting because the heading is unknown and {} '{}' is within {:.0f} m",
                     fence ? "the border of fence" : "keep-out", name, kByFix_m);
      break;
    case Position::kUnbounded:
      reason_ = "waiting because zones are configured and the position error has no bound";
      break;
    case Position::kNear:
      fmt::format_to(out, "{} '{}' is within the bound of the position error",
                     fence ? "the border of fence" : "keep-out", name);
      break;
    case Position::kInside:
      fmt::format_to(out, "{} '{}'", forbidden_side(*zone), name);
      break;
  }
}

void ZoneWatch::mark(const Pose2d& vehicle, vj::Terrain* terrain) {
  marked_ = fixes_ && local_from_world_ && std::isfinite(level_m_);
  if (marked_) ground_.mark(zones_, *local_from_world_, guard_, vehicle, terrain);
}

const std::vector<std::uint8_t>* ZoneWatch::forbidden(const RememberedGround& ground,
                                                      double body_m) {
  if (!marked_ || !local_from_world_ || !std::isfinite(level_m_)) return nullptr;
  return &ground_.forbidden(zones_, *local_from_world_, guard_, ground, body_m);
}

std::string_view ZoneWatch::objection(const Route& route, const Nav& nav) {
  if (!fixes_ || !local_from_world_) return "";
  const auto size = static_cast<std::size_t>(route.size());
  for (auto k = static_cast<std::size_t>(route.done()); k < size; ++k) {
    Vec3 at = from_message(route.waypoint(k).p_m);
    if (route.map_epoch()) at = nav.T_local_vehicle * (nav.T_rolling_vehicle.inverse() * at);
    Pose2d p{at.x(), at.y(), 0.0, 0.0};
    if (!route.in_world()) p = local_from_world_->to_world(p);
    const ZoneClearance nearest = zones_.clearance({p.x_m, p.y_m});
    if (nearest.m >= 0.0) continue;
    objection_.clear();
    fmt::format_to(std::back_inserter(objection_), "command rejected: waypoint {} is {} '{}'",
                   k + 1, forbidden_side(*nearest.zone), nearest.zone->name);
    return objection_;
  }
  return "";
}

void ZoneWatch::limit_speeds(Path* path) const {
  if (drawn_.empty()) return;
  if (local_from_world_) {
    return bg::limit_speeds(zones_, *local_from_world_, level_m_, path);
  }
  // The pose in frame world is unknown: the vehicle may be in any of the zones.
  for (PathPoint& p : *path) {
    p.zone_mps = slowest_mps_;
    p.road_mps = 0.0;
  }
}

void ZoneWatch::describe(const Path& path, std::size_t at, Facts* facts) const {
  const bool near = position_ == Position::kNear || position_ == Position::kInside;
  facts->zone = position_ == Position::kFree        ? ZoneState::kFree
                : position_ == Position::kUnbounded ? ZoneState::kUnbounded
                : position_ == Position::kNear      ? ZoneState::kNear
                : position_ == Position::kInside    ? ZoneState::kInside
                                                    : ZoneState::kUnknown;
  facts->zone_reason = reason_;
  // Of a path that was planned on terrain without zones nothing is known.
  if (position_ == Position::kFree && fixes_ && !by_fix_ && !marked_) {
    facts->zone = ZoneState::kUnknown;
    facts->zone_reason = "waiting for terrain in which the zones are marked";
  }
  facts->leads_out = near && marked_ && leads_out(path, at, guard_, [&](const Pose2d& p) {
                       return zone_clearance(zones_, body_, local_from_world_->to_world(p));
                     });
}

}  // namespace rcs::bg
