#pragma once
// Runs many drills over many seeds in parallel.

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
  std::string scenario;  ///< for drills that name none
  int seeds = 0;         ///< for every drill; 0: the number in the drill
  bool full = false;     ///< use seeds_full of the drills
  std::int64_t first_seed = 1;
  std::size_t jobs = 1;      ///< threads
  std::string logs_folder;   ///< for a log of the first seed of each drill; empty: none
  bool keep_records = true;  ///< of the first seed of each drill, for the pictures
  std::function<bool()> stop;
  /// Called with the record of every run and the indices of its drill and seed; from any thread.
  /// May be empty.
  std::function<void(std::size_t drill, std::size_t run, const DrillRecord& record)> look;
  /// Called from the calling thread with the completed share.
  std::function<void(double)> progress;
};

/// @return results in the order of the drills, or an error after `stop`
[[nodiscard]] Result<std::vector<DrillResult>> run_campaign(const DrillCampaign& campaign);

}  // namespace rcs::drills
