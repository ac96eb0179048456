#include "tools/mapping/map_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "tools/mapping/map_writer.h"

namespace rcs::mapping {
namespace {

/// Reads a run several times and reports the total progress.
class Passes {
 public:
  Passes(const MapBuild& wanted, const recording::RunPoses& poses, const Pose& T_map_world,
         int passes, const std::function<bool(double)>& progress)
      : wanted_(wanted),
        poses_(poses),
        T_map_world_(T_map_world),
        passes_(passes),
        progress_(progress) {}

  /// A return in the frame of the map.
  struct Return {
    Vec3 p;
    Vec3 p_vehicle;
    double range_m = 0.0;
  };
  struct View {
    Pose T_map_vehicle;  ///< corrected
    Vec6 twist_vehicle;
    Vec3 origin;  ///< of the rays
    Stamp stamp;
    std::uint32_t scan = 0;
  };

  MountError mount;

  /// @param use  use(return, view)
  /// @param bytes  memory in use
  template <class Use, class Bytes>
  Result<recording::ScanCount> run(const Use& use, const Bytes& bytes) {
    const Vec3 origin_vehicle = wanted_.ladar ? wanted_.ladar->T_vehicle_mount.p : Vec3::Zero();
    std::size_t held = 0;
    Result<recording::ScanCount> done = recording::for_each_scan(
        wanted_.sensors, poses_, wanted_.ladar,
        [&](const recording::PlacedScan& scan) {
          View view;
          view.twist_vehicle = scan.twist_vehicle;
          view.T_map_vehicle =
              corrected(T_map_world_ * scan.T_world_vehicle, scan.twist_vehicle, mount);
          view.origin = view.T_map_vehicle * origin_vehicle;
          view.stamp = scan.reference;
          view.scan = scan.number;
          for (std::size_t k = 0; k < scan.p_vehicle.size(); ++k) {
            Return r;
            r.p_vehicle = scan.p_vehicle[k].cast<double>();
            r.range_m = (r.p_vehicle - origin_vehicle).norm();
            if (r.range_m > wanted_.max_range_m) continue;
            r.p = view.T_map_vehicle * r.p_vehicle;
            use(r, view);
          }
        },
        [&](double share) {
          held = bytes();
          return static_cast<double>(held) <= wanted_.memory_bytes &&
                 progress_((done_ + share) / passes_);
        });
    ++done_;
    if (done && !goes_on()) return Error{"interrupted"};
    if (!done && static_cast<double>(held) > wanted_.memory_bytes) {
      return Error{fmt::format(
          "{}: requires more than --memory {:.0f} MB: use larger cells (--cell), a shorter range "
          "(--max-range), or parts of the run joined by `rcs map merge`",
          wanted_.sensors, wanted_.memory_bytes * 1e-6)};
    }
    return done;
  }

  /// False after an interrupt.
  [[nodiscard]] bool goes_on() const {
    return progress_(std::min(1.0, static_cast<double>(done_) / passes_));
  }

 private:
  const MapBuild& wanted_;
  const recording::RunPoses& poses_;
  Pose T_map_world_;
  int passes_;
  const std::function<bool(double)>& progress_;
  int done_ = 0;
};

using Return = Passes::Return;
using View = Passes::View;

Result<recording::ScanCount> make_surface(Passes* passes, std::unique_ptr<GroundSurface>* surface) {
  *surface = std::make_unique<GroundSurface>(GroundSurfaceParams());
  GroundSurface* s = surface->get();
  Result<recording::ScanCount> read =
      passes->run([s](const Return& r, const View&) { s->add(r.p); }, [s] { return s->bytes(); });
  if (read && !s->finish([passes] { return passes->goes_on(); })) return Error{"interrupted"};
  return read;
}

Error without(const MapBuild& wanted, const recording::ScanCount& scans) {
  const std::string where =
      scans.damage.empty() ? wanted.sensors : wanted.sensors + " (" + scans.damage + ")";
  if (scans.scans + scans.no_pose == 0) {
    return {wanted.ladar ? where + ": no LADAR_RANGES or LADAR_POINTS of the configured LADAR"
                         : where +
                               ": no SP_POINTS; with --config, LADAR_RANGES and LADAR_POINTS are "
                               "used instead"};
  }
  return {
      fmt::format("{}: none of {} scans is within the time of the poses", where, scans.no_pose)};
}

Outcome write(const MapLevel& level, const GroundBuilder& ground, const StandingBuilder& standing,
              std::uint16_t date, const std::string& out, const Passes& passes, MapBuilt* built) {
  Result<MapWriter> writer = MapWriter::create(out, built->frame, {level});
  if (!writer) return writer.error();
  for (const Cell tile : ground.tiles()) {
    if (!passes.goes_on()) return Error{"interrupted"};
    Raster raster = ground.tile(level, tile, date);
    raster.points = standing.points(level, tile);
    built->points += static_cast<std::int64_t>(raster.points.size());
    if (Outcome put = writer->put(0, raster); !put) return put;
  }
  if (Outcome coarser = writer->add_coarser_levels(); !coarser) return coarser;
  return writer->finish();
}

}  // namespace

Result<MapBuilt> build_map(const MapBuild& wanted, const std::optional<MapFrame>& frame,
                           const std::string& out, const std::function<bool(double)>& progress) {
  const Result<recording::RunLog> run =
      recording::read_run(wanted.log, [&](double /*share*/) { return progress(0.0); });
  if (!run) return run.error();
  const Result<recording::RunPoses> poses =
      recording::poses_of(*run, wanted.source, wanted.pose_file);
  if (!poses) return poses.error();
  MapBuilt built;
  built.frame.datum = poses->datum;
  built.frame.reference = wanted.reference;
  built.frame.source_crs = "scans";
  if (frame) built.frame = *frame;
  const Pose T_map_world = LocalFrame(built.frame.datum).from(LocalFrame(poses->datum));

  Passes passes(wanted, *poses, T_map_world, wanted.estimate_mount ? 5 : 3, progress);
  std::unique_ptr<GroundSurface> surface;
  Result<recording::ScanCount> read = make_surface(&passes, &surface);
  if (!read) return read.error();
  if (read->scans == 0) return without(wanted, *read);
  if (wanted.estimate_mount) {
    MountEstimator estimator(wanted.ground.cell_m);
    constexpr double kGround_m =
        0.12;  // distance from the surface within which returns may be ground
    read = passes.run(
        [&](const Return& r, const View& view) {
          const std::optional<GroundHere> here = surface->at(r.p.x(), r.p.y());
          if (!here || std::abs(r.p.z() - here->z_m) > kGround_m) return;
          estimator.add(r.p_vehicle, view.T_map_vehicle, view.twist_vehicle, here->gradient,
                        r.p.z() - here->z_m, height_sigma(wanted.ground, r.range_m));
        },
        [&] { return surface->bytes() + estimator.bytes(); });
    if (!read) return read.error();
    built.mount = passes.mount = estimator.solve();
    read = make_surface(&passes, &surface);
    if (!read) return read.error();
  }
  GroundBuilder ground(wanted.ground, surface.get());
  StandingBuilder standing(wanted.standing);
  const auto bytes = [&] { return surface->bytes() + ground.bytes() + standing.bytes(); };
  read = passes.run(
      [&](const Return& r, const View& view) {
        ground.count(r.p, r.range_m);
        if (wanted.ladar) surface->see_through(view.origin, r.p, view.scan);
      },
      bytes);
  if (!read) return read.error();
  built.seen_through = surface->close();
  ground.settle();
  if (!passes.goes_on()) return Error{"interrupted"};
  read = passes.run(
      [&](const Return& r, const View& view) {
        ground.measure(r.p, r.range_m, view.stamp, view.scan);
        if (!wanted.points) return;
        const std::optional<GroundHere> here = surface->at(r.p.x(), r.p.y());
        if (here && r.p.z() > here->z_m + wanted.standing.above_m) {
          standing.add(r.p, view.origin, view.scan);
        }
      },
      bytes);
  if (!read) return read.error();
  ground.finish();
  if (!passes.goes_on()) return Error{"interrupted"};
  standing.finish([&](double x_m, double y_m) { return ground.transient(x_m, y_m); });
  built.scans = *read;
  built.ground = ground.metrics();
  if (built.ground.cells == 0) return Error{wanted.sensors + ": no ground was observed"};
  constexpr double kMount_m =
      0.01;  // sigma of the height of the LADAR above the vehicle, which is unobservable
  built.bias_sigma_m =
      std::hypot(wanted.pose_sigma_m ? *wanted.pose_sigma_m : poses->sigma_up_m, kMount_m);
  MapLevel level;
  level.cell_m = wanted.ground.cell_m;
  level.bias_sigma_m = built.bias_sigma_m;
  level.bias_correlation_m = wanted.pose_length_m;
  if (Outcome written = write(level, ground, standing, wanted.date, out, passes, &built);
      !written) {
    return written.error();
  }
  return built;
}

}  // namespace rcs::mapping
