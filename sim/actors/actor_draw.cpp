#include "sim/actors/actor_draw.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "sim/base/random.h"

namespace rcs::sim {
namespace {

constexpr std::array<std::string_view, 4> kKinds = {"crossing", "following", "oncoming",
                                                    "appearing"};
constexpr double kShortest_m = 30.0;  // leg with actors
constexpr double kBeyond_m = 12.0;    // of a crossing, behind the line of the leg
constexpr double kTurnOff_m = 14.0;   // of a path along the leg, at its end, to the side

/// A leg of the course, and places next to it.
struct Leg {
  Vec2 from;
  Vec2 ahead;  // unit
  double length_m;

  [[nodiscard]] Vec2 at(double ahead_m, double left_m) const {
    return from + ahead_m * ahead + left_m * Vec2(-ahead.y(), ahead.x());
  }
};

/// Numbers that are drawn for each actor, whatever its kind.
struct Draw {
  double speed_mps;
  double along;  // [0, 1)
  double side;   // -1 or 1
  double turn;   // [-1, 1)
  double lead;   // [0, 1)
  double gap;    // [0, 1)
};

ActorScript crossing(const Leg& leg, const Draw& d, double at_m, double approach_mps,
                     ActorScript script) {
  // Far enough from the leg to be passed while it stands.
  const double shortest_m = script.kind == ActorKind::kPerson ? 4.0 : 7.0;
  const double before_m = std::max(shortest_m, (2.5 + 3.5 * d.lead) * d.speed_mps);
  const double turn = radians(30.0) * d.turn;
  const Vec2 across =
      std::cos(turn) * d.side * Vec2(-leg.ahead.y(), leg.ahead.x()) + std::sin(turn) * leg.ahead;
  const Vec2 middle = leg.at(at_m, 0.0);
  script.waypoints_world = {middle - before_m * across, middle + kBeyond_m * across};
  // When the actor is on the leg, the vehicle is up to this far from there.
  const double gap_m = 2.0 + 8.0 * d.gap;
  const double vehicle_m = approach_mps * before_m / d.speed_mps + gap_m;
  script.within_m = (leg.at(at_m - vehicle_m, 0.0) - script.waypoints_world.front()).norm();
  return script;
}

ActorScript following(const Leg& leg, const Draw& d, double at_m, ActorScript script) {
  const double left_m = 0.5 * d.turn;
  const double end_m = std::max(at_m + 10.0, (0.7 + 0.2 * d.lead) * leg.length_m);
  script.waypoints_world = {leg.at(at_m, left_m), leg.at(end_m, left_m),
                            leg.at(end_m + 0.5 * kTurnOff_m, d.side * kTurnOff_m)};
  script.within_m = 12.0 + 15.0 * d.gap;
  return script;
}

ActorScript oncoming(const Leg& leg, const Draw& d, ActorScript script) {
  const double left_m = d.turn;
  const double begin_m = (0.8 + 0.2 * d.along) * leg.length_m;
  script.waypoints_world = {leg.at(begin_m, left_m), leg.at(8.0, left_m),
                            leg.at(0.0, d.side * kTurnOff_m)};
  script.within_m = 20.0 + 20.0 * d.gap;
  return script;
}

ActorScript appearing(const Leg& leg, double at_m, ActorScript script) {
  script.waypoints_world = {leg.at(at_m, 0.0), leg.at(at_m, 1.0)};
  script.within_m = 8.0;  // the vehicle may pass beside the line of the leg
  script.appears_beyond_m = 5.0;
  return script;
}

}  // namespace

std::string unknown_actor(const std::vector<std::string>& kinds) {
  for (const std::string& kind : kinds) {
    if (std::find(kKinds.begin(), kKinds.end(), kind) == kKinds.end()) return kind;
  }
  return "";
}

std::vector<ActorScript> draw_actors(const ActorParams& params,
                                     const std::vector<Vec2>& waypoints_world, double approach_mps,
                                     double rest_s, std::uint64_t seed) {
  std::vector<ActorScript> out;
  if (params.kinds.empty()) return out;
  Random random(seed, Stream::kActors);
  const auto within = [&random](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  for (std::size_t k = 1; k < waypoints_world.size(); ++k) {
    const Vec2 way = waypoints_world[k] - waypoints_world[k - 1];
    const Leg leg{waypoints_world[k - 1], way.normalized(), way.norm()};
    const auto most = static_cast<std::uint64_t>(std::max(1, params.max_per_leg));
    const int count = 1 + static_cast<int>(random.bits() % most);
    bool last = leg.length_m < kShortest_m;
    for (int n = 0; n < count; ++n) {
      const std::string& kind = params.kinds[random.bits() % params.kinds.size()];
      ActorScript script;
      const bool person = random.uniform() < params.people_share;
      script.kind = person ? ActorKind::kPerson : ActorKind::kVehicle;
      script.speed_mps = person ? within(params.person_min_mps, params.person_max_mps)
                                : within(params.vehicle_min_mps, params.vehicle_max_mps);
      script.start_s = rest_s;
      const double along = random.uniform();
      const double side = random.bits() % 2 == 0 ? 1.0 : -1.0;
      const double turn = within(-1.0, 1.0);
      const double lead = random.uniform();
      const double gap = random.uniform();
      if (last) continue;
      const Draw d{script.speed_mps, along, side, turn, lead, gap};
      // The actors of a leg are behind one another.
      const double share = (n + 0.3 + 0.4 * along) / count;
      const double at_m = (0.25 + 0.6 * share) * leg.length_m;
      if (kind == "crossing") {
        out.push_back(crossing(leg, d, at_m, approach_mps, script));
      } else if (kind == "following") {
        out.push_back(following(leg, d, std::min(at_m, 0.6 * leg.length_m), script));
        last = true;
      } else if (kind == "appearing") {
        out.push_back(appearing(leg, at_m, script));
      } else {
        out.push_back(oncoming(leg, d, script));
      }
    }
  }
  return out;
}

}  // namespace rcs::sim
