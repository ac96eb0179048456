#pragma once
// Many drills over many seeds, beside one another.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/drills/drill_run.h"

namespace rcs::drills {

struct DrillCampaign {
  std::vector<Drill> drills;
  DrillVehicle vehicle;
  std::string log;       ///< path; empty: the scenario
  std::string scenario;  ///< of drills that name none
  int seeds = 0;         ///< of every drill; 0: as it says itself
  bool full = false;     ///< as many seeds as a drill wants when there is time
  std::int64_t first_seed = 1;
  std::size_t jobs = 1;     ///< threads
  std::string logs_folder;  ///< for a log of each drill's first seed; empty: none
  std::function<bool()> stop;
  /// Shown the record of every run, by the places of its drill and of its seed; from any thread.
  /// Empty: nobody looks.
  std::function<void(std::size_t drill, std::size_t run, const DrillRecord& record)> look;
  /// From the calling thread, with the share that is done.
  std::function<void(double)> progress;
};

/// @return as the drills were given, or an error when `stop` said so
[[nodiscard]] Result<std::vector<DrillResult>> run_campaign(const DrillCampaign& campaign);

}  // namespace rcs::drills
