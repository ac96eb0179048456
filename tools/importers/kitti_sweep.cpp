#include "tools/importers/kitti_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "tools/base/kitti_bin.h"
#include "tools/base/trajectory.h"

namespace rcs::importers {
namespace {

int cell_of(double phase, int cells) {
  return std::min(static_cast<int>(phase * cells), cells - 1);
}

Stamp facet_start(const SweepTiming& timing, int facet) {
  return timing.start + timing.period * facet / kSweepFacets;
}

}  // namespace

Result<Sweep> parse_sweep(const std::vector<std::uint8_t>& bytes, std::string_view name) {
  if (Outcome sound = tools::check_kitti_bin(bytes, name); !sound) return sound.error();
  Sweep sweep;
  int wraps = 0;
  double last_azimuth_rad = 0.0;
  for (std::size_t at = 0; at < bytes.size(); at += tools::kKittiRecordBytes) {
    float xyz[3];
    std::memcpy(xyz, bytes.data() + at, sizeof xyz);
    const Vec3f p(xyz[0], xyz[1], xyz[2]);
    if (!p.allFinite()) {
      ++sweep.not_finite;
      continue;
    }
    if (p.isZero(0.0F)) {
      ++sweep.no_return;
      continue;
    }
    const double azimuth_rad = std::atan2(static_cast<double>(p.y()), static_cast<double>(p.x()));
    // By the sign bit: coordinates are rounded to millimetres, and the last return of a row may
    // have y = -0.
    const double ahead_rad = std::signbit(azimuth_rad) ? azimuth_rad + 2.0 * kPi : azimuth_rad;
    // Within a row it steps back by 0.01 deg at most; between rows by 300 deg and more.
    if (!sweep.points_ladar.empty() && ahead_rad < last_azimuth_rad - kPi) ++wraps;
    last_azimuth_rad = ahead_rad;
    const double phase = std::min(0.5 - azimuth_rad / (2.0 * kPi), std::nextafter(1.0, 0.0));
    sweep.points_ladar.push_back(p);
    sweep.phase.push_back(phase);
    sweep.row.push_back(static_cast<std::int16_t>(std::max(0, kSweepRows - 1 - wraps)));
    sweep.col.push_back(static_cast<std::int16_t>(cell_of(phase, kSweepCols)));
  }
  if (wraps != kSweepRows - 1) {
    sweep.row.clear();
    sweep.col.clear();
  }
  return sweep;
}

Stamp facet_end(const SweepTiming& timing, int facet) { return facet_start(timing, facet + 1); }

Result<std::vector<ladar_points_t>> slice_sweep(const Sweep& sweep, const SweepTiming& timing) {
  std::vector<ladar_points_t> facets(kSweepFacets);
  for (int f = 0; f < kSweepFacets; ++f) {
    ladar_points_t& m = facets[static_cast<std::size_t>(f)];
    m = ladar_points_t{};
    m.utime = to_utime(facet_start(timing, f));
    m.scan_id = timing.scan_id;
    m.reference_utime = to_utime(timing.start + timing.period / 2);
    m.facet = static_cast<std::int16_t>(f);
    m.facet_count = kSweepFacets;
    m.rows = sweep.organized() ? kSweepRows : std::int16_t{0};
    m.cols = sweep.organized() ? kSweepCols : std::int16_t{0};
  }
  for (std::size_t i = 0; i < sweep.points_ladar.size(); ++i) {
    const int f = cell_of(sweep.phase[i], kSweepFacets);
    ladar_points_t& m = facets[static_cast<std::size_t>(f)];
    m.x_m.push_back(sweep.points_ladar.x[i]);
    m.y_m.push_back(sweep.points_ladar.y[i]);
    m.z_m.push_back(sweep.points_ladar.z[i]);
    if (sweep.organized()) {
      m.row.push_back(sweep.row[i]);
      m.col.push_back(sweep.col[i]);
    }
    if (timing.point_times) {
      const Duration after_start = from_seconds(sweep.phase[i] * seconds(timing.period));
      const Duration dt = timing.start + after_start - from_utime(m.utime);
      m.dt_us.push_back(static_cast<std::int32_t>(dt.count()));
    }
  }
  for (ladar_points_t& m : facets) {
    m.n = static_cast<std::int32_t>(m.x_m.size());
    m.n_index = static_cast<std::int32_t>(m.row.size());
    m.n_time = static_cast<std::int32_t>(m.dt_us.size());
    if (static_cast<std::size_t>(m.getEncodedSize()) > kMaxDatagramBytes) {
      return Error{fmt::format("sweep {}, facet {}: {} points make {} bytes, more than {}",
                               timing.scan_id, m.facet, m.n, m.getEncodedSize(),
                               kMaxDatagramBytes)};
    }
  }
  return facets;
}

gps_fix_t to_fix(const Pose& T_odom_imu, const OdomOrigin& origin, Stamp stamp, double sigma_m) {
  const Quat q_world_odom = exp_so3(Vec3(0.0, 0.0, origin.yaw_rad)) *
                            exp_so3(Vec3(0.0, origin.pitch_rad, 0.0)) *
                            exp_so3(Vec3(origin.roll_rad, 0.0, 0.0));
  const Geodetic g = LocalFrame(origin.place).to_geodetic(q_world_odom * T_odom_imu.p);
  gps_fix_t m{};
  m.utime = to_utime(stamp);
  m.lat_deg = degrees(g.lat_rad);
  m.lon_deg = degrees(g.lon_rad);
  m.height_m = g.height.m;
  m.height_kind = gps_fix_t::HEIGHT_ELLIPSOIDAL;
  m.undulation_m = std::numeric_limits<double>::quiet_NaN();
  for (double& sigma : m.sigma_enu_m) sigma = sigma_m;
  m.fix_type = gps_fix_t::FIX_DIFFERENTIAL;
  // The poses have no number of satellites; these values are typical of an open street.
  m.satellites = 8;
  m.hdop = 1.0;
  m.vdop = 1.5;
  return m;
}

Result<Pose> parse_imu_to_velo(std::string_view text, std::string_view name) {
  std::string rotation;
  std::string translation;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.substr(0, 2) == "R:") rotation = line.substr(2);
    if (line.substr(0, 2) == "T:") translation = line.substr(2);
  }
  const std::optional<std::vector<double>> R_values = tools::parse_numbers(rotation);
  const std::optional<std::vector<double>> t_values = tools::parse_numbers(translation);
  if (!R_values || R_values->size() != 9 || !t_values || t_values->size() != 3) {
    return Error{
        fmt::format("{}: expected a line \"R:\" with 9 numbers and a line \"T:\" with 3", name)};
  }
  const Mat3 R_ladar_vehicle =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R_values->data());
  const Vec3 t_ladar_vehicle = Eigen::Map<const Vec3>(t_values->data());
  if ((R_ladar_vehicle.transpose() * R_ladar_vehicle - Mat3::Identity()).norm() > 1e-3) {
    return Error{fmt::format("{}: R is not a rotation", name)};
  }
  return Pose{Quat(R_ladar_vehicle).normalized(), t_ladar_vehicle}.inverse();
}

}  // namespace rcs::importers
