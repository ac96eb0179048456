#include "tools/driving/drive_campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <mutex>
#include <numeric>
#include <utility>

#include "rcs/node/log/log_file.h"
#include "rcs/node/log/log_source.h"
#include "sim/scenario_file.h"
#include "tools/base/files.h"
#include "tools/base/threads.h"
#include "tools/driving/run_picture.h"

namespace rcs::driving {
namespace {

class Campaign {
 public:
  explicit Campaign(const DriveCampaign& campaign)
      : campaign_(campaign), rows_(campaign.seeds.size()), shares_(campaign.seeds.size()) {}

  Result<std::vector<DriveRow>> run() {
    const std::size_t workers = std::min(campaign_.jobs, rows_.size());
    tools::in_threads(std::max<std::size_t>(1, workers), [this](std::size_t) {
      for (std::size_t k = next_++; k < rows_.size(); k = next_++) {
        if (campaign_.stop() || failed()) return;
        const Outcome done = drive(k);
        if (done) continue;
        const std::lock_guard<std::mutex> lock(mutex_);
        if (error_.empty()) error_ = done.error().message;
      }
    });
    if (campaign_.stop()) return Error{"interrupted"};
    if (failed()) return Error{error_};
    return std::move(rows_);
  }

 private:
  bool failed() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return !error_.empty();
  }

  void report(std::size_t k, double share) {
    const std::lock_guard<std::mutex> lock(mutex_);
    shares_[k] = std::clamp(share, 0.0, 1.0);
    campaign_.progress(std::accumulate(shares_.begin(), shares_.end(), 0.0) /
                       static_cast<double>(shares_.size()));
  }

  Outcome drive(std::size_t k) {
    DriveRow& row = rows_[k];
    row.seed = campaign_.seeds[k];
    sim::ScenarioOverrides overrides;
    overrides.seed = row.seed;
    overrides.gps_lost_after_m = campaign_.gps_lost_after_m;
    overrides.duration_s = campaign_.duration_s;
    Result<sim::Scenario> scenario = sim::load_scenario(campaign_.scenario, overrides);
    if (!scenario) return scenario.error();
    if (!scenario->commanded) {
      return Error{campaign_.scenario + ": [drive] mode = \"commanded\" is required: BG drives"};
    }
    ClosedLoopOptions options;
    options.vehicle_config = campaign_.vehicle_config;
    options.more_config = campaign_.more_config;
    options.frame = campaign_.frame;
    options.level = campaign_.level;
    options.alert_limit_m = campaign_.alert_limit_m;
    if (campaign_.losses) options.losses = draw_losses(static_cast<std::uint64_t>(row.seed));
    options.stop = campaign_.stop;
    options.progress = [this, k](double share) { report(k, share); };
    const std::string stem = campaign_.out_folder.empty()
                                 ? ""
                                 : fmt::format("{}/drive_{}", campaign_.out_folder, row.seed);
    std::optional<tools::OutputFile> file;
    std::optional<LogWriter> log;
    std::optional<LogRecorder> recorder;
    if (campaign_.logs) {
      file.emplace(stem + ".log");
      Result<LogWriter> writer = LogWriter::create(file->write_path());
      if (!writer) return writer.error();
      log.emplace(std::move(writer).value());
      recorder.emplace(&*log, std::vector<std::string>{});
      options.tap = &*recorder;
    }
    if (campaign_.prior_map) {
      options.prior_map = std::filesystem::absolute(stem + "_map").string();
    }
    // Absolute: a path in a configuration is relative to its file.
    if (!campaign_.zones_file.empty()) {
      options.zones = std::filesystem::absolute(campaign_.zones_file).string();
    }
    if (campaign_.zones) {
      const std::vector<Zone> drawn =
          draw_zones(scenario->course.waypoints_world, static_cast<std::uint64_t>(row.seed));
      options.zones = std::filesystem::absolute(stem + "_zones.geojson").string();
      Outcome written =
          tools::write_text(options.zones, to_geojson(drawn, LocalFrame(scenario->datum)));
      if (!written) return written;
    }
    row.run = run_closed_loop(*scenario, options, make_bg);
    if (!row.run.config_error.empty()) return Error{row.run.config_error};
    if (campaign_.stop()) return Done{};
    if (log) {
      Outcome written = log->close();
      if (written) written = file->commit();
      if (!written) return written;
    }
    report(k, 1.0);
    if (stem.empty()) return Done{};
    return tools::write_text(stem + ".svg",
                             draw(row.run, *scenario, fmt::format("Drive with seed {}", row.seed)));
  }

  const DriveCampaign& campaign_;
  std::vector<DriveRow> rows_;
  std::vector<double> shares_;
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::string error_;
};

}  // namespace

int contacts(const ClosedLoopRun& run) {
  return run.contacts.total() + run.collisions + run.actors.contacts_of_vehicle();
}

bool passed(const ClosedLoopRun& run) {
  const bool all_reached = run.reached == static_cast<int>(run.waypoints_world.size());
  return run.done && all_reached && contacts(run) == 0 && run.alerts.late == 0 &&
         run.zones.entries == 0;
}

Result<std::vector<DriveRow>> run_drives(const DriveCampaign& campaign) {
  return Campaign(campaign).run();
}

}  // namespace rcs::driving
