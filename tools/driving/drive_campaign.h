#pragma once
// Closed-loop drives of one scenario over many seeds, in parallel.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/driving/closed_loop.h"

namespace rcs::driving {

struct DriveCampaign {
  std::string scenario;        ///< path
  std::string vehicle_config;  ///< path
  std::string more_config;     ///< TOML text behind it
  std::int8_t frame = 0;       ///< of the commands, command_t::FRAME_*
  Level level = Level::kBg;
  std::vector<std::int64_t> seeds;
  std::optional<double> gps_lost_after_m;
  double alert_limit_m = 0.0;  ///< horizontal, of the commands; 0: that of the vehicle
  bool losses = false;         ///< draw_losses() by the seed
  bool zones = false;          ///< draw_zones() by the seed; with out_folder
  std::string zones_file;      ///< zones of all drives (GeoJSON); empty: none
  bool prior_map = false;      ///< the vehicle has the simulator's survey; with out_folder
  std::optional<double> duration_s;
  std::string out_folder;  ///< for a picture of each drive; empty: none
  bool logs = false;       ///< also a log of each drive
  std::size_t jobs = 1;    ///< threads
  std::function<bool()> stop;
  std::function<void(double)> progress;  ///< completed share; from any thread
};

struct DriveRow {
  std::int64_t seed = 0;
  ClosedLoopRun run;
};

/// With the ground, with objects and with moving actors, but for actors that ran into the vehicle
/// at rest.
[[nodiscard]] int contacts(const ClosedLoopRun& run);
/// Arrived, truly in all waypoints, without contact, stopped at every alert limit, and entered no
/// forbidden ground.
[[nodiscard]] bool passed(const ClosedLoopRun& run);

/// @return rows in the order of the seeds, or an error: of the files, or after `stop`
[[nodiscard]] Result<std::vector<DriveRow>> run_drives(const DriveCampaign& campaign);

}  // namespace rcs::driving
