#include "tools/driving/actor_notes.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"

namespace rcs::driving {
namespace {

constexpr double kCell_m = 0.4;
constexpr double kNear_m = 40.0;     // of the vehicle: actors that leave traces in its map
constexpr double kBeside_m = 0.8;    // of an actor or an object: it may be the obstacle
constexpr double kViewNear_m = 3.0;  // distance from the LADAR within which ...
constexpr double kViewFar_m = 25.0;  // ... its rays pass the cells of the map densely enough
constexpr double kHalfView_rad = radians(42.0);
constexpr double kRange_m = 60.0;  // of the LADAR
constexpr double kAbove_m = 0.5;   // height above the ground that must be in view

Vec2 centre_of(const std::pair<int, int>& cell) {
  return kCell_m * Vec2(cell.first + 0.5, cell.second + 0.5);
}

double time_of(std::int64_t utime) { return seconds(from_utime(utime) - sim::Simulator::kStart); }

}  // namespace

int ActorGround::late() const {
  return static_cast<int>(std::count_if(free_after_s.begin(), free_after_s.end(),
                                        [](double s) { return s > kLimit_s; }));
}

int ActorOutcome::met() const {
  return static_cast<int>(std::count_if(actors.begin(), actors.end(), [](const ActorRecord& a) {
    return a.nearest_m < sim::ActorContacts::kFar_m;
  }));
}

int ActorOutcome::ran_into_vehicle() const {
  return static_cast<int>(
      std::count_if(contacts.begin(), contacts.end(),
                    [](const sim::ActorContact& c) { return c.ran_into_vehicle; }));
}

int ActorOutcome::contacts_of_vehicle() const {
  return static_cast<int>(contacts.size()) - ran_into_vehicle();
}

ActorNotes::ActorNotes(Bus* bus, const sim::Simulator& simulator)
    : simulator_(simulator),
      actors_(simulator.actors().size()),
      truth_(bus, channel::kSimTruth, [this](const truth_t& m, Stamp) { accept(m); }),
      nav_(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp) { accept(m); }),
      patches_(bus, channel::kWmMapPatch,
               [this](const map_patch_t& m, Stamp) { accept(m, now_s_); }) {
  for (std::size_t k = 0; k < actors_.size(); ++k) {
    actors_[k].kind = simulator.actors().script(k).kind;
  }
}

void ActorNotes::accept(const truth_t& m) {
  RCS_CHECK(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle_));
  now_s_ = time_of(m.utime);
  if (m.seq % 10 != 0) return;
  const sim::Actors& actors = simulator_.actors();
  for (std::size_t k = 0; k < actors.size(); ++k) {
    if (!actors.exists(k, now_s_)) continue;
    const Vec2 p = actors.at(k, now_s_).at.p_world;
    std::vector<Vec2>& path = actors_[k].path_world;
    if (path.empty() || path.back() != p) path.push_back(p);
    if ((p - T_world_vehicle_.p.head<2>()).norm() < kNear_m) tread(k, now_s_);
  }
}

// The cells under an actor.
void ActorNotes::tread(std::size_t actor, double now_s) {
  constexpr int kAround = 7;  // cells from the centre of the largest body
  const sim::ActorPlace place = simulator_.actors().at(actor, now_s);
  const int i0 = static_cast<int>(std::floor(place.at.p_world.x() / kCell_m));
  const int j0 = static_cast<int>(std::floor(place.at.p_world.y() / kCell_m));
  for (int j = j0 - kAround; j <= j0 + kAround; ++j) {
    for (int i = i0 - kAround; i <= i0 + kAround; ++i) {
      const Vec2 centre = centre_of({i, j});
      if (distance(place, centre) > 0.5 * kCell_m) continue;
      const auto [it, fresh] = ground_.try_emplace({i, j});
      if (fresh) {
        std::vector<sim::Spheroid> objects;
        simulator_.world().objects_near(centre, 4.0, &objects);
        it->second.beside_object =
            std::any_of(objects.begin(), objects.end(), [&](const sim::Spheroid& o) {
              return (o.centre_world.head<2>() - centre).norm() < o.radius_m + kBeside_m;
            });
      }
      it->second.left_s = now_s;
      it->second.in_view_s = 0.0;
      it->second.obstacle = false;
    }
  }
}

// With the pose of the same moment.
void ActorNotes::accept(const nav_state_t& m) {
  Pose T_local_vehicle;
  RCS_CHECK(from_message(m.q_local_vehicle, m.p_local_vehicle_m, &T_local_vehicle));
  const double time_s = std::max(0.0, time_of(m.utime));
  T_world_local_ = simulator_.vehicle().pose_at(time_s) * T_local_vehicle.inverse();
  located_ = true;
}

bool ActorNotes::actor_within(const Vec2& place_world, double distance_m, double now_s) const {
  const sim::Actors& actors = simulator_.actors();
  for (std::size_t k = 0; k < actors.size(); ++k) {
    if (distance(actors.at(k, now_s), place_world) < distance_m) return true;
  }
  return false;
}

bool ActorNotes::in_view(const Vec2& place_world, double now_s) const {
  const Vec3 ladar = T_world_vehicle_ * Vec3(0.9, 0.0, 0.9);
  const Vec3 ahead = T_world_vehicle_.q * Vec3::UnitX();
  const Vec2 to = place_world - ladar.head<2>();
  const double bearing_rad =
      wrap_angle(std::atan2(to.y(), to.x()) - std::atan2(ahead.y(), ahead.x()));
  if (std::abs(bearing_rad) > kHalfView_rad) return false;
  if (to.norm() < kViewNear_m || to.norm() > kViewFar_m) return false;
  if (!simulator_.world().contains(place_world.x(), place_world.y())) return false;
  const double ground_m = simulator_.world().height(place_world.x(), place_world.y());
  // A ray that passes above the place must end within the range of the LADAR behind it, else it
  // shows nothing.
  const Vec3 target(place_world.x(), place_world.y(), ground_m + kAbove_m);
  const Vec3 way = target - ladar;
  const sim::Ray ray{ladar, way.normalized()};
  sim::Hit hit;
  if (!simulator_.world().cast(ray, kRange_m, now_s, 0, &hit)) return false;
  (void)simulator_.actors().meet(simulator_.world(), ray, now_s, &hit);
  return hit.range_m > way.norm() + kBeside_m;
}

void ActorNotes::accept(const map_patch_t& m, double now_s) {
  const double since_s = now_s - patch_s_;
  patch_s_ = now_s;
  if (!located_) return;
  const double scan_s = time_of(m.utime);
  const Pose T_local_world = T_world_local_.inverse();
  for (auto it = ground_.begin(); it != ground_.end();) {
    Trodden& cell = it->second;
    const Vec2 centre = centre_of(it->first);
    const Vec3 p_local = T_local_world * Vec3(centre.x(), centre.y(), T_world_vehicle_.p.z());
    const int i = static_cast<int>(std::floor(p_local.x() / m.cell_m)) - m.first_i;
    const int j = static_cast<int>(std::floor(p_local.y() / m.cell_m)) - m.first_j;
    const bool inside = i >= 0 && j >= 0 && i < m.width && j < m.height;
    if (!inside || scan_s <= cell.left_s || cell.beside_object ||
        actor_within(centre, kBeside_m, now_s)) {
      ++it;
      continue;
    }
    const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(m.width) +
                           static_cast<std::size_t>(i);
    const bool obstacle = (m.flags[at] & map_patch_t::FLAG_OBSTACLE) != 0;
    if (obstacle) {
      cell.obstacle = true;
      if (in_view(centre, now_s)) cell.in_view_s += since_s;
      ++it;
      continue;
    }
    if (cell.obstacle) free_after_s_.push_back(cell.in_view_s);
    it = ground_.erase(it);
  }
}

ActorOutcome ActorNotes::outcome() const {
  ActorOutcome out;
  out.actors = actors_;
  const std::vector<double>& nearest_m = simulator_.actor_contacts().nearest_m();
  for (std::size_t k = 0; k < out.actors.size() && k < nearest_m.size(); ++k) {
    out.actors[k].nearest_m = nearest_m[k];
    const double start_s = simulator_.actors().start_s(k);
    if (std::isfinite(start_s)) out.actors[k].start_s = start_s;
  }
  out.contacts = simulator_.actor_contacts().contacts();
  out.ground.free_after_s = free_after_s_;
  for (const auto& [key, cell] : ground_) {
    if (!cell.obstacle) continue;
    ++out.ground.remaining;
    out.ground.free_after_s.push_back(cell.in_view_s);
  }
  std::sort(out.ground.free_after_s.begin(), out.ground.free_after_s.end());
  return out;
}

}  // namespace rcs::driving
