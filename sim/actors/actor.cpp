#include "sim/actors/actor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace rcs::sim {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kPersonRadius_m = 0.3;
constexpr double kPersonHeight_m = 1.8;
constexpr double kVehicleHeight_m = 1.6;
constexpr double kVehicleLength_m = 4.5;
constexpr double kVehicleWidth_m = 1.9;
constexpr double kNowhere_m = 1e7;
// A body reaches below the ground at its centre, so that nothing is seen under it on a slope.
constexpr double kFoot_m = 0.5;

/// A rectangle in the plane.
struct Rectangle {
  Vec2 centre;
  Vec2 ahead;  // unit
  Vec2 half;   // of length and width

  Rectangle(const CoursePoint& at, double length_m, double width_m)
      : centre(at.p_world),
        ahead(std::cos(at.heading_rad), std::sin(at.heading_rad)),
        half(0.5 * length_m, 0.5 * width_m) {}

  [[nodiscard]] Vec2 left() const { return {-ahead.y(), ahead.x()}; }
  [[nodiscard]] Vec2 inside(const Vec2& p) const {
    const Vec2 from = p - centre;
    return {ahead.dot(from), left().dot(from)};
  }
  /// Negative inside.
  [[nodiscard]] double distance(const Vec2& p) const {
    const Vec2 beyond = inside(p).cwiseAbs() - half;
    const double outside = beyond.cwiseMax(0.0).norm();
    return outside > 0.0 ? outside : beyond.maxCoeff();
  }
  [[nodiscard]] std::array<Vec2, 4> corners() const {
    const Vec2 x = half.x() * ahead;
    const Vec2 y = half.y() * left();
    return {centre + x + y, centre + x - y, centre - x + y, centre - x - y};
  }
};

Rectangle box_of(const ActorPlace& actor) { return {actor.at, kVehicleLength_m, kVehicleWidth_m}; }

// Of two rectangles whose projections on an axis of one of them are apart, a corner of one is the
// nearest point.
double distance(const Rectangle& a, const Rectangle& b) {
  double apart = -kNever;
  double nearest = kNever;
  for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    Vec2 low = Vec2::Constant(kNever);
    Vec2 high = -low;
    for (const Vec2& corner : other->corners()) {
      const Vec2 p = one->inside(corner);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
      nearest = std::min(nearest, one->distance(corner));
    }
    const Vec2 gap = (low - one->half).cwiseMax(-one->half - high);
    apart = std::max(apart, gap.maxCoeff());
  }
  return apart > 0.0 ? nearest : apart;
}

bool nearer(double range_m, double cos_incidence, Hit* hit) {
  if (range_m <= 0.0 || range_m >= hit->range_m) return false;
  *hit = {range_m, std::abs(cos_incidence)};
  return true;
}

bool meet_cylinder(const Vec2& centre, double top_m, const Ray& ray, Hit* hit) {
  const Vec2 d = ray.direction_world.head<2>();
  const Vec2 p = ray.origin_world.head<2>() - centre;
  const double a = d.squaredNorm();
  const double b = p.dot(d);
  const double c = p.squaredNorm() - kPersonRadius_m * kPersonRadius_m;
  const double rise = ray.direction_world.z();
  const double above_m = ray.origin_world.z() - top_m;
  bool met = false;
  if (const double root = b * b - a * c; a > 0.0 && root > 0.0) {
    const double side_m = (-b - std::sqrt(root)) / a;
    if (above_m + side_m * rise <= 0.0) {
      const Vec2 normal = (p + side_m * d) / kPersonRadius_m;
      met = nearer(side_m, normal.dot(d), hit);
    }
  }
  if (above_m > 0.0 && rise < 0.0) {
    const double range_m = -above_m / rise;
    if ((p + range_m * d).norm() <= kPersonRadius_m) met = nearer(range_m, rise, hit) || met;
  }
  return met;
}

// Slabs: the ray is inside of all three between the largest entry and the smallest exit.
bool meet_box(const Rectangle& box, double bottom_m, double top_m, const Ray& ray, Hit* hit) {
  const Vec2 p = box.inside(ray.origin_world.head<2>());
  const Vec2 d = ray.direction_world.head<2>();
  const Vec3 origin(p.x(), p.y(), ray.origin_world.z());
  const Vec3 along(box.ahead.dot(d), box.left().dot(d), ray.direction_world.z());
  const Vec3 low(-box.half.x(), -box.half.y(), bottom_m);
  const Vec3 high(box.half.x(), box.half.y(), top_m);
  double enter_m = -kNever;
  double exit_m = kNever;
  double cos_incidence = 1.0;
  for (int k = 0; k < 3; ++k) {
    if (along[k] == 0.0) {
      if (origin[k] < low[k] || origin[k] > high[k]) return false;
      continue;
    }
    const double a = (low[k] - origin[k]) / along[k];
    const double b = (high[k] - origin[k]) / along[k];
    if (std::min(a, b) > enter_m) cos_incidence = along[k];
    enter_m = std::max(enter_m, std::min(a, b));
    exit_m = std::min(exit_m, std::max(a, b));
  }
  return enter_m < exit_m && nearer(enter_m, cos_incidence, hit);
}

/// Radius of a circle around the body.
double radius_of(ActorKind kind) { return kind == ActorKind::kPerson ? kPersonRadius_m : 2.5; }

bool passes(const Vec2& centre, double radius_m, const Ray& ray) {
  const Vec2 to = centre - ray.origin_world.head<2>();
  const Vec2 d = ray.direction_world.head<2>();
  const double across = d.x() * to.y() - d.y() * to.x();
  return across * across <= radius_m * radius_m * d.squaredNorm() ||
         to.squaredNorm() <= radius_m * radius_m;
}

}  // namespace

ActorPlace place_on(const ActorScript& script, double moving_s) {
  double left_m = std::max(0.0, moving_s) * script.speed_mps;
  ActorPlace place{script.kind, {}};
  for (std::size_t k = 1; k < script.waypoints_world.size(); ++k) {
    const Vec2& from = script.waypoints_world[k - 1];
    const Vec2 way = script.waypoints_world[k] - from;
    const double length_m = way.norm();
    const double share = length_m > 0.0 ? std::min(1.0, left_m / length_m) : 1.0;
    place.at = {from + share * way, std::atan2(way.y(), way.x())};
    if (share < 1.0) break;
    left_m -= length_m;
  }
  return place;
}

bool meet(const ActorPlace& actor, double ground_m, const Ray& ray, Hit* hit) {
  if (actor.kind == ActorKind::kPerson) {
    return meet_cylinder(actor.at.p_world, ground_m + kPersonHeight_m, ray, hit);
  }
  return meet_box(box_of(actor), ground_m - kFoot_m, ground_m + kVehicleHeight_m, ray, hit);
}

double distance(const ActorPlace& actor, const CoursePoint& vehicle, const Footprint& footprint) {
  const Rectangle body(vehicle, footprint.length_m, footprint.width_m);
  return actor.kind == ActorKind::kPerson ? body.distance(actor.at.p_world) - kPersonRadius_m
                                          : distance(body, box_of(actor));
}

double distance(const ActorPlace& actor, const Vec2& place_world) {
  return actor.kind == ActorKind::kPerson
             ? (place_world - actor.at.p_world).norm() - kPersonRadius_m
             : box_of(actor).distance(place_world);
}

Actors::Actors(std::vector<ActorScript> scripts) : scripts_(std::move(scripts)) {
  for (const ActorScript& s : scripts_) start_s_.push_back(s.within_m > 0.0 ? kNever : s.start_s);
}

double stop_m(double speed_mps) {
  constexpr double kUntilItActs_s = 0.45;
  constexpr double kBrake_mps2 = 5.0;
  return speed_mps * kUntilItActs_s + 0.5 * speed_mps * speed_mps / kBrake_mps2;
}

ActorPlace Actors::at(std::size_t k, double time_s) const {
  if (!exists(k, time_s)) return {scripts_[k].kind, {Vec2::Constant(kNowhere_m), 0.0}};
  return place_on(scripts_[k], time_s - start_s_[k]);
}

void Actors::observe(const CoursePoint& vehicle, double speed_mps, double time_s) {
  for (std::size_t k = 0; k < scripts_.size(); ++k) {
    ActorScript& s = scripts_[k];
    if (start_s_[k] < kNever || time_s < s.start_s) continue;
    if ((vehicle.p_world - s.waypoints_world.front()).norm() > s.within_m) continue;
    start_s_[k] = time_s;
    if (s.appears_beyond_m <= 0.0) continue;
    const Vec2 ahead(std::cos(vehicle.heading_rad), std::sin(vehicle.heading_rad));
    const Vec2 across(-ahead.y(), ahead.x());
    const double bodies_m =
        0.5 * Footprint().length_m +
        (s.kind == ActorKind::kPerson ? kPersonRadius_m : 0.5 * kVehicleWidth_m);
    const Vec2 place =
        vehicle.p_world + (bodies_m + stop_m(speed_mps) + s.appears_beyond_m) * ahead;
    s.waypoints_world = {place, place + across};
    s.speed_mps = 0.0;
  }
}

bool Actors::meet(const World& world, const Ray& ray, double time_s, Hit* hit) const {
  bool met = false;
  for (std::size_t k = 0; k < scripts_.size(); ++k) {
    const ActorPlace actor = at(k, time_s);
    const Vec2& p = actor.at.p_world;
    if (!passes(p, radius_of(actor.kind), ray)) continue;
    const double radius_m = radius_of(actor.kind);
    if ((p - ray.origin_world.head<2>()).norm() > hit->range_m + radius_m) continue;
    if (!world.contains(p.x(), p.y())) continue;
    met = sim::meet(actor, world.height(p.x(), p.y()), ray, hit) || met;
  }
  return met;
}

}  // namespace rcs::sim
