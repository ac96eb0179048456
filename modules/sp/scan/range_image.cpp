#include "modules/sp/scan/range_image.h"

#include <cmath>

#include "rcs/base/check.h"

namespace rcs::sp {

Calibration::Calibration(const LadarParams& params) : params_(params) {
  RCS_CHECK(params.rows > 0 && params.cols > 0);
  const double cell_v = params.fov_v_rad / params.rows;
  const double cell_h = params.fov_h_rad / params.cols;
  direction_ladar_.reserve(static_cast<std::size_t>(params.rows) *
                           static_cast<std::size_t>(params.cols));
  for (int row = 0; row < params.rows; ++row) {
    const double elevation = -0.5 * params.fov_v_rad + (row + 0.5) * cell_v;
    for (int col = 0; col < params.cols; ++col) {
      const double azimuth = 0.5 * params.fov_h_rad - (col + 0.5) * cell_h;
      const Vec3 d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                   std::sin(elevation));
      direction_ladar_.emplace_back(d.cast<float>());
    }
  }
}

Pose Calibration::vehicle_from_ladar(const RangeFacet& facet, double t_s) const {
  const double pan = facet.pan_rad + facet.pan_rate_radps * t_s;
  const double tilt = facet.tilt_rad + facet.tilt_rate_radps * t_s;
  // Positive tilt is up: a negative rotation about y (left).
  const Quat q_mount_ladar = exp_so3(Vec3(0.0, 0.0, pan)) * exp_so3(Vec3(0.0, -tilt, 0.0));
  return params_.T_vehicle_mount * Pose{q_mount_ladar, Vec3::Zero()};
}

// Neighbours are in the same facet; a missing one is ignored.
bool Calibration::is_lone(const RangeFacet& facet, int row, int col) const {
  if (params_.isolated_m == 0.0) return false;
  const auto range = [&](int r, int c) {
    const int at = r * params_.cols + c;
    return facet.range_m[static_cast<std::size_t>(at)];
  };
  const float own = range(row, col);
  const float apart = static_cast<float>(params_.isolated_m) + 0.05F * own;
  bool alone = false;
  const int neighbour[4][2] = {{row, col - 1}, {row, col + 1}, {row - 1, col}, {row + 1, col}};
  for (const auto& [r, c] : neighbour) {
    if (r < 0 || c < 0 || r >= facet.facet_rows || c >= params_.cols) continue;
    const float other = range(r, c);
    if (!(other > 0.0F)) continue;
    if (std::abs(other - own) <= apart) return false;
    alone = true;
  }
  return alone;
}

ConversionCount Calibration::append(const RangeFacet& facet, Scan* scan) const {
  ConversionCount count;
  if (facet.facet_rows == 0) return count;
  RCS_CHECK(facet.first_row >= 0 && facet.facet_rows > 0 &&
            facet.first_row + facet.facet_rows <= params_.rows);

  // Within a facet the head turns little: interpolation between its poses at both ends.
  const double duration_s = seconds(facet.duration);
  const Pose T_begin = vehicle_from_ladar(facet, 0.0);
  const Pose T_end = vehicle_from_ladar(facet, duration_s);
  const Mat3f R0 = T_begin.rotation().cast<float>();
  const Mat3f dR = T_end.rotation().cast<float>() - R0;
  const Vec3f t = T_begin.p.cast<float>();  // the head turns about its own origin
  const auto min_range = static_cast<float>(params_.min_range_m);
  const auto max_range = static_cast<float>(params_.max_range_m);
  const std::int64_t start_us = facet.start.count();

  for (int col = 0; col < params_.cols; ++col) {
    const float u = static_cast<float>(col) / static_cast<float>(params_.cols);
    const Mat3f R = R0 + u * dR;
    const auto dt_us =
        static_cast<std::int32_t>(start_us + facet.duration.count() * col / params_.cols);
    for (int row = 0; row < facet.facet_rows; ++row) {
      const auto cols = static_cast<std::size_t>(params_.cols);
      const auto c = static_cast<std::size_t>(col);
      const float range = facet.range_m[static_cast<std::size_t>(row) * cols + c];
      if (range == 0.0F) {
        ++count.missing;
        continue;
      }
      if (!(range >= min_range && range <= max_range)) {  // also NaN
        ++count.rejected;
        if (!std::isfinite(range)) ++count.not_finite;
        continue;
      }
      if (is_lone(facet, row, col)) {
        ++count.lone;
        continue;
      }
      const std::size_t cell = static_cast<std::size_t>(facet.first_row + row) * cols + c;
      const Vec3f p = R * (range * direction_ladar_[cell]) + t;
      scan->points.push_back(p);
      scan->dt_us.push_back(dt_us);
      ++count.returns;
    }
  }
  return count;
}

ConversionCount Calibration::append(const PointFacet& facet, Scan* scan) const {
  ConversionCount count;
  const Mat3f R = params_.T_vehicle_mount.rotation().cast<float>();
  const Vec3f t = params_.T_vehicle_mount.p.cast<float>();
  const auto min2 = static_cast<float>(params_.min_range_m * params_.min_range_m);
  const auto max2 = static_cast<float>(params_.max_range_m * params_.max_range_m);
  const auto start_us = static_cast<std::int32_t>(facet.start.count());
  for (std::size_t i = 0; i < facet.n; ++i) {
    const Vec3f p_ladar(facet.x_m[i], facet.y_m[i], facet.z_m[i]);
    const float range2 = p_ladar.squaredNorm();
    if (!(range2 >= min2 && range2 <= max2)) {  // also NaN and infinity
      ++count.rejected;
      if (!p_ladar.allFinite()) ++count.not_finite;
      continue;
    }
    scan->points.push_back(R * p_ladar + t);
    scan->dt_us.push_back(facet.dt_us == nullptr ? 0 : start_us + facet.dt_us[i]);
    ++count.returns;
  }
  return count;
}

}  // namespace rcs::sp
