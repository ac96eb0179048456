#include "modules/sp/sp_node.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "rcs/base/geodesy.h"

namespace rcs::sp {
namespace {

constexpr double kGravity_mps2 = 9.80665;
constexpr std::size_t kPointsPerMessage = 4000;  // 48 kB: one datagram
// An inertial sample so much older than the reference instant does not carry the prediction.
constexpr Duration kInertialGap = from_milliseconds(60.0);
constexpr Duration kLongestScan = from_seconds(5.0);

bool finite(double v) { return std::isfinite(v); }

std::optional<FacetId> facet_id(std::int64_t scan_id, std::int64_t reference_utime, int facet,
                                int facet_count, std::int64_t utime) {
  const bool sound = scan_id >= 0 && facet_count >= 1 && facet_count <= ScanAssembler::kMaxFacets &&
                     facet >= 0 && facet < facet_count && reference_utime >= 0 && utime >= 0 &&
                     std::abs(utime - reference_utime) <= kLongestScan.count();
  if (!sound) return std::nullopt;
  return FacetId{scan_id, from_utime(reference_utime), facet, facet_count};
}

std::optional<FacetId> identify(const ladar_ranges_t& m, const LadarParams& ladar) {
  const bool shape = m.rows == ladar.rows && m.cols == ladar.cols && m.first_row >= 0 &&
                     m.facet_rows >= 0 && m.first_row + m.facet_rows <= m.rows &&
                     (m.n == 0 || m.n == m.facet_rows * m.cols) && m.duration_us >= 0 &&
                     m.duration_us <= kLongestScan.count();
  const bool angles = finite(m.pan_rad) && finite(m.tilt_rad) && finite(m.pan_rate_radps) &&
                      finite(m.tilt_rate_radps);
  if (!shape || !angles) return std::nullopt;
  return facet_id(m.scan_id, m.reference_utime, m.facet, m.facet_count, m.utime);
}

std::optional<FacetId> identify(const ladar_points_t& m, const LadarParams& /*ladar*/) {
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

// A covariance that can be inverted whatever the message says.
bool usable_covariance(const Mat6& c) {
  return c.allFinite() && c.diagonal().minCoeff() >= 0.0 && c.diagonal().maxCoeff() < 1e8;
}

Mat6 isotropic(double sigma_m, double sigma_rad) {
  Vec6 d;
  d << Vec3::Constant(sigma_m * sigma_m), Vec3::Constant(sigma_rad * sigma_rad);
  return d.asDiagonal();
}

}  // namespace

SpNode::SpNode(const SpConfig& config, std::optional<ElevationMap> prior_map, Bus* bus)
    : config_(config),
      prior_map_(std::move(prior_map)),
      ranges_(bus, channel::kLadarRanges, 48),
      facets_(bus, channel::kLadarPoints, 144),
      ins_(bus, channel::kIns, 256),
      nav_states_(bus, channel::kWmNavState, 8),
      registration_out_(bus, channel::kSpRegistration),
      points_out_(bus, channel::kSpPoints),
      report_(bus, config.info.name, from_seconds(1.0)),
      assembler_(config.ladar),
      inertial_(256),
      map_(config.map) {
  reserve();
}

// A range image has a size: no cycle needs to allocate for it. Scans of Cartesian points grow the
// buffers until the largest has been seen.
void SpNode::reserve() {
  const auto n =
      static_cast<std::size_t>(config_.ladar.rows) * static_cast<std::size_t>(config_.ladar.cols);
  assembler_.scan()->reserve(n);
  for (Points* points : {&dense_, &source_, &prior_source_}) points->reserve(n);
  map_sampler_.reserve(n);
  source_sampler_.reserve(n);
  map_.reserve(n);
  icp_.matches.reserve(n);
  icp_.pairs_of_voxel.resize(map_.voxel_ids());
  prior_match_.matches.reserve(n);
  prior_match_.counts.reserve(4 * n);
  points_message_.x_m.reserve(kPointsPerMessage);
  points_message_.y_m.reserve(kPointsPerMessage);
  points_message_.z_m.reserve(kPointsPerMessage);
  points_out_.reserve(12 * kPointsPerMessage + 256);
}

std::vector<const InboxBase*> SpNode::inboxes() const {
  return {&ranges_, &facets_, &ins_, &nav_states_};
}

Stamp SpNode::next_wakeup() const {
  Stamp next = std::min(ranges_.oldest_arrival(), facets_.oldest_arrival());
  if (assembler_.in_hand()) next = std::min(next, last_facet_arrival_ + config_.facet_timeout);
  return next;
}

Duration SpNode::nominal_compute() const {
  // Only the cycle that ends a scan costs: the others convert one facet.
  const auto waiting = static_cast<int>(ranges_.size() + facets_.size());
  const bool ends_scan = assembler_.in_hand() && assembler_.facets_missing() <= waiting;
  return ends_scan ? config_.info.nominal_compute : Duration::zero();
}

void SpNode::run(const Cycle& cycle) {
  take_inertial();
  take_belief();
  take_facets(&ranges_, cycle);
  take_facets(&facets_, cycle);
  cycle.stages->mark("convert");
  const bool timed_out = assembler_.in_hand() && ranges_.empty() && facets_.empty() &&
                         cycle.now >= last_facet_arrival_ + config_.facet_timeout;
  if (timed_out) finish_scan(cycle);
}

void SpNode::take_inertial() {
  for (const ins_t* m = ins_.front(); m != nullptr; ins_.pop(), m = ins_.front()) {
    InertialSample s{from_utime(m->utime), Duration(m->interval_us),
                     from_message(m->delta_angle_rad), from_message(m->delta_v_mps)};
    const bool sound = m->valid != 0 && m->interval_us > 0 && m->interval_us <= 1'000'000 &&
                       s.delta_angle_rad.allFinite() && s.delta_v_mps.allFinite();
    if (sound) static_cast<void>(inertial_.add(s));  // WM reports what repeats or steps back
  }
}

void SpNode::take_belief() {
  const nav_state_t* m = nav_states_.latest();
  if (m == nullptr) return;
  belief_.reset();
  T_world_rolling_.reset();
  Pose T_world_vehicle;
  Pose T_rolling_vehicle;
  const Mat6 rolling_covariance = from_message<6>(m->cov_rolling_pose);
  const Mat6 world_covariance = from_message<6>(m->cov_world_pose);
  const bool sound =
      m->rolling_valid != 0 && m->map_epoch == epoch_ &&
      from_message(m->q_world_vehicle, m->p_world_vehicle_m, &T_world_vehicle) &&
      from_message(m->q_rolling_vehicle, m->p_rolling_vehicle_m, &T_rolling_vehicle) &&
      usable_covariance(rolling_covariance) && usable_covariance(world_covariance);
  if (sound) {
    MotionState s;
    const Quat q_rolling_world = T_rolling_vehicle.q * T_world_vehicle.q.conjugate();
    s.stamp = from_utime(m->utime);
    s.T_rolling_vehicle = T_rolling_vehicle;
    s.v_rolling = q_rolling_world * from_message(m->v_world_mps);
    s.gravity_rolling = q_rolling_world * Vec3(0.0, 0.0, -kGravity_mps2);
    s.gyro_bias_radps = from_message(m->gyro_bias_radps);
    s.accel_bias_mps2 = from_message(m->accel_bias_mps2);
    s.rate_vehicle_radps = from_message(m->rate_vehicle_radps);
    const bool finite_motion = s.v_rolling.allFinite() && s.gyro_bias_radps.allFinite() &&
                               s.accel_bias_mps2.allFinite() && s.rate_vehicle_radps.allFinite();
    if (finite_motion) {
      belief_ = s;
      belief_covariance_ = rolling_covariance;
    }
    const Vec3 datum(m->datum_lat_deg, m->datum_lon_deg, m->datum_height_m);
    const Geodetic place{radians(datum.x()), radians(datum.y()), {datum.z()}};
    if (m->world_valid != 0 && prior_map_ && plausible(place)) {
      T_world_rolling_ = T_world_vehicle * T_rolling_vehicle.inverse();
      world_covariance_ = world_covariance;
      if (!T_map_world_ || datum != datum_) {
        T_map_world_ = LocalFrame(prior_map_->datum()).from(LocalFrame(place));
        datum_ = datum;
      }
    }
  }
  nav_states_.pop();
}

template <class Message>
void SpNode::take_facets(Inbox<Message>* inbox, const Cycle& cycle) {
  for (const Message* m = inbox->front(); m != nullptr; m = inbox->front()) {
    const std::optional<FacetId> id = identify(*m, config_.ladar);
    if (!id) {
      report_.warn(cycle.now, "facet.refused",
                   "a facet of {} does not fit the configured LADAR or its own counts: scan {}, "
                   "facet {} of {}",
                   inbox->channel(), m->scan_id, m->facet, m->facet_count);
      inbox->pop();
      continue;
    }
    const FacetVerdict verdict = assembler_.add(*id, view(*m));
    if (verdict == FacetVerdict::kNewScan) {
      finish_scan(cycle);  // with facets missing; then this one starts the next scan
      continue;
    }
    if (verdict == FacetVerdict::kAdded) {
      last_facet_arrival_ = inbox->front_arrival();
    } else {
      report_.warn(cycle.now, "facet.stale", "facet {} of scan {} came {}", m->facet, m->scan_id,
                   verdict == FacetVerdict::kOld ? "after its scan was done" : "twice");
    }
    inbox->pop();
    if (assembler_.complete()) finish_scan(cycle);
  }
}

void SpNode::finish_scan(const Cycle& cycle) {
  cycle.stages->mark("convert");
  Scan* scan = assembler_.scan();
  const int facets_lost = assembler_.facets_missing();
  registration_message_.scan_id = assembler_.scan_id();
  registration_message_.utime = to_utime(scan->reference);
  registration_message_.facets_lost = static_cast<std::int16_t>(facets_lost);
  registration_message_.arrival_utime = to_utime(last_facet_arrival_);
  if (facets_lost > 0) {
    report_.warn(cycle.now, "scan.incomplete", "scan {}: {} facets did not come",
                 assembler_.scan_id(), facets_lost);
  }

  const Expectation expected = expect(scan->reference);
  if (!scan->dt_us.empty()) {
    const auto [first, last] = std::minmax_element(scan->dt_us.begin(), scan->dt_us.end());
    if (*first != 0 || *last != 0) {
      tabulate_motion(expected.at_reference, inertial_, scan->reference, Duration(*first),
                      Duration(*last), &motion_);
      deskew(motion_, scan);
    }
  }
  cycle.stages->mark("deskew");
  map_sampler_.sample(scan->points, config_.map_voxel_m, &dense_);
  source_sampler_.sample(dense_, config_.source_voxel_m, &source_);
  cycle.stages->mark("sample");

  if (epoch_ == 0 && !source_.empty()) {
    seed(expected.at_reference.T_rolling_vehicle);
  } else {
    register_scan(cycle, expected);
  }
  assembler_.release();
  cycle.stages->mark("publish");
  cycle.stages->close_account();
}

SpNode::Expectation SpNode::expect(Stamp reference) const {
  Expectation e;
  const bool inertial_covers =
      inertial_.size() > 0 && inertial_[inertial_.size() - 1].stamp >= reference - kInertialGap;
  if (belief_ && inertial_covers) {
    e.at_reference = propagate(*belief_, inertial_, reference);
    const double dt = std::abs(seconds(reference - belief_->stamp));
    e.covariance = config_.prediction_sigma_scale * config_.prediction_sigma_scale *
                   (belief_covariance_ + isotropic(0.01 + 0.1 * dt, 0.001 + 0.01 * dt));
    return e;
  }
  // Constant velocity: the last motion goes on.
  e.covariance = isotropic(config_.coast_sigma_m, config_.coast_sigma_rad);
  e.at_reference.stamp = last_.stamp == Stamp::min() ? reference : last_.stamp;
  e.at_reference.T_rolling_vehicle = last_.T_rolling_vehicle;
  if (before_last_.stamp != Stamp::min()) {
    const double dt = seconds(last_.stamp - before_last_.stamp);
    const Pose moved = before_last_.T_rolling_vehicle.inverse() * last_.T_rolling_vehicle;
    const Vec6 twist = log_se3(moved) / dt;
    e.at_reference.v_rolling = last_.T_rolling_vehicle.q * twist.head<3>();
    e.at_reference.rate_vehicle_radps = twist.tail<3>();
  }
  e.at_reference = coast(e.at_reference, reference);
  return e;
}

void SpNode::seed(const Pose& T_rolling_vehicle) {
  // Distinct from the epochs of an earlier run of this process, so that WM cannot mix them up.
  const auto from_time =
      static_cast<std::int32_t>((registration_message_.utime / 1000) % 1'000'000'000);
  epoch_ = std::max(epoch_ + 1, from_time + 1);
  failures_ = 0;
  map_.clear();
  map_.insert(dense_, T_rolling_vehicle);
  last_ = {};
  before_last_ = {};
  remember(T_rolling_vehicle);
  Registration seeded;
  seeded.stop = Stop::kSeeded;
  seeded.T_target_vehicle = T_rolling_vehicle;
  seeded.points = static_cast<int>(source_.size());
  fill(seeded, registration_t::TARGET_ROLLING);
  registration_out_.publish(&registration_message_);
  publish_points(T_rolling_vehicle);
}

void SpNode::register_scan(const Cycle& cycle, const Expectation& expected) {
  const Prediction prediction{expected.at_reference.T_rolling_vehicle, expected.covariance};
  const WorkUnits granted = grant(cycle, config_.grant);
  const Registration rolling =
      register_points(source_, &map_, prediction, config_.icp, granted, &icp_);
  cycle.stages->mark("register");
  fill(rolling, registration_t::TARGET_ROLLING);
  registration_out_.publish(&registration_message_);

  if (!usable(rolling.stop)) {
    report_.warn(cycle.now, "registration.failed",
                 "scan {}: stop {}, {} of {} points matched, {:.2f} m from the prediction",
                 assembler_.scan_id(), static_cast<int>(rolling.stop), rolling.pairs,
                 rolling.points, rolling.correction_m);
    if (++failures_ >= config_.reseed_after && !source_.empty()) {
      report_.error(cycle.now, "map.reseeded", "{} scans in a row failed: a new map starts",
                    failures_);
      seed(prediction.T_target_vehicle);
    }
    return;
  }
  failures_ = 0;
  const Pose T_rolling_vehicle = fused_pose(prediction, rolling);
  remember(T_rolling_vehicle);
  publish_points(T_rolling_vehicle);
  match_prior(cycle, T_rolling_vehicle);
  map_.insert(dense_, T_rolling_vehicle);
  cycle.stages->mark("map");
}

void SpNode::match_prior(const Cycle& cycle, const Pose& T_rolling_vehicle) {
  if (!prior_map_ || !T_world_rolling_ || !T_map_world_) return;
  source_sampler_.sample(source_, config_.prior_voxel_m, &prior_source_);
  const Prediction prediction{*T_map_world_ * *T_world_rolling_ * T_rolling_vehicle,
                              world_covariance_ + isotropic(0.01, 0.001)};
  PriorMatch match = match_prior_map(prior_source_, *prior_map_, prediction, config_.prior,
                                     grant(cycle, config_.grant), &prior_match_);
  match.registration.T_target_vehicle =
      T_map_world_->inverse() * match.registration.T_target_vehicle;
  fill(match.registration, registration_t::TARGET_PRIOR_MAP);
  registration_message_.n_tiles = 1;
  registration_message_.tile_id.assign(1, match.tile_id);
  registration_out_.publish(&registration_message_);
  cycle.stages->mark("prior");
}

void SpNode::remember(const Pose& T_rolling_vehicle) {
  const Stamp stamp = from_utime(registration_message_.utime);
  if (stamp <= last_.stamp) return;  // a clock that stepped back gives no velocity
  before_last_ = last_;
  last_ = {stamp, T_rolling_vehicle};
}

void SpNode::fill(const Registration& r, int target) {
  registration_t& m = registration_message_;
  m.target = static_cast<std::int8_t>(target);
  m.map_epoch = epoch_;
  m.n_tiles = 0;
  m.tile_id.clear();
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

void SpNode::publish_points(const Pose& T_rolling_vehicle) {
  points_t& m = points_message_;
  m.utime = registration_message_.utime;
  m.scan_id = registration_message_.scan_id;
  m.map_epoch = epoch_;
  to_message(T_rolling_vehicle, m.q_rolling_vehicle, m.p_rolling_vehicle_m);
  const std::size_t parts = (source_.size() + kPointsPerMessage - 1) / kPointsPerMessage;
  m.part_count = static_cast<std::int16_t>(parts);
  for (std::size_t part = 0; part < parts; ++part) {
    const std::size_t begin = part * kPointsPerMessage;
    const std::size_t end = std::min(begin + kPointsPerMessage, source_.size());
    const auto from = static_cast<std::ptrdiff_t>(begin);
    const auto to = static_cast<std::ptrdiff_t>(end);
    m.part = static_cast<std::int16_t>(part);
    m.n = static_cast<std::int32_t>(end - begin);
    m.x_m.assign(source_.x.begin() + from, source_.x.begin() + to);
    m.y_m.assign(source_.y.begin() + from, source_.y.begin() + to);
    m.z_m.assign(source_.z.begin() + from, source_.z.begin() + to);
    points_out_.publish(&m);
  }
}

Result<std::unique_ptr<Node>> make_sp_node(const ParamFile& file, Bus* bus) {
  Result<SpConfig> config = load_sp_config(file);
  if (!config) return config.error();
  std::optional<ElevationMap> prior_map;
  if (!config->prior_map.empty()) {
    Result<ElevationMap> map = ElevationMap::load(config->prior_map);
    if (!map) return map.error();
    prior_map = std::move(map).value();
  }
  return std::unique_ptr<Node>(std::make_unique<SpNode>(*config, std::move(prior_map), bus));
}

}  // namespace rcs::sp
