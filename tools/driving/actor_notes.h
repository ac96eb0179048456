#pragma once
// What a closed-loop drive has to do with the moving actors of its scenario: their paths, contacts,
// and how long WM's map keeps obstacles where they were.

#include <map>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/node/bus/tap.h"
#include "sim/simulator.h"

namespace rcs::driving {

struct ActorRecord {
  sim::ActorKind kind = sim::ActorKind::kPerson;
  double start_s = -1.0;   ///< simulation time; negative: it did not start
  double nearest_m = 0.0;  ///< to the vehicle since it started; see sim/actors/actor_contact.h
  std::vector<Vec2> path_world;  ///< every 0.1 s while it moves
};

/// A cell of the ground on which an actor was, and that was an obstacle in the map after that: the
/// time until it was none, as far as it was in view of the LADAR.
struct ActorGround {
  static constexpr double kLimit_s = 2.0;
  std::vector<double> free_after_s;  ///< by cell, sorted
  int remaining = 0;                 ///< of these cells: still obstacles when last in the map
  [[nodiscard]] double worst_s() const { return free_after_s.empty() ? 0.0 : free_after_s.back(); }
  [[nodiscard]] int late() const;  ///< cells above the limit
};

struct ActorOutcome {
  std::vector<ActorRecord> actors;
  std::vector<sim::ActorContact> contacts;
  ActorGround ground;

  [[nodiscard]] int met() const;  ///< actors that moved within 30 m of the vehicle
  [[nodiscard]] int contacts_of_vehicle() const;
  [[nodiscard]] int ran_into_vehicle() const;
};

/// Records a run from its bus.
class ActorNotes {
 public:
  /// @param simulator  outlives it
  ActorNotes(Bus* bus, const sim::Simulator& simulator);
  [[nodiscard]] ActorOutcome outcome() const;

 private:
  /// Since the last actor left.
  struct Trodden {
    double left_s = 0.0;
    double in_view_s = 0.0;
    bool obstacle = false;
    bool beside_object = false;  // a rock or a plant may be the obstacle
  };
  using Key = std::pair<int, int>;

  void accept(const truth_t& m);
  void accept(const nav_state_t& m);
  void accept(const map_patch_t& m, double now_s);
  void tread(std::size_t actor, double now_s);
  [[nodiscard]] bool actor_within(const Vec2& place_world, double distance_m, double now_s) const;
  [[nodiscard]] bool in_view(const Vec2& place_world, double now_s) const;

  const sim::Simulator& simulator_;
  std::vector<ActorRecord> actors_;
  std::map<Key, Trodden> ground_;
  std::vector<double> free_after_s_;
  double now_s_ = 0.0;  // of the newest truth
  double patch_s_ = 0.0;
  Pose T_world_vehicle_;
  Pose T_world_local_;
  bool located_ = false;
  Tap<truth_t> truth_;
  Tap<nav_state_t> nav_;
  Tap<map_patch_t> patches_;
};

}  // namespace rcs::driving
