#include "modules/wm/terrain/terrain_node.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"
#include "modules/wm/terrain/obstacle_sides.h"
#include "modules/wm/wm_messages_node.h"

namespace rcs::wm {
namespace {

constexpr std::size_t kMaxPoints = 20'000;  // in one message of SP, which publishes far fewer
constexpr std::int16_t kUnknownHeight = -32768;
constexpr int kParts = 3;                   // of a patch's rows, one a cycle
constexpr std::size_t kMaxUpright = 1'000;  // quarters of cells in a scan
constexpr double kObjectMargin_m = 0.2;     // what is seen of an object is not all of it
constexpr double kSamePlace = 0.95;         // share of a scan that agrees
constexpr int kMinCompared = 50;            // of its points

}  // namespace

TerrainServer::TerrainServer(const WmConfig& config, Bus* bus)
    : points_(bus, channel::kSpPoints, 32),
      patches_(bus, channel::kWmMapPatch),
      grid_(config.terrain),
      moving_(0.5 * config.terrain.cell_m, kMaxUpright),
      clock_(config.map_period),
      rows_(config.terrain.patch) {
  const auto side = static_cast<std::size_t>(config.terrain.patch);
  const std::size_t cells = side * side;
  answers_.reserve(cells);
  p_vehicle_.reserve(kMaxPoints);
  upright_.reserve(kMaxUpright);
  patches_.reserve(8 * cells + 200);
}

void TerrainServer::step(const Estimator& estimator, Stamp local_began, Stamp now, Report* report) {
  if (rows_ < grid_.params().patch) {
    continue_patch();
    return;
  }
  for (; !points_.empty(); points_.pop()) accept(*points_.front(), estimator, now, report);
  if (!clock_.due(now)) return;
  if (!grid_.empty() && !restored_) begin_patch(estimator.T_local_vehicle(), local_began);
  clock_.advance(now);
}

void TerrainServer::clear() {
  grid_.clear();
  moving_.clear();
  upright_.clear();
  rows_ = grid_.params().patch;
  restored_.reset();
}

// The points are given in the rolling map of SP; the transformation to frame local is evaluated
// now, as the local pose may still be slewing.
void TerrainServer::accept(const points_t& m, const Estimator& estimator, Stamp now,
                           Report* report) {
  Pose T_rolling_points;
  const bool good = plausible_stamp(m.utime) &&
                    from_message(m.q_rolling_vehicle, m.p_rolling_vehicle_m, &T_rolling_points) &&
                    within(T_rolling_points.p, kFarthest_m);
  if (!good) {
    report_rejected(points_, Reason::kInvalid, now, report);
    return;
  }
  if (!estimator.started()) return;
  const NavState& x = estimator.state().belief.x;
  if (x.map_epoch != m.map_epoch) return;  // of a map that WM has left or does not know yet
  p_vehicle_.clear();
  const std::size_t n = std::min(static_cast<std::size_t>(m.n), kMaxPoints);
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3f p(m.x_m[k], m.y_m[k], m.z_m[k]);
    if (p.allFinite()) p_vehicle_.push_back(p);
  }
  const Pose T_vehicle_seen{exp_so3(x.mount), Vec3::Zero()};
  const Pose T_local_rolling =
      estimator.T_local_vehicle() * T_vehicle_seen * T_rolling_vehicle(x).inverse();
  const Pose T_local_points = T_local_rolling * T_rolling_points;
  if (restored_) verify(T_local_points, estimator, now, report);
  grid_.insert(p_vehicle_, T_local_points);
  newest_points_ = std::max(newest_points_, from_utime(m.utime));
  scanned_ = now;
  if (grid_.params().motion_s > 0.0) follow_objects(m);
}

// The vehicle may have been moved. It is at the pose in the restored frame at which it was at rest,
// with its present tilt.
void TerrainServer::verify(const Pose& T_local_points, const Estimator& estimator, Stamp now,
                           Report* report) {
  const Restored then = *restored_;
  restored_.reset();
  const Pose& T_local_vehicle = estimator.T_local_vehicle();
  const double turn = yaw_of(then.T_local_vehicle.q) - yaw_of(T_local_vehicle.q);
  const Quat q_then_local = exp_so3(Vec3(0.0, 0.0, turn));
  const Pose T_then_local{q_then_local, then.T_local_vehicle.p - q_then_local * T_local_vehicle.p};
  const TerrainAgreement a = grid_.agreement(p_vehicle_, T_then_local * T_local_points);
  const bool rests = at_rest(estimator.state().belief);
  const bool used =
      rests && now <= then.until && a.points >= kMinCompared && a.agree >= kSamePlace * a.points;
  if (used) {
    grid_.keep_ahead(T_then_local, T_local_vehicle);
  } else {
    clear();
  }
  report->publish(now, event::kWmResumed,
                  "start {} the terrain ahead and without the belief: {} of {} points of the first "
                  "scan agree with it (required: {:.0f} %, of at least {}), the vehicle is {}",
                  used ? "with" : "without", a.agree, a.points, 100.0 * kSamePlace, kMinCompared,
                  rests ? "at rest" : "not known to be at rest");
}

// A scan may come in parts.
void TerrainServer::follow_objects(const points_t& m) {
  if (m.scan_id != moving_scan_) upright_.clear();
  moving_scan_ = m.scan_id;
  for (const Cell c : grid_.upright_now()) {
    if (upright_.size() < kMaxUpright) upright_.push_back(c);
  }
  if (m.part + 1 != m.part_count) return;
  moving_.observe(
      upright_, 1e-6 * static_cast<double>(m.utime),
      [this](Cell quarter) { return grid_.stands(quarter); },
      [this](const Vec2& p_local) { return grid_.passed(p_local); });
}

// The ground that moving objects reach, from the newest scan on.
void TerrainServer::mark_motion() {
  map_patch_t& m = patch_;
  const double from_s = 1e-6 * static_cast<double>(m.utime);
  const double for_s = grid_.params().motion_s;
  const auto step_cm = static_cast<std::int16_t>(std::lround(100.0 * grid_.params().upright_m));
  for (const MovingObject& o : moving_.objects()) {
    if (!o.moves) continue;
    const double reach_m =
        o.along_m + o.across_m + kObjectMargin_m + (for_s + from_s - o.seen_s) * o.v.norm();
    const auto first = [&](double p_m, int origin) {
      return std::max(0, static_cast<int>(std::floor((p_m - reach_m) / m.cell_m)) - origin);
    };
    const auto last = [&](double p_m, int origin, int count) {
      return std::min(count - 1, static_cast<int>(std::floor((p_m + reach_m) / m.cell_m)) - origin);
    };
    for (int j = first(o.p.y(), m.first_j); j <= last(o.p.y(), m.first_j, m.height); ++j) {
      for (int i = first(o.p.x(), m.first_i); i <= last(o.p.x(), m.first_i, m.width); ++i) {
        const Vec2 centre = m.cell_m * Vec2(m.first_i + i + 0.5, m.first_j + j + 0.5);
        if (o.distance(centre, from_s, for_s) > kObjectMargin_m) continue;
        const std::size_t k = static_cast<std::size_t>(j) * static_cast<std::size_t>(m.width) +
                              static_cast<std::size_t>(i);
        m.flags[k] = static_cast<std::uint8_t>((m.flags[k] | map_patch_t::FLAG_OBSTACLE) &
                                               ~map_patch_t::FLAG_UNKNOWN);
        // Of what will be there: BG drives over low steps on its way back.
        m.step_cm[k] = std::max(m.step_cm[k], step_cm);
      }
    }
  }
}

void TerrainServer::begin_patch(const Pose& T_local_vehicle, Stamp local_began) {
  const Cell first = grid_.begin_patch(T_local_vehicle);
  rows_ = 0;
  patch_.utime = to_utime(newest_points_);
  patch_.local_utime = to_utime(local_began);
  patch_.first_i = first.i;
  patch_.first_j = first.j;
  patch_.base_m = std::round(T_local_vehicle.p.z());
}

void TerrainServer::continue_patch() {
  const int side = grid_.params().patch;
  const int end = std::min(side, rows_ + (side + kParts - 1) / kParts);
  grid_.answer_rows(rows_, end, &answers_);
  rows_ = end;
  if (rows_ == side) publish_patch();
}

void TerrainServer::publish_patch() {
  map_patch_t& m = patch_;
  join_sides(grid_.params().patch, grid_.params().side_m, &answers_);
  m.cell_m = grid_.params().cell_m;
  m.width = grid_.params().patch;
  m.height = grid_.params().patch;
  m.n = static_cast<std::int32_t>(answers_.size());
  m.height_cm.resize(answers_.size());
  m.step_cm.resize(answers_.size());
  m.slope_deg.resize(answers_.size());
  m.roughness_cm.resize(answers_.size());
  m.flags.resize(answers_.size());
  const auto whole = [](double value, double most) {
    value = std::clamp(value, -most, most);
    return static_cast<int>(value +
                            std::copysign(0.5, value));  // lround() costs a call for each cell
  };
  for (std::size_t k = 0; k < answers_.size(); ++k) {
    const TerrainAnswer& a = answers_[k];
    m.height_cm[k] = kUnknownHeight;
    m.step_cm[k] = 0;
    m.slope_deg[k] = m.roughness_cm[k] = 0;
    m.flags[k] = map_patch_t::FLAG_UNKNOWN;
    if (!a.known) continue;
    if (std::isfinite(a.height_m)) {
      m.height_cm[k] = static_cast<std::int16_t>(whole(100.0 * (a.height_m - m.base_m), 32000.0));
    }
    m.step_cm[k] = static_cast<std::int16_t>(whole(100.0 * a.step_m, 32000.0));
    m.slope_deg[k] = static_cast<std::uint8_t>(whole(degrees(a.slope_rad), 90.0));
    m.roughness_cm[k] = static_cast<std::uint8_t>(whole(100.0 * a.roughness_m, 255.0));
    m.flags[k] = a.obstacle ? map_patch_t::FLAG_OBSTACLE : 0;
    if (a.hidden) m.flags[k] |= map_patch_t::FLAG_HIDDEN;
    if (a.vegetation) m.flags[k] |= map_patch_t::FLAG_VEGETATION;
  }
  if (grid_.params().motion_s > 0.0) mark_motion();
  patches_.publish(&m);
}

}  // namespace rcs::wm
