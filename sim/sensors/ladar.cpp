#include "sim/sensors/ladar.h"

#include <algorithm>
#include <cmath>

#include "rcs/base/check.h"

namespace rcs::sim {
namespace {

Pose true_mount(const MountParams& mount, std::uint64_t seed) {
  // The noise of the sensor must not depend on the error of its mount.
  Random random(mix(seed + 0x30), Stream::kLadar);
  const Vec3 axis = random.direction();
  return mount.T_vehicle_mount *
         Pose{exp_so3(mount.error_rad * axis), mount.error_m * random.direction()};
}

// Narrow enough that its rays stay close together over the mean range of a scan.
constexpr int kColumnsPerFan = 12;

Vec3 spherical(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad),
          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

// Whether two ranges belong to two surfaces, not to one slanted surface.
bool is_edge(double a_m, double b_m) {
  return a_m > 0.0 && b_m > 0.0 && std::abs(a_m - b_m) > 0.3 + 0.05 * std::min(a_m, b_m);
}

}  // namespace

double Beam::cast(const World& world, const Ray& ray, double time_s, double* cos_incidence,
                  double clear_m) {
  Hit hit;
  // Slightly beyond the range, so that noise does not truncate it on one side.
  const double reach_m = params_.max_range_m + 5.0 * params_.sigma_m;
  bool met = world.cast(ray, reach_m, time_s, random_.bits(), &hit, clear_m);
  if (actors_ != nullptr) {
    if (!met) hit.range_m = reach_m;
    met = actors_->meet(world, ray, time_s, &hit) || met;
  }
  if (!met) return 0.0;
  *cos_incidence = hit.cos_incidence;
  return hit.range_m;
}

double Beam::measure(double range_m, double cos_incidence) {
  if (range_m <= 0.0) return 0.0;
  constexpr double kMaxTangent = 10.0;  // beyond 84 deg the relief limits the footprint
  const double c = std::clamp(cos_incidence, 1e-3, 1.0);
  const double tangent = std::min(kMaxTangent, std::sqrt(1.0 - c * c) / c);
  const double slant_m = params_.incidence_share * range_m * params_.half_angle_rad * tangent;
  const double sigma_m = std::sqrt(params_.sigma_m * params_.sigma_m + slant_m * slant_m);
  const double measured = sigma_m > 0.0 ? range_m + sigma_m * random_.normal() : range_m;
  return measured > 0.0 && measured <= params_.max_range_m ? measured : 0.0;
}

bool Beam::facet_is_empty() {
  return params_.empty_facet_share > 0.0 && random_.uniform() < params_.empty_facet_share;
}

bool Beam::shot_is_missing() {
  // Empty facets are part of the missing share.
  const double missing = 1.0 - (1.0 - params_.missing_share) / (1.0 - params_.empty_facet_share);
  return missing > 0.0 && random_.uniform() < missing;
}

RangeImager::RangeImager(const ImagerParams& params, const BeamParams& beam,
                         const MountParams& mount, std::uint64_t seed)
    : params_(params), beam_(beam, seed), T_vehicle_mount_(true_mount(mount, seed)) {
  RCS_CHECK(params.facets > 0 && params.rows % params.facets == 0);
  for (int row = 0; row < params.rows; ++row) {
    for (int col = 0; col < params.cols; ++col) {
      direction_ladar_.push_back(
          spherical(0.5 * params.fov_h_rad - (col + 0.5) * params.fov_h_rad / params.cols,
                    -0.5 * params.fov_v_rad + (row + 0.5) * params.fov_v_rad / params.rows));
    }
  }
}

HeadAngle RangeImager::head_at(double time_s) const {
  const double omega = 2.0 * kPi * params_.sweep_hz;
  return {params_.tilt_rad + params_.sweep_rad * std::sin(omega * time_s),
          params_.sweep_rad * omega * std::cos(omega * time_s)};
}

Pose RangeImager::T_vehicle_ladar(double time_s) const {
  // Positive tilt is up: a negative rotation about y (left).
  const Quat q_mount_ladar = exp_so3(Vec3(0.0, -head_at(time_s).tilt_rad, 0.0));
  return T_vehicle_mount_ * Pose{q_mount_ladar, Vec3::Zero()};
}

Vec3 RangeImager::direction(int row, int col) const {
  return direction_ladar_[static_cast<std::size_t>(row) * static_cast<std::size_t>(params_.cols) +
                          static_cast<std::size_t>(col)];
}

// Linear interpolation between poses 0.7 ms apart: errors below 0.01 mrad and 0.01 mm for all
// motions of a vehicle body.
void RangeImager::place_columns(const Trajectory& vehicle, double start_s) {
  constexpr int kColumnsPerPose = 20;
  const auto pose = [&](int col) {
    const double time_s = shot_time(start_s, col);
    return vehicle.pose_at(time_s) * T_vehicle_ladar(time_s);
  };
  columns_.resize(static_cast<std::size_t>(params_.cols));
  Pose next = pose(0);
  for (int first = 0; first < params_.cols; first += kColumnsPerPose) {
    const int end = std::min(first + kColumnsPerPose, params_.cols);
    const Pose here = next;
    next = pose(end);
    const Mat3 R = here.rotation();
    const Mat3 dR = next.rotation() - R;
    for (int col = first; col < end; ++col) {
      const double share = static_cast<double>(col - first) / (end - first);
      columns_[static_cast<std::size_t>(col)] = {R + share * dR,
                                                 here.p + share * (next.p - here.p)};
    }
  }
}

void RangeImager::render(const World& world, const Trajectory& vehicle, double start_s, int facet,
                         RangeFacet* out) {
  const int rows = params_.rows / params_.facets;
  out->head = head_at(start_s);
  out->first_row = facet * rows;
  out->rows = rows;
  out->range_m.clear();
  if (beam_.facet_is_empty()) return;

  place_columns(vehicle, start_s);
  const std::size_t cols = static_cast<std::size_t>(params_.cols);
  shots_.assign(static_cast<std::size_t>(rows) * cols, {0.0, 1.0});
  for (int first = 0; first < params_.cols; first += kColumnsPerFan) {
    cast_columns(world, start_s, out->first_row, rows, first,
                 std::min(first + kColumnsPerFan, params_.cols));
  }
  if (beam_.params().half_angle_rad > 0.0) mix_pixels(world, start_s, out->first_row);
  for (const Shot& shot : shots_) {
    out->range_m.push_back(static_cast<float>(beam_.measure(shot.range_m, shot.cos_incidence)));
  }
}

void RangeImager::cast_columns(const World& world, double start_s, int first_row, int rows,
                               int first_col, int end_col) {
  rays_.clear();
  for (int col = first_col; col < end_col; ++col) {
    const Column& column = columns_[static_cast<std::size_t>(col)];
    for (int row = 0; row < rows; ++row) {
      rays_.push_back({column.p_world, column.R_world_ladar * direction(first_row + row, col)});
    }
  }
  const double clear_m = world.clear_distance(Fan(rays_), beam_.params().max_range_m);
  for (std::size_t k = 0; k < rays_.size(); ++k) {
    if (beam_.shot_is_missing()) continue;
    const int col = first_col + static_cast<int>(k) / rows;
    const std::size_t row = k % static_cast<std::size_t>(rows);
    Shot& shot =
        shots_[row * static_cast<std::size_t>(params_.cols) + static_cast<std::size_t>(col)];
    // Along a slanted ray the horizontal distance is reached later: the bound is conservative.
    shot.range_m =
        beam_.cast(world, rays_[k], shot_time(start_s, col), &shot.cos_incidence, clear_m);
  }
}

// A beam that is partly on an edge returns a range between those of the two surfaces. Where the
// range jumps between adjacent columns, the border of the beam is cast as well.
void RangeImager::mix_pixels(const World& world, double start_s, int first_row) {
  const double half_angle_rad = beam_.params().half_angle_rad;
  const std::size_t cols = static_cast<std::size_t>(params_.cols);
  for (int row = 0; static_cast<std::size_t>(row) * cols < shots_.size(); ++row) {
    Shot* line = shots_.data() + static_cast<std::size_t>(row) * cols;
    double left_m = line[0].range_m;  // of the neighbour, before it was mixed
    for (int col = 0; col < params_.cols; ++col) {
      Shot& shot = line[col];
      const double right_m = col + 1 < params_.cols ? line[col + 1].range_m : shot.range_m;
      const bool edge_left = is_edge(shot.range_m, left_m);
      left_m = shot.range_m;
      if (!edge_left && !is_edge(shot.range_m, right_m)) continue;

      const Vec3 turn(0.0, 0.0, edge_left ? half_angle_rad : -half_angle_rad);
      const Vec3 border_ladar =
          direction(first_row + row, col) + turn.cross(direction(first_row + row, col));
      const Column& column = columns_[static_cast<std::size_t>(col)];
      double cos_incidence = 1.0;
      const double border_m =
          beam_.cast(world, {column.p_world, (column.R_world_ladar * border_ladar).normalized()},
                     shot_time(start_s, col), &cos_incidence);
      if (!is_edge(shot.range_m, border_m)) continue;
      shot.range_m += beam_.random().uniform() * (border_m - shot.range_m);
    }
  }
}

SpinningLadar::SpinningLadar(const SpinningParams& params, const BeamParams& beam,
                             const MountParams& mount, std::uint64_t seed)
    : params_(params), beam_(beam, seed), T_vehicle_ladar_(true_mount(mount, seed)) {
  RCS_CHECK(params.sectors > 0 && params.cols % params.sectors == 0 && params.beams > 1);
}

void SpinningLadar::render(const World& world, const Trajectory& vehicle, double start_s,
                           int sector, PointSector* out) {
  *out = {};
  if (beam_.facet_is_empty()) return;
  const int cols = params_.cols / params_.sectors;
  const double column_s = params_.period_s / params_.cols;
  for (int k = 0; k < cols; ++k) {
    const int col = sector * cols + k;
    const double time_s = start_s + k * column_s;
    const Pose T_world_ladar = vehicle.pose_at(time_s) * T_vehicle_ladar_;
    const Mat3 R = T_world_ladar.rotation();
    const double azimuth_rad = kPi - 2.0 * kPi * (col + 0.5) / params_.cols;
    for (int row = 0; row < params_.beams; ++row) {
      if (beam_.shot_is_missing()) continue;
      const double elevation_rad = params_.lowest_rad + (params_.highest_rad - params_.lowest_rad) *
                                                            row / (params_.beams - 1);
      const Vec3 direction = spherical(azimuth_rad, elevation_rad);
      double cos_incidence = 1.0;
      const double true_m =
          beam_.cast(world, {T_world_ladar.p, R * direction}, time_s, &cos_incidence);
      const double range_m = beam_.measure(true_m, cos_incidence);
      if (range_m == 0.0) continue;
      const Vec3 p_ladar = range_m * direction;
      out->x_m.push_back(static_cast<float>(p_ladar.x()));
      out->y_m.push_back(static_cast<float>(p_ladar.y()));
      out->z_m.push_back(static_cast<float>(p_ladar.z()));
      out->row.push_back(static_cast<std::int16_t>(row));
      out->col.push_back(static_cast<std::int16_t>(col));
      out->dt_us.push_back(static_cast<std::int32_t>(std::lround(k * column_s * 1e6)));
    }
  }
}

}  // namespace rcs::sim
