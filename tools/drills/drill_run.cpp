#include "tools/drills/drill_run.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/executor.h"
#include "rcs/prior/prior_terrain.h"
#include "tools/base/files.h"
#include "tools/drills/drill_stimulus.h"
#include "tools/mapping/coarser.h"

namespace rcs::drills {
namespace {

std::vector<Stimulus> stimuli_of(const Drill& drill, const DrillRunOptions& options) {
  if (options.undisturbed) return {};
  std::vector<Stimulus> stimuli = drill.stimuli;
  const double begin_s = drill.begin_s();
  const auto withhold = [&](DrillSource source) {
    stimuli.push_back(dropout(source, begin_s, kForGood_s));
  };
  const bool inertial = options.denied == Denied::kLadarOdometryAndGps;
  if (inertial) withhold(DrillSource::kOdometry);
  if (inertial || options.denied == Denied::kLadar) withhold(DrillSource::kLadar);
  if (inertial || options.denied == Denied::kGps) withhold(DrillSource::kGps);
  return stimuli;
}

Result<PriorTerrain> prior_terrain_of(const Drill& drill, const DrillVehicle& vehicle,
                                      Scene* scene) {
  if (!drill.run.prior_map) return open_prior_terrain(vehicle.sp.prior_terrain, false);
  const sim::PriorMap wrong = wrong_map(scene->prior_map(drill.run.map_cell_m),
                                        drill.run.map_shift_m, drill.run.map_turn_rad);
  Result<ElevationMap> map =
      ElevationMap::from_rasters(wrong.frame, mapping::with_coarser_levels(wrong.raster));
  if (!map) return map.error();
  return PriorTerrain(std::move(map).value(), nullptr);
}

}  // namespace

Result<DrillVehicle> load_drill_vehicle(const std::string& path) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  const Result<sp::SpConfig> sp = sp::load_sp_config(*file);
  if (!sp) return sp.error();
  const Result<wm::WmConfig> wm = wm::load_wm_config(*file);
  if (!wm) return wm.error();
  // Each run opens the map again; report problems of the map before the first run.
  const Result<PriorTerrain> prior = open_prior_terrain(sp->prior_terrain, false);
  if (!prior) return prior.error();
  return DrillVehicle{*sp, *wm};
}

Result<DrillRunResult> run_drill(const Drill& drill, const DrillVehicle& vehicle, Scene* scene,
                                 const DrillRunOptions& options) {
  Result<std::unique_ptr<EventSource>> opened =
      scene->open(drill.run.length_s, options.stop, options.progress);
  if (!opened) return opened.error();
  Result<PriorTerrain> prior = prior_terrain_of(drill, vehicle, scene);
  if (!prior) return prior.error();
  std::optional<tools::OutputFile> log_file;
  std::optional<LogWriter> log;
  if (!options.log.empty()) {
    if (Outcome checked = tools::check_output(options.log); !checked) return checked.error();
    log_file.emplace(options.log);
    Result<LogWriter> writer = LogWriter::create(log_file->write_path());
    if (!writer) return writer.error();
    log.emplace(std::move(writer).value());
  }

  sp::SpConfig sp_config = vehicle.sp;
  sp_config.grant.nominal_unit_ns /= drill.run.grant_share;
  if (drill.run.ladar_rows > 0) sp_config.ladar.rows = drill.run.ladar_rows;
  if (drill.run.ladar_cols > 0) sp_config.ladar.cols = drill.run.ladar_cols;
  wm::WmConfig wm_config = vehicle.wm;
  if (!drill.run.ins.empty()) wm_config.params.ins = wm::ins_grade(drill.run.ins);

  LocalBus bus;
  DrillRecorder recorder(drill.stimuli, options.reference, log ? &*log : nullptr);
  bus.set_tap(&recorder);
  const std::int64_t run_id = id_of(drill.id, scene->key().seed);
  bus.set_publisher({run_id, id_of("sp")});
  sp::SpNode sp_node(sp_config, std::move(prior).value(), &bus);
  bus.set_publisher({run_id, id_of("wm")});
  wm::WmNode wm_node(wm_config, &bus);
  StimulatedSource source(opened->get(), stimuli_of(drill, options),
                          static_cast<std::uint64_t>(scene->key().seed));
  LockstepTimeline timeline(&bus, &source, kReplayTail);
  const RunReport report = rcs::run({&sp_node, &wm_node}, timeline, nullptr);
  if (options.stop()) return Error{"interrupted"};
  if (log) {
    Outcome written = log->close();
    if (written) written = log_file->commit();
    if (!written) return written.error();
  }

  DrillRunResult result{recorder.take(), recorder.datum()};
  for (const NodeReport& node : report.nodes) {
    result.record.overruns += node.overruns;
    result.record.missed += node.missed;
  }
  result.record.p_vehicle_antenna = wm_config.params.gps.lever_m;
  if (!result.record.begin) return Error{"no sensor data"};
  const double drive_s = seconds(result.record.end - *result.record.begin);
  for (const Stimulus& s : drill.stimuli) {
    if (s.begin_s < drive_s || options.undisturbed) continue;
    return Error{fmt::format("the stimulus '{}' begins at {:g} s, and the drive ends at {:.1f} s",
                             describe(s), s.begin_s, drive_s)};
  }
  return result;
}

sim::PriorMap wrong_map(const sim::PriorMap& right, const Vec3& shift_m, double turn_rad) {
  sim::PriorMap wrong = right;
  wrong.raster.level.origin_m += shift_m.head<2>();
  for (float& z_m : wrong.raster.z_m) z_m += static_cast<float>(shift_m.z());
  if (turn_rad == 0.0) return wrong;
  const Result<ElevationMap> map = ElevationMap::from_rasters(right.frame, {right.raster});
  RCS_CHECK(map.ok());
  const double c = std::cos(turn_rad);
  const double s = std::sin(turn_rad);
  for (int j = 0; j < right.raster.height; ++j) {
    for (int i = 0; i < right.raster.width; ++i) {
      const Cell cell{right.raster.first.i + i, right.raster.first.j + j};
      const Vec2 p = right.raster.level.centre(cell);
      Elevation there;
      const bool known = map->sample(c * p.x() + s * p.y(), -s * p.x() + c * p.y(), &there);
      wrong.raster.z_m[right.raster.at(cell)] = known ? static_cast<float>(there.z_m + shift_m.z())
                                                      : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return wrong;
}

}  // namespace rcs::drills
