#include "tools/importers/comma2k19.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "lcmtypes/convert.h"

namespace rcs::importers {
namespace {

constexpr const char* kAcc = "imu_acc.csv";
constexpr const char* kGyro = "imu_gyro.csv";
constexpr const char* kUblox = "gnss_ublox.csv";
constexpr const char* kWheels = "can_wheel_speed.csv";
constexpr const char* kTruth = "truth_pose.csv";

Quat mount(const CommaSetup& setup) {
  return exp_so3(setup.mount_rpy_rad.z() * Vec3::UnitZ()) *
         exp_so3(setup.mount_rpy_rad.y() * Vec3::UnitY()) *
         exp_so3(setup.mount_rpy_rad.x() * Vec3::UnitX());
}

StreamMap boot_seconds(const char* file) {
  StreamMap stream;
  stream.file = file;
  stream.stamp = {"t", 1.0, false};
  return stream;
}

/// The columns of the files. The axes of the device are forward, right, down.
ImuGpsMap column_map(const CommaSetup& setup) {
  ImuGpsMap map;
  ImuMap& imu = map.imu.emplace();
  imu.stream = boot_seconds(kAcc);
  imu.rate_file = kGyro;
  imu.force = {{{"ax", 1.0}, {"ay", -1.0}, {"az", -1.0}}};
  imu.rate = {{{"wx", 1.0}, {"wy", -1.0}, {"wz", -1.0}}};
  imu.q_vehicle_imu = mount(setup);

  GpsMap& gps = map.gps.emplace();
  gps.stream = boot_seconds(kUblox);
  gps.stream.latency = from_seconds(setup.gps_latency_s);
  if (setup.receiver_stamps) gps.receiver = StampColumn{"utc_ms", 1e-3, false};
  gps.lat = "lat_deg";
  gps.lon = "lon_deg";
  gps.height = "alt_m";  // within a metre of the truth, hence above the ellipsoid
  gps.speed = "speed_mps";
  gps.course = "bearing_deg";
  gps.sigma_speed_mps = setup.gps_sigma_speed_mps;
  gps.sigma_m = setup.gps_sigma_m * Vec3(1.0, 1.0, 1.5);

  WheelMap& wheels = map.wheels.emplace();
  wheels.stream = boot_seconds(kWheels);
  wheels.speed = {"rl", "rr"};  // the rear wheels, which are not steered
  wheels.sigma_speed_mps = setup.wheel_sigma_speed_mps;
  return map;
}

/// Earth-centred axes and the place where the equator meets Greenwich: there east is y, north z
/// and up x.
Pose T_equator_ecef() {
  constexpr double kEquatorialRadius_m = 6378137.0;  // WGS84
  Mat3 R;
  R << 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0;
  return {Quat(R), Vec3(0.0, 0.0, -kEquatorialRadius_m)};
}

struct ReferenceRow {
  Stamp stamp;
  Pose T_ecef_vehicle;
  Vec3 v_ecef;
};

Result<std::vector<ReferenceRow>> truth_rows(const tools::CsvTable& table, const CommaSetup& setup,
                                             RowCounts* counts) {
  constexpr std::array<const char*, 10> kNames = {
      "ecef_x", "ecef_y", "ecef_z", "vx_ecef", "vy_ecef", "vz_ecef", "qw", "qx", "qy", "qz"};
  const Result<std::vector<std::optional<Stamp>>> stamps = stamps_of(table, {"t", 1.0, false});
  if (!stamps) return stamps.error();
  std::array<std::vector<double>, 10> columns;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    Result<std::vector<double>> column = table.numbers(kNames[i]);
    if (!column) return column.error();
    columns[i] = std::move(column).value();
  }
  const Quat q_frd_flu(0.0, 1.0, 0.0, 0.0);  // half a turn about forward
  const Quat q_flu_vehicle = mount(setup).conjugate();
  std::vector<ReferenceRow> rows;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    ++counts->rows;
    const auto at = [&](std::size_t i) { return columns[i][row]; };
    const Vec3 p(at(0), at(1), at(2)), v(at(3), at(4), at(5));
    const Quat q(at(6), at(7), at(8), at(9));
    if (!(*stamps)[row] || !p.allFinite() || !v.allFinite() || !q.coeffs().allFinite()) {
      ++counts->missing;
      continue;
    }
    if (std::abs(q.norm() - 1.0) > 1e-3) {
      return Error{fmt::format("{}: qw, qx, qy, qz are not a rotation", table.place(row))};
    }
    const Stamp stamp = *(*stamps)[row];
    if (!rows.empty() && stamp <= rows.back().stamp) ++counts->backward;
    rows.push_back({stamp, {q.normalized() * q_frd_flu * q_flu_vehicle, p}, v});
  }
  return rows;
}

Outcome add_truth(const tools::CsvTable& table, const CommaSetup& setup, recording::SensorLog* log,
                  RowCounts* counts) {
  const Result<std::vector<ReferenceRow>> rows = truth_rows(table, setup, counts);
  if (!rows) return rows.error();
  if (rows->empty()) return Error{table.name() + ": no complete row"};
  const LocalFrame equator(Geodetic{});
  const Geodetic datum = equator.to_geodetic(T_equator_ecef() * rows->front().T_ecef_vehicle.p);
  if (!plausible(datum)) {
    return Error{table.name() + ": ecef_x, ecef_y, ecef_z are not a position on the earth"};
  }
  const Pose T_world_ecef = LocalFrame(datum).from(equator) * T_equator_ecef();
  Stamp arrival = rows->front().stamp;
  for (std::size_t i = 0; i < rows->size(); ++i) {
    const ReferenceRow& row = (*rows)[i];
    const ReferenceRow& before = (*rows)[i > 0 ? i - 1 : i];
    const ReferenceRow& after = (*rows)[std::min(i + 1, rows->size() - 1)];
    const double dt_s = seconds(after.stamp - before.stamp);
    truth_t m{};
    m.utime = to_utime(row.stamp);
    to_message(T_world_ecef * row.T_ecef_vehicle, m.q_world_vehicle, m.p_world_vehicle_m);
    to_message(Vec3(T_world_ecef.q * row.v_ecef), m.v_world_mps);
    const Quat turned = before.T_ecef_vehicle.q.conjugate() * after.T_ecef_vehicle.q;
    if (dt_s > 0.0) to_message(Vec3(log_so3(turned) / dt_s), m.rate_vehicle_radps);
    m.datum_lat_deg = degrees(datum.lat_rad);
    m.datum_lon_deg = degrees(datum.lon_rad);
    m.datum_height_m = datum.height.m;
    m.clearance_m = 1000.0;  // obstacles are unknown
    arrival = std::max(arrival, row.stamp);
    log->add(arrival, m);
    ++counts->written;
  }
  return Done{};
}

struct TruthTrack {
  tools::Trajectory poses;
  tools::Trajectory velocities;  // stored as positions, for interpolation
  std::optional<LocalFrame> world;
};

TruthTrack track_of(const recording::SensorLog& log) {
  TruthTrack track;
  for (const recording::SensorLog::Event& e : log.events()) {
    const auto* m = std::get_if<truth_t>(&e.message);
    Pose T;
    if (m == nullptr || !from_message(m->q_world_vehicle, m->p_world_vehicle_m, &T)) continue;
    const Stamp stamp = from_utime(m->utime);
    if (!track.poses.empty() && stamp <= track.poses.back().stamp) continue;
    track.poses.push_back({stamp, T});
    track.velocities.push_back({stamp, {Quat::Identity(), from_message(m->v_world_mps)}});
    if (!track.world) {
      track.world.emplace(
          Geodetic{radians(m->datum_lat_deg), radians(m->datum_lon_deg), {m->datum_height_m}});
    }
  }
  return track;
}

}  // namespace

Result<CommaTables> load_comma2k19(const std::string& folder) {
  std::vector<tools::CsvTable> tables;
  for (const char* file : {kAcc, kGyro, kUblox, kWheels, kTruth}) {
    Result<tools::CsvTable> table = tools::CsvTable::load(folder + "/" + file);
    if (!table) return table.error();
    tables.push_back(std::move(table).value());
  }
  tools::CsvTable truth = std::move(tables.back());
  tables.pop_back();
  return CommaTables{std::move(tables), std::move(truth)};
}

Result<CommaCounts> import_comma2k19(const CommaTables& tables, const CommaSetup& setup,
                                     recording::SensorLog* log) {
  CommaCounts counts;
  if (const Outcome truth = add_truth(tables.truth, setup, log, &counts.truth); !truth) {
    return truth.error();
  }
  Result<ImportCounts> sensors = import_imu_gps(column_map(setup), tables.sensors, log);
  if (!sensors) return sensors.error();
  counts.sensors = *sensors;
  return counts;
}

Result<SetupCheck> check_setup(const recording::SensorLog& log, Duration begin, Duration length) {
  constexpr std::size_t kFewest = 10;
  constexpr double kSlow_mps = 2.0;
  constexpr Duration kMaxGap = std::chrono::milliseconds(250);
  const TruthTrack track = track_of(log);
  if (track.poses.empty()) return Error{"no truth in the interval"};
  const Stamp from = track.poses.front().stamp + begin;
  const auto inside = [&](Stamp t) { return t >= from && t < from + length; };

  SetupCheck check;
  Vec3 v_vehicle = Vec3::Zero();
  for (std::size_t i = 0; i < track.poses.size(); ++i) {
    if (!inside(track.poses[i].stamp)) continue;
    v_vehicle += track.poses[i].T.q.conjugate() * track.velocities[i].T.p;
  }
  // The direction of motion is forward, rotated by Rz(yaw) Ry(pitch).
  check.mount_pitch_rad = std::atan2(v_vehicle.z(), v_vehicle.x());
  check.mount_yaw_rad = -std::atan2(v_vehicle.y(), std::hypot(v_vehicle.x(), v_vehicle.z()));

  struct Sample {
    Vec3 error_course;  // fix - truth: forward, left, up
    double speed_mps;
  };
  std::vector<Sample> samples;
  double sum_vv = 0.0, sum_ve = 0.0;
  for (const recording::SensorLog::Event& e : log.events()) {
    const auto* m = std::get_if<gps_fix_t>(&e.message);
    if (m == nullptr || !inside(e.arrival)) continue;
    const std::optional<Pose> T = tools::pose_at(track.poses, from_utime(m->utime), kMaxGap);
    const std::optional<Pose> v = tools::pose_at(track.velocities, from_utime(m->utime), kMaxGap);
    if (!T || !v || v->p.head<2>().norm() < kSlow_mps) continue;
    const Vec3 p_fix = track.world->to_world(
        {radians(m->lat_deg), radians(m->lon_deg), EllipsoidalHeight{m->height_m}});
    const Quat q_world_course = exp_so3(std::atan2(v->p.y(), v->p.x()) * Vec3::UnitZ());
    const Sample s = {q_world_course.conjugate() * (p_fix - T->p), v->p.head<2>().norm()};
    samples.push_back(s);
    sum_vv += s.speed_mps * s.speed_mps;
    sum_ve += s.speed_mps * s.error_course.x();
    check.raw_rms_m += s.error_course.head<2>().squaredNorm();
  }
  check.fixes = samples.size();
  if (check.fixes < kFewest) {
    return Error{
        fmt::format("{} fixes at more than {} m/s with a truth: too few", check.fixes, kSlow_mps)};
  }
  const double n = static_cast<double>(check.fixes);
  check.raw_rms_m = std::sqrt(check.raw_rms_m / n);
  check.gps_latency_s = -sum_ve / sum_vv;
  for (const Sample& s : samples) {
    const Vec3 late(check.gps_latency_s * s.speed_mps, 0.0, 0.0);
    const Vec3 rest = s.error_course + late;
    check.fix_minus_truth_m += rest / n;
    check.residual_along_m += rest.x() * rest.x();
  }
  check.residual_along_m = std::sqrt(check.residual_along_m / n);
  return check;
}

}  // namespace rcs::importers
