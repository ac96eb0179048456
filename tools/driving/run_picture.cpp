#include "tools/driving/run_picture.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tools/driving/course_picture.h"

namespace rcs::driving {

std::string draw(const ClosedLoopRun& run, const sim::Scenario& scenario,
                 const std::string& title) {
  const sim::Simulator simulator(scenario);
  CoursePicture picture;
  picture.world = &simulator.world();
  picture.title = title;
  picture.facts = {fmt::format(
      "{} of {} waypoints, {:.0f} m in {:.0f} s; contacts: ground {}, rocks and trunks {} (nearest "
      "{:.1f} m)",
      run.reached, run.waypoints_world.size(), run.distance_m, run.time_s, run.contacts.total(),
      run.collisions, run.min_clearance_m)};
  if (!run.actors.actors.empty()) {
    picture.facts.push_back(fmt::format(
        "moving actors: {} met; contacts {}, ran into the vehicle at rest {}", run.actors.met(),
        run.actors.contacts_of_vehicle(), run.actors.ran_into_vehicle()));
  }
  for (const ActorRecord& actor : run.actors.actors) {
    if (!actor.path_world.empty()) picture.actors_world.push_back(actor.path_world);
  }
  for (const Zone& zone : run.zones_world) {
    for (const ZonePolygon& polygon : zone.polygons) {
      picture.zones_world.push_back({polygon.outer, zone.kind});
      for (const ZoneRing& hole : polygon.holes) picture.zones_world.push_back({hole, zone.kind});
    }
  }
  if (run.zones.judged) {
    picture.facts.push_back(fmt::format("zones: entered {} times, smallest clearance {:.1f} m",
                                        run.zones.entries, run.zones.min_clearance_m));
  }
  picture.waypoints_world = run.waypoints_world;
  for (const ClosedLoopSample& s : run.trace) {
    const Vec3 ahead = s.T_world_vehicle.q * Vec3::UnitX();
    CourseSample sample;
    sample.place_world = s.T_world_vehicle.p.head<2>();
    sample.heading_rad = std::atan2(ahead.y(), ahead.x());
    sample.speed_mps = s.speed_mps;
    sample.gps = s.gps;
    sample.hit = s.contact;
    if (s.estimated) sample.estimated_world = Vec2(s.T_world_estimated.p.head<2>());
    picture.samples.push_back(sample);
  }
  for (const routes_t& choice : run.routes) {
    for (const route_t& r : choice.route) {
      CoursePicture::Route route{{}, r.verdict == route_t::VERDICT_CHOSEN};
      for (std::size_t k = 0; k < r.x_m.size(); ++k) {
        route.points_world.emplace_back(r.x_m[k], r.y_m[k]);
      }
      picture.routes_world.push_back(std::move(route));
    }
  }
  for (const ClosedLoopPlan& plan : run.plans) picture.plans_world.push_back(plan.points_world);
  return render(picture);
}

}  // namespace rcs::driving
