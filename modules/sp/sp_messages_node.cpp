#include "modules/sp/sp_messages_node.h"

#include <cmath>
#include <cstdlib>

#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"

namespace rcs::sp {
namespace {

// Stop is published by its value.
static_assert(same_value(registration::Stop::kConverged, registration_t::STOP_CONVERGED) &&
              same_value(registration::Stop::kMaxIterations, registration_t::STOP_MAX_ITERATIONS) &&
              same_value(registration::Stop::kBudget, registration_t::STOP_BUDGET) &&
              same_value(registration::Stop::kLimitCycle, registration_t::STOP_LIMIT_CYCLE) &&
              same_value(registration::Stop::kTooFew, registration_t::STOP_TOO_FEW) &&
              same_value(registration::Stop::kDegenerate, registration_t::STOP_DEGENERATE) &&
              same_value(registration::Stop::kEmpty, registration_t::STOP_EMPTY) &&
              same_value(registration::Stop::kDiverged, registration_t::STOP_DIVERGED) &&
              same_value(registration::Stop::kSeeded, registration_t::STOP_SEEDED) &&
              same_value(registration::Stop::kHeld, registration_t::STOP_HELD));

constexpr Duration kLongestScan = from_seconds(5.0);

// Of a pan/tilt head; false for NaN.
bool is_angle(double rad) { return std::abs(rad) <= 2.0 * kPi; }
bool is_rate(double radps) { return std::abs(radps) <= kFastest_radps; }

std::optional<FacetId> facet_id(std::int64_t scan_id, std::int64_t reference_utime, int facet,
                                int facet_count, std::int64_t utime) {
  const bool sound = scan_id >= 0 && facet_count >= 1 && facet_count <= ScanAssembler::kMaxFacets &&
                     facet >= 0 && facet < facet_count && reference_utime >= 0 && utime >= 0 &&
                     plausible_stamp(reference_utime) && plausible_stamp(utime) &&
                     std::abs(utime - reference_utime) <= kLongestScan.count();
  if (!sound) return std::nullopt;
  return FacetId{scan_id, from_utime(reference_utime), facet, facet_count};
}

}  // namespace

std::optional<FacetId> identify(const ladar_ranges_t& m, const LadarParams& ladar) {
  const bool shape = m.sensor_id == ladar.sensor_id && m.rows == ladar.rows &&
                     m.cols == ladar.cols && m.first_row >= 0 && m.facet_rows >= 0 &&
                     m.first_row + m.facet_rows <= m.rows &&
                     (m.n == 0 || m.n == m.facet_rows * m.cols) && m.duration_us >= 0 &&
                     m.duration_us <= kLongestScan.count();
  const bool angles = is_angle(m.pan_rad) && is_angle(m.tilt_rad) && is_rate(m.pan_rate_radps) &&
                      is_rate(m.tilt_rate_radps);
  if (!shape || !angles) return std::nullopt;
  return facet_id(m.scan_id, m.reference_utime, m.facet, m.facet_count, m.utime);
}

std::optional<FacetId> identify(const ladar_points_t& m, const LadarParams& ladar) {
  if (m.sensor_id != ladar.sensor_id) return std::nullopt;
  if (m.n_time != 0 && m.n_time != m.n) return std::nullopt;
  for (const std::int32_t dt : m.dt_us) {
    if (std::abs(static_cast<std::int64_t>(dt)) > kLongestScan.count()) return std::nullopt;
  }
  return facet_id(m.scan_id, m.reference_utime, m.facet, m.facet_count, m.utime);
}

RangeFacet view(const ladar_ranges_t& m) {
  RangeFacet f;
  f.range_m = m.range_m.data();
  f.first_row = m.first_row;
  f.facet_rows = m.n == 0 ? 0 : m.facet_rows;
  f.start = Duration(m.utime - m.reference_utime);
  f.duration = Duration(m.duration_us);
  f.pan_rad = m.pan_rad;
  f.tilt_rad = m.tilt_rad;
  f.pan_rate_radps = m.pan_rate_radps;
  f.tilt_rate_radps = m.tilt_rate_radps;
  return f;
}

PointFacet view(const ladar_points_t& m) {
  PointFacet f;
  f.x_m = m.x_m.data();
  f.y_m = m.y_m.data();
  f.z_m = m.z_m.data();
  f.n = static_cast<std::size_t>(m.n);
  f.dt_us = m.n_time == m.n && m.n > 0 ? m.dt_us.data() : nullptr;
  f.start = Duration(m.utime - m.reference_utime);
  return f;
}

void fill(const registration::Registration& r, int target, registration_t* message) {
  registration_t& m = *message;
  m.target = static_cast<std::int8_t>(target);
  m.n_tiles = 0;
  m.tile_id.clear();
  m.map_bias_sigma_m = m.map_bias_length_m = 0.0;
  to_message(r.T_target_vehicle, m.q_target_vehicle, m.p_target_vehicle_m);
  to_message<6>(r.information, m.information);
  for (int i = 0; i < 6; ++i) m.observability[i] = r.observability[i];
  m.stop = static_cast<std::int8_t>(r.stop);
  m.iterations = r.iterations;
  m.points = r.points;
  m.pairs = r.pairs;
  m.granted_units = r.granted;
  m.used_units = r.used;
  m.mean_distance_m = r.mean_distance_m;
  m.rms_m = r.rms_m;
  m.overlap = r.overlap;
  m.correction_m = r.correction_m;
  m.correction_rad = r.correction_rad;
}

void fill(const Points& points, std::size_t begin, std::size_t end, points_t* m) {
  const auto from = static_cast<std::ptrdiff_t>(begin);
  const auto to = static_cast<std::ptrdiff_t>(end);
  m->n = static_cast<std::int32_t>(end - begin);
  m->x_m.assign(points.x.begin() + from, points.x.begin() + to);
  m->y_m.assign(points.y.begin() + from, points.y.begin() + to);
  m->z_m.assign(points.z.begin() + from, points.z.begin() + to);
}

}  // namespace rcs::sp
