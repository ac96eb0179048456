#include "sim/actors/actor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "sim/actors/actor_contact.h"
#include "sim/actors/actor_draw.h"
#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

ActorPlace person_at(double x_m, double y_m) { return {ActorKind::kPerson, {{x_m, y_m}, 0.0}}; }
ActorPlace vehicle_at(double x_m, double y_m, double heading_deg) {
  return {ActorKind::kVehicle, {{x_m, y_m}, radians(heading_deg)}};
}

struct RayCase {
  const char* what;
  ActorPlace actor;
  Vec3 origin;
  Vec3 direction;  // of any length
  double range_m;  // < 0: no hit
  double cos_incidence;
};

TEST(Actor, RaysMeetItsBody) {
  const double slant = std::sqrt(0.5);
  const std::vector<RayCase> cases = {
      {"cylinder: through the axis", person_at(10, 0), {0, 0, 1}, {1, 0, 0}, 9.7, 1.0},
      {"cylinder: beside the axis", person_at(10, 0), {0, 0.18, 1}, {1, 0, 0}, 9.76, 0.8},
      {"cylinder: past it", person_at(10, 0), {0, 0.31, 1}, {1, 0, 0}, -1, 0},
      {"cylinder: behind the origin", person_at(-10, 0), {0, 0, 1}, {1, 0, 0}, -1, 0},
      {"cylinder: above it", person_at(10, 0), {0, 0, 1.81}, {1, 0, 0}, -1, 0},
      {"cylinder: on the top", person_at(10, 0), {9, 0, 2.8}, {1, 0, -1}, 1.0 / slant, slant},
      {"cylinder: from straight above", person_at(10, 0), {10.1, 0, 5}, {0, 0, -1}, 3.2, 1.0},
      {"box: its front", vehicle_at(10, 0, 180), {0, 0, 1}, {1, 0, 0}, 7.75, 1.0},
      {"box: its side", vehicle_at(10, 0, 90), {0, 0, 1}, {1, 0, 0}, 9.05, 1.0},
      {"box: across a corner", vehicle_at(10, 0, 45), {0, 0, 1}, {1, 0, 0}, 8.657, slant},
      {"box: beside it", vehicle_at(10, 0, 0), {0, 0.96, 1}, {1, 0, 0}, -1, 0},
      {"box: above it", vehicle_at(10, 0, 0), {0, 0, 1.61}, {1, 0, 0}, -1, 0},
      {"box: its roof", vehicle_at(10, 0, 0), {9, 0, 2.6}, {1, 0, -1}, 1.0 / slant, slant},
      {"box: from its inside", vehicle_at(10, 0, 0), {10, 0, 1}, {1, 0, 0}, -1, 0},
  };
  for (const RayCase& c : cases) {
    Hit hit;
    hit.range_m = 60.0;
    const bool met = meet(c.actor, 0.0, {c.origin, c.direction.normalized()}, &hit);
    EXPECT_EQ(met, c.range_m >= 0.0) << c.what;
    EXPECT_NEAR(hit.range_m, met ? c.range_m : 60.0, 1e-3) << c.what;
    if (met) {
      EXPECT_NEAR(hit.cos_incidence, c.cos_incidence, 1e-3) << c.what;
    }
    hit.range_m = std::max(0.0, c.range_m) - 1e-3;
    EXPECT_FALSE(meet(c.actor, 0.0, {c.origin, c.direction.normalized()}, &hit))
        << c.what << ": something nearer was hit";
  }
}

TEST(Actor, FollowsItsScript) {
  ActorScript script;
  script.waypoints_world = {{0, 0}, {10, 0}, {10, 5}};
  script.speed_mps = 2.0;
  struct Case {
    double moving_s;
    Vec2 p;
    double heading_deg;
  };
  for (const Case& c : {Case{-3.0, {0, 0}, 0}, Case{0.0, {0, 0}, 0}, Case{2.5, {5, 0}, 0},
                        Case{6.0, {10, 2}, 90}, Case{7.5, {10, 5}, 90}, Case{99.0, {10, 5}, 90}}) {
    const ActorPlace place = place_on(script, c.moving_s);
    EXPECT_LT((place.at.p_world - c.p).norm(), 1e-9) << c.moving_s;
    EXPECT_NEAR(degrees(place.at.heading_rad), c.heading_deg, 1e-9) << c.moving_s;
  }
}

TEST(Actor, StartsAtItsTimeAndWhenTheVehicleIsNear) {
  ActorScript timed;
  timed.waypoints_world = {{0, 0}, {10, 0}};
  timed.start_s = 5.0;
  ActorScript waiting = timed;
  waiting.within_m = 20.0;
  Actors actors({timed, waiting});
  for (double t = 0.0; t <= 4.0; t += 1.0) actors.observe({{0, 15}, 0.0}, 1.0, t);
  EXPECT_FALSE(actors.started(1, 4.0)) << "near, but before its time";
  actors.observe({{0, 50}, 0.0}, 1.0, 6.0);
  EXPECT_TRUE(actors.started(0, 6.0));
  EXPECT_FALSE(actors.started(1, 6.0)) << "the vehicle is far away";
  actors.observe({{0, 19}, 0.0}, 1.0, 8.0);
  actors.observe({{0, 90}, 0.0}, 1.0, 9.0);
  EXPECT_NEAR(actors.at(1, 10.0).at.p_world.x(), 2.0, 1e-9) << "it does not stop again";
  EXPECT_NEAR(actors.at(0, 10.0).at.p_world.x(), 5.0, 1e-9);
}

TEST(Actor, AppearsBeyondTheDistanceInWhichTheVehicleStops) {
  ActorScript script;
  script.kind = ActorKind::kVehicle;
  script.waypoints_world = {{50, 0}, {50, 1}};
  script.within_m = 8.0;
  script.appears_beyond_m = 5.0;
  Actors actors({script});
  const CoursePoint far{{30, 2}, radians(90.0)};
  actors.observe(far, 6.0, 1.0);
  EXPECT_FALSE(actors.exists(0, 1.0));
  EXPECT_GT(distance(actors.at(0, 1.0), far, Footprint()), 1e6);
  const CoursePoint near{{45, 2}, radians(90.0)};
  actors.observe(near, 6.0, 2.0);
  ASSERT_TRUE(actors.exists(0, 2.0));
  // 2.7 m until it acts, 3.6 m of braking.
  EXPECT_NEAR(stop_m(6.0), 6.3, 1e-9);
  EXPECT_NEAR(distance(actors.at(0, 2.0), near, Footprint()), 6.3 + 5.0, 1e-9);
  const ActorPlace place = actors.at(0, 2.0);
  EXPECT_NEAR(place.at.p_world.x(), 45.0, 1e-9) << "ahead of the vehicle, not on the leg";
  actors.observe({{45, 6}, radians(90.0)}, 3.0, 3.0);
  EXPECT_EQ(actors.at(0, 9.0).at.p_world, place.at.p_world) << "it stands";
}

TEST(Actor, DistanceToTheVehicle) {
  const Footprint body{3.2, 2.0};
  const CoursePoint vehicle{{0, 0}, 0.0};
  EXPECT_NEAR(distance(person_at(3.6, 0), vehicle, body), 1.7, 1e-9);
  EXPECT_NEAR(distance(person_at(1.6 + 3, 1 + 4), vehicle, body), 4.7, 1e-9);
  EXPECT_LT(distance(person_at(0, 1.2), vehicle, body), 0.0);
  EXPECT_NEAR(distance(vehicle_at(5, 0, 0), vehicle, body), 5 - 1.6 - 2.25, 1e-9);
  EXPECT_NEAR(distance(vehicle_at(0, 4, 90), vehicle, body), 4 - 1 - 2.25, 1e-9);
  EXPECT_NEAR(distance(vehicle_at(4, 5, 0), vehicle, body), std::hypot(0.15, 3.05), 1e-9);
  // Two bodies that form a cross have no corner inside one another.
  EXPECT_LT(distance(vehicle_at(0, 0, 90), vehicle, body), 0.0);
}

/// A person walks along x at 1 m/s through a vehicle at rest or in motion at the origin.
std::vector<ActorContact> contacts_with(double speed_mps, double moving_until_s) {
  ActorScript script;
  script.waypoints_world = {{-10, 0}, {10, 0}};
  const Actors actors({script});
  ActorContacts contacts;
  for (double t = 0.0; t < 20.0; t += 0.01) {
    contacts.observe(actors, {{0, 0}, 0.0}, t < moving_until_s ? speed_mps : 0.0, Footprint(), t);
  }
  EXPECT_EQ(contacts.nearest_m().size(), 1U);
  EXPECT_LT(contacts.nearest_m()[0], 0.0);
  return contacts.contacts();
}

// The person touches the rear bumper after 10 - 1.6 - 0.3 = 8.1 s.
TEST(ActorContacts, AVehicleAtRestIsRunInto) {
  struct Case {
    double moving_until_s;
    bool ran_into;
  };
  for (const Case& c : {Case{0.0, true}, Case{7.0, true}, Case{7.2, false}, Case{20.0, false}}) {
    const std::vector<ActorContact> contacts = contacts_with(2.0, c.moving_until_s);
    ASSERT_EQ(contacts.size(), 1U) << "it is counted once, while it lasts";
    EXPECT_NEAR(contacts[0].time_s, 8.1, 0.02);
    EXPECT_EQ(contacts[0].ran_into_vehicle, c.ran_into) << c.moving_until_s;
    EXPECT_NEAR(std::abs(degrees(contacts[0].bearing_rad)), 180.0, 1e-6);
  }
}

TEST(ActorDraw, OneOrTwoOnEachLegByTheSeed) {
  const std::vector<Vec2> course = {{0, 0}, {70, 0}, {70, 20}, {70, 100}};
  ActorParams params;
  EXPECT_TRUE(draw_actors(params, course, 6.0, 5.0, 1).empty());
  params.kinds = {"crossing", "following", "oncoming"};
  EXPECT_EQ(unknown_actor(params.kinds), "");
  EXPECT_EQ(unknown_actor({"crossing", "dancing"}), "dancing");
  std::size_t count = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const std::vector<ActorScript> actors = draw_actors(params, course, 6.0, 5.0, seed);
    EXPECT_GE(actors.size(), 2U) << "none on the leg of 20 m";
    EXPECT_LE(actors.size(), 4U);
    count += actors.size();
    for (const ActorScript& a : actors) {
      const bool person = a.kind == ActorKind::kPerson;
      EXPECT_GE(a.speed_mps, person ? 0.5 : 1.0);
      EXPECT_LE(a.speed_mps, person ? 2.0 : 4.0);
      EXPECT_GT(a.within_m, 0.0);
      EXPECT_GE(a.waypoints_world.size(), 2U);
    }
  }
  EXPECT_GT(count, 110U);
  EXPECT_EQ(draw_actors(params, course, 6.0, 5.0, 7)[0].waypoints_world,
            draw_actors(params, course, 6.0, 5.0, 7)[0].waypoints_world);
}

// The LADAR sees an actor where it is at the time of the shot.
TEST(Actor, TheLadarSeesItWhereItIs) {
  const World world(flat_world(), {}, {{0, 0}, {40, 0}}, 60.0);
  ActorScript script;
  script.kind = ActorKind::kVehicle;
  script.waypoints_world = {{10, -20}, {10, 20}};
  script.speed_mps = 4.0;
  const Actors actors({script});
  Beam beam(ideal_beam(), 1);
  beam.set_actors(&actors);
  const Ray ray{{0, 0, 1}, {1, 0, 0}};
  double cos_incidence = 0.0;
  EXPECT_EQ(beam.cast(world, ray, 4.4, &cos_incidence), 0.0);
  EXPECT_NEAR(beam.cast(world, ray, 5.0, &cos_incidence), 10.0 - 0.95, 1e-9);
  EXPECT_NEAR(cos_incidence, 1.0, 1e-9);
  EXPECT_EQ(beam.cast(world, ray, 5.6, &cos_incidence), 0.0);
  // It hides the ground behind it.
  const Ray down{{0, 0, 1}, Vec3(1, 0, -0.05).normalized()};
  EXPECT_NEAR(beam.cast(world, down, 5.6, &cos_incidence), std::hypot(20.0, 1.0), 1e-3);
  EXPECT_LT(beam.cast(world, down, 5.0, &cos_incidence), 9.2);
}

}  // namespace
}  // namespace rcs::sim
