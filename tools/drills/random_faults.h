#pragma once
// Drills with randomly drawn faults: terrain, source, kind, size, begin, length, and whether GPS is
// received.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// A class of faults; its sizes are drawn from the range that `about` states.
struct FaultClass {
  DrillSource source;
  std::string_view name;
  std::string_view about;
};

/// All classes of faults, grouped by source.
[[nodiscard]] const std::vector<FaultClass>& fault_classes();

/// The faults of one run.
struct RandomFault {
  std::vector<std::size_t> classes;  ///< indices in fault_classes(), by source
  bool gps_lost = false;             ///< GPS is denied from before the faults until after them
  Drill drill;                       ///< without limits; the id contains the index of the run
  std::int64_t seed = 0;             ///< of the scene
};

/// Conditions of a series of runs.
struct RandomFaultPlan {
  std::vector<std::string> scenarios;  ///< paths
  std::int64_t first_seed = 1;
  int faults = 1;                 ///< at the same time, of different sources
  int runs_of_a_scene = 10;       ///< which share a rendering
  std::vector<std::string> only;  ///< names of classes or sources to draw from; empty: all
};

/// Run `index` of a series. The classes are drawn in turn, so that each has the same number of
/// runs; everything else is a function of the seed and the index.
/// @pre plan.scenarios is not empty, and `only` selects at least `faults` sources
[[nodiscard]] RandomFault random_fault(const RandomFaultPlan& plan, int index);

/// Indices of the classes that `only` selects.
[[nodiscard]] std::vector<std::size_t> selected_classes(const std::vector<std::string>& only);

}  // namespace rcs::drills
