#pragma once
// The whole chain in one thread: the reference simulation drives SP and WM in lockstep, and what WM
// says is kept beside the truth.

#include <functional>
#include <string>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "rcs/node/node.h"
#include "sim/scenario.h"

namespace rcs::test {

struct TruthSample {
  Stamp stamp;
  Pose T_world_vehicle;
  Vec3 v_world;
};

struct BeliefSample {
  Stamp stamp;
  Pose T_world_vehicle;
  Vec3 v_world;
  Mat6 covariance;  ///< of T_world_vehicle, right perturbation
  Mat3 v_covariance;
  bool world_valid = false;
};

struct ChainRun {
  std::vector<TruthSample> truth;
  std::vector<BeliefSample> beliefs;
  int scans = 0;
  int failed = 0;  ///< registrations to the rolling map without a usable answer
  int prior_matches = 0;

  /// The last belief published for a moment not later than `stamp`, with the truth of its own
  /// moment; false before there is one.
  [[nodiscard]] bool at(Stamp stamp, BeliefSample* belief, TruthSample* truth) const;
};

struct ChainOptions {
  bool ladar = true;
  bool odometry = true;
  bool prior_map = true;
  /// Called around every cycle with the node that runs, before (true) and after (false); may be
  /// empty.
  std::function<void(const Node&, bool)> around_cycle;
};

/// @param vehicle_config  path of a vehicle's configuration
[[nodiscard]] ChainRun run_chain(const sim::Scenario& scenario, const std::string& vehicle_config,
                                 const ChainOptions& options);

/// Normalized estimation error squared per degree of freedom.
struct Nees {
  double position = 0.0;
  double attitude = 0.0;
  double velocity = 0.0;
  double pose = 0.0;  ///< position and attitude, with their correlation
};
[[nodiscard]] Nees nees(const BeliefSample& belief, const TruthSample& truth);

/// Root of RCS_SOURCE_DIR, which the tests' CMake sets.
[[nodiscard]] std::string source_path(const std::string& relative);

}  // namespace rcs::test
