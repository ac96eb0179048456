#include "tools/rcs/drill_run.h"

#include <cmath>
#include <limits>
#include <utility>

#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/executor.h"
#include "tools/rcs/drill_stimulus.h"

namespace rcs::tools {
namespace {

/// After the last message: so that the work under way is finished.
constexpr Duration kTail = std::chrono::milliseconds(500);

std::vector<Stimulus> stimuli_of(const Drill& drill, const DrillRunOptions& options) {
  if (options.undisturbed) return {};
  std::vector<Stimulus> stimuli = drill.stimuli;
  const double begin_s = drill.begin_s();
  const auto withhold = [&](DrillSource source) {
    stimuli.push_back(dropout(source, begin_s, kForGood_s));
  };
  const bool inertial = options.withheld == Withheld::kLadarOdometryAndGps;
  if (inertial) withhold(DrillSource::kOdometry);
  if (inertial || options.withheld == Withheld::kLadar) withhold(DrillSource::kLadar);
  if (inertial || options.withheld == Withheld::kGps) withhold(DrillSource::kGps);
  return stimuli;
}

Result<std::optional<ElevationMap>> prior_map_of(const Drill& drill, const DrillVehicle& vehicle,
                                                 const Scene& scene) {
  if (!drill.run.prior_map) return vehicle.prior_map;
  const ElevationTile tile =
      wrong_map(scene.prior_map(), drill.run.map_shift_m, drill.run.map_turn_rad);
  Result<ElevationMap> map = ElevationMap::from_tiles({tile});
  if (!map) return map.error();
  return std::optional<ElevationMap>(std::move(map).value());
}

}  // namespace

Result<DrillVehicle> load_drill_vehicle(const std::string& path) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  const Result<sp::SpConfig> sp = sp::load_sp_config(*file);
  if (!sp) return sp.error();
  const Result<wm::WmConfig> wm = wm::load_wm_config(*file);
  if (!wm) return wm.error();
  DrillVehicle vehicle{*sp, *wm, {}};
  if (sp->prior_map.empty()) return vehicle;
  Result<ElevationMap> map = ElevationMap::load(sp->prior_map);
  if (!map) return map.error();
  vehicle.prior_map = std::move(map).value();
  return vehicle;
}

Result<DrillRunResult> run_drill(const Drill& drill, const DrillVehicle& vehicle, Scene* scene,
                                 const DrillRunOptions& options) {
  Result<std::unique_ptr<EventSource>> opened = scene->open(drill.run.length_s, options.stop);
  if (!opened) return opened.error();
  Result<std::optional<ElevationMap>> prior_map = prior_map_of(drill, vehicle, *scene);
  if (!prior_map) return prior_map.error();
  std::optional<LogWriter> log;
  if (!options.log.empty()) {
    Result<LogWriter> writer = LogWriter::create(options.log);
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
  sp::SpNode sp_node(sp_config, std::move(prior_map).value(), &bus);
  wm::WmNode wm_node(wm_config, &bus);
  StimulatedSource source(opened->get(), stimuli_of(drill, options),
                          static_cast<std::uint64_t>(scene->key().seed));
  LockstepTimeline timeline(&bus, &source, kTail);
  const RunReport report = rcs::run({&sp_node, &wm_node}, timeline, nullptr);
  if (options.stop()) return Error{"interrupted"};
  if (log) {
    if (Outcome closed = log->close(); !closed) return closed.error();
  }

  DrillRunResult result{recorder.take(), recorder.datum()};
  for (const NodeReport& node : report.nodes) {
    result.record.overruns += node.overruns;
    result.record.missed += node.missed;
  }
  result.record.p_vehicle_antenna = wm_config.params.gps.lever_m;
  if (!result.record.begin) return Error{"no sensor data"};
  return result;
}

ElevationTile wrong_map(const ElevationTile& tile, const Vec3& shift_m, double turn_rad) {
  ElevationTile wrong = tile;
  wrong.origin_world_m += shift_m.head<2>();
  for (float& z_m : wrong.z_world_m) z_m += static_cast<float>(shift_m.z());
  if (turn_rad == 0.0) return wrong;
  const Result<ElevationMap> map = ElevationMap::from_tiles({tile});
  RCS_CHECK(map.ok());
  const double c = std::cos(turn_rad);
  const double s = std::sin(turn_rad);
  for (int j = 0; j < tile.height; ++j) {
    for (int i = 0; i < tile.width; ++i) {
      const double x = tile.origin_world_m.x() + (i + 0.5) * tile.cell_m;
      const double y = tile.origin_world_m.y() + (j + 0.5) * tile.cell_m;
      Elevation there;
      const bool known = map->sample(c * x + s * y, -s * x + c * y, &there);
      const auto cell = static_cast<std::size_t>(j * tile.width + i);
      wrong.z_world_m[cell] = known ? static_cast<float>(there.z_m + shift_m.z())
                                    : std::numeric_limits<float>::quiet_NaN();
    }
  }
  return wrong;
}

}  // namespace rcs::tools
