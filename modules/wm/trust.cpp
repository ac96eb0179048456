#include "modules/wm/trust.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "modules/wm/sources.h"

namespace rcs::wm {
namespace {

constexpr int kRefusedInRow = 3;  // of a hypothesis' measurements: it is none
constexpr Duration kFresh = from_seconds(2.0);
constexpr double kCalm = 0.3;        // doubt below which a belief is worth a branch
constexpr double kMostExcess = 5.0;  // that one fix adds: a single bad one is none
constexpr double kLimit = 9.21;      // of chi squared, 99 %, two dof: better late than wrong
// The same, 99.9 %, two and one: nobody forges a map, and going on without one is no harm.
constexpr double kMapLimit2 = 13.82;
constexpr double kMapLimit1 = 10.83;
constexpr Duration kYoung = from_seconds(1.0);  // a shadow tells nothing yet

Mat<2, 2> horizontal(const FilterState& s) { return s.belief.P.block<2, 2>(kPosition, kPosition); }

/// Squared difference of two filters in units of its variance (Hausman 1978: what the one knows
/// more than the other is the variance of their difference).
double difference(const FilterState& less, const FilterState& more, double floor_m) {
  const Vec2 d = (less.belief.x.T_world_vehicle.p - more.belief.x.T_world_vehicle.p).head<2>();
  const Eigen::SelfAdjointEigenSolver<Mat<2, 2>> eigen(horizontal(less) - horizontal(more));
  const Vec2 variance = eigen.eigenvalues().cwiseMax(0.0).array() + floor_m * floor_m;
  const Vec2 along = eigen.eigenvectors().transpose() * d;
  return along.cwiseAbs2().cwiseQuotient(variance).sum();
}

/// The same of the heading, which a turned map takes along long before the place.
double heading_difference(const FilterState& less, const FilterState& more) {
  constexpr double kFloor = 2e-3;  // [rad], of what the models do not know
  const double d =
      wrap_angle(yaw_of(less.belief.x.T_world_vehicle.q) - yaw_of(more.belief.x.T_world_vehicle.q));
  constexpr int kYaw = kAttitude + 2;
  const double known = less.belief.P(kYaw, kYaw) - more.belief.P(kYaw, kYaw);
  return d * d / (std::max(known, 0.0) + kFloor * kFloor);
}

struct Nis {
  double horizontal = 0.0;
  double vertical = 0.0;
  double sigma_m = 0.0;  ///< horizontal, the larger axis of the innovation
};

/// @param floor_m  sigma of what the model does not know
Nis nis(const FilterState& s, const GpsFix& z, const GpsParams& params, double floor_m) {
  const Residual<3> r = gps_position(s.belief.x, z, params);
  Mat3 S = r.H * s.belief.P * r.H.transpose() + r.R;
  S.diagonal().array() += floor_m * floor_m;
  const Mat<2, 2> S_h = S.topLeftCorner<2, 2>();
  const Vec2 r_h = r.r.head<2>();
  Nis out;
  out.horizontal = r_h.dot(S_h.llt().solve(r_h));
  out.vertical = r.r[2] * r.r[2] / S(2, 2);
  out.sigma_m = std::sqrt(Eigen::SelfAdjointEigenSolver<Mat<2, 2>>(S_h).eigenvalues()[1]);
  return out;
}

void step(const Model& model, const Measurement& m, const ImuSample* next_imu, FilterState* s,
          Innovations* records) {
  advance(model, m.stamp, next_imu, s, records);
  apply(model, m, s, records);
}

}  // namespace

Trust::Trust(const TrustParams& params)
    : params_(params),
      limit_1_(chi_square_gate(1, params.false_alarm)),
      limit_2_(chi_square_gate(2, params.false_alarm)) {}

void Trust::clear() {
  const TrustParams params = params_;
  const int findings = findings_;
  *this = Trust(params);
  findings_ = findings;
}

void Trust::Hypothesis::count(bool accepted) {
  if (accepted) {
    ++agreed;
    refused_in_row = 0;
  } else {
    ++refused;
    if (++refused_in_row >= kRefusedInRow) began = Stamp::min();
  }
}

void Trust::move(const Model& model, const Measurement& m, const ImuSample* next_imu) {
  for (Shadow* shadow : {&inertial_young_, &inertial_, &without_ladar_, &without_gps_young_,
                         &without_gps_, &before_}) {
    if (!shadow->alive()) continue;
    Innovations unread;
    step(model, m, next_imu, &shadow->state, &unread);
  }
  const bool fix = std::holds_alternative<GpsFix>(m.value);
  const bool match = std::holds_alternative<RollingMatch>(m.value);
  for (Hypothesis* hypothesis : {&gps_right_, &ladar_right_}) {
    if (!hypothesis->alive()) continue;
    Innovations records;
    step(model, m, next_imu, &hypothesis->state, &records);
    const bool concerns = hypothesis == &gps_right_ ? fix : match;
    const Source source = fix ? Source::kGpsPosition : Source::kRolling;
    for (int k = 0; concerns && k < records.count; ++k) {
      const Innovation& record = records.records[static_cast<std::size_t>(k)];
      if (record.source == source) {
        hypothesis->count(record.reason == Reason::kAccepted);
      }
    }
  }
}

bool Trust::well(const FilterState& belief) const {
  const Memory& m = belief.memory;
  if (m.withheld.gps || m.withheld.ladar) return false;
  // A little doubt keeps the shadow that raised it, but not for ever.
  const bool old =
      without_gps_.alive() && belief.belief.x.stamp - without_gps_.branch > 4 * params_.branch;
  if (std::max({gps_doubt_, ladar_doubt_, map_doubt_}) > (old ? 1.0 : kCalm)) return false;
  const Stamp fix = m.of(Source::kGpsPosition).accepted;
  const bool without = !m.anchored;  // there is no GPS to go without
  return without || belief.belief.x.stamp - fix < kFresh;
}

/// Where north is hardly known no path can be held against another.
bool Trust::knows_north(const FilterState& belief) const {
  const double heading = belief.belief.P(kAttitude + 2, kAttitude + 2);
  return !belief.memory.anchored ||
         heading <= params_.heading_sigma_rad * params_.heading_sigma_rad;
}

void Trust::branch_all(const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  inertial_young_ = {belief, now};
  inertial_young_.state.memory.withheld = {true, true, true};
  without_ladar_ = {belief, now};
  without_ladar_.state.memory.withheld.ladar = true;
  without_gps_young_ = {belief, now};
  without_gps_young_.state.memory.withheld.gps = true;
  without_gps_young_.state.memory.withheld.prior_map = true;
  young_began_m_ = belief.memory.distance_m;
  cusum_.setZero();
}

void Trust::renew(const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  if (inertial_young_.alive() && now - inertial_young_.branch < params_.branch) return;
  if (!well(belief)) return;
  if (!knows_north(belief)) {
    // Nor against one from long ago: the watch begins anew.
    inertial_young_ = inertial_ = without_ladar_ = without_gps_young_ = without_gps_ = Shadow{};
    detectable_m_ = kAnything_m;
    return;
  }
  const bool first = !inertial_young_.alive();
  if (!first) grow_up();
  branch_all(belief);
  if (first) grow_up();
}

void Trust::grow_up() {
  inertial_ = inertial_young_;
  without_gps_ = without_gps_young_;
  without_gps_began_m_ = young_began_m_;
}

std::optional<FilterState> Trust::add(const Model& model, const Measurement& m,
                                      const ImuSample* next_imu, const FilterState& belief) {
  without_ladar_.state.memory.withheld.gps = belief.memory.withheld.gps;
  move(model, m, next_imu);
  const bool accused = belief.memory.gps_accused && !accused_;
  accused_ = belief.memory.gps_accused;
  // What the fixes that are refused now did before: nobody knows when they began to go astray.
  const auto* const fix = std::get_if<GpsFix>(&m.value);
  if (accused && fix != nullptr && without_gps_.alive() &&
      belief.belief.x.stamp - without_gps_.branch > kYoung) {
    return convict(model, *fix, belief);
  }
  std::optional<FilterState> change;
  if (fix != nullptr && belief.memory.anchored) {
    change = belief.memory.withheld.gps ? judge_quarantined_fix(model, *fix, belief)
                                        : judge_fix(model, *fix, belief);
  } else if (std::holds_alternative<PriorMatch>(m.value)) {
    change = judge_prior_match(belief, model.params.modes);
  } else if (std::holds_alternative<RollingMatch>(m.value)) {
    change = belief.memory.withheld.ladar ? judge_quarantined_match(belief, model.params.modes)
                                          : judge_match(belief, model.params.modes);
  }
  if (!change) renew(belief);
  return change;
}

/// Cumulative sums (Page 1954) of what the fixes' velocity has too much, both ways along both axes:
/// fixes that go astray slowly do so for long. What the shadow's own velocity may be off, its
/// heading's error above all, is the same in all fixes: no sum makes that certain, so three
/// standard deviations of it are let pass.
void Trust::sum_velocity(const Model& model, const GpsFix& z) {
  if (!z.has_velocity) return;
  constexpr double kLetPass = 3.0;
  const FilterState& s = without_gps_.state;
  const Residual<3> r = gps_velocity(s.belief.x, z, model.params.gps, accel_world(s));
  const Mat3 shared = r.H * s.belief.P * r.H.transpose();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const double white = std::sqrt(r.R(axis, axis));
    const double passed = kLetPass * std::hypot(std::sqrt(shared(axis, axis)), params_.floor_mps);
    double& up = cusum_[2 * axis];
    double& down = cusum_[2 * axis + 1];
    up = std::max(0.0, up + std::min((r.r[axis] - passed) / white, kMostExcess));
    down = std::max(0.0, down + std::min((-r.r[axis] - passed) / white, kMostExcess));
  }
}

/// The fix against where the vehicle would be without any since the branch: the belief's
/// correlation with the receiver's slow error makes it a test of the fixes' shape, not of the
/// place.
std::optional<FilterState> Trust::judge_fix(const Model& model, const GpsFix& z,
                                            const FilterState& belief) {
  const Stamp now = belief.belief.x.stamp;
  const SourceRecord& record = belief.memory.of(Source::kGpsPosition);
  rival_m_ = 0.0;
  gps_right_ = {};
  // No matches come any more that could take the map's doubt back, and fixes say where it is.
  const Stamp mapped = belief.memory.of(Source::kPriorMap).accepted;
  if (record.accepted == now && mapped < now - kFresh) map_doubt_ = map_rival_m_ = 0.0;
  if (before_.alive() && now >= gps_probation_) before_ = {};
  agreeing_.fill(false);
  agreeing_since_ = Stamp::min();
  if (!without_gps_.alive() || now - without_gps_.branch < kYoung) return std::nullopt;
  const double way_m = belief.memory.distance_m - without_gps_began_m_;
  const Nis n = nis(without_gps_.state, z, model.params.gps, params_.floor_share * way_m);
  detectable_m_ = std::sqrt(limit_2_) * n.sigma_m;
  double astray = n.horizontal / limit_2_;
  if (belief.memory.heights_refused == 0) astray = std::max(astray, n.vertical / limit_1_);
  sum_velocity(model, z);
  const double drifting = cusum_.maxCoeff() / params_.cusum;
  gps_doubt_ = std::max(astray, drifting);
  // What the belief refused by itself has done no harm.
  const bool harmful = record.accepted == now;
  doubted_ = harmful && astray > 1.0 ? doubted_ + 1 : 0;
  if (doubted_ < params_.doubted && !(harmful && drifting > 1.0)) return std::nullopt;
  return convict(model, z, belief);
}

/// Fixes and the belief without them contradict one another: somebody is guilty.
FilterState Trust::convict(const Model& model, const GpsFix& z, const FilterState& belief) {
  if (ladar_is_to_blame(model, z)) {
    FilterState next = without_ladar_.state;
    next.memory.withheld = belief.memory.withheld;
    next.memory.withheld.gps = next.memory.gps_accused = false;
    next.memory.of(Source::kGpsPosition).refused = 0;
    next.memory.withheld.ladar = true;
    next.belief.x.map_epoch = -1;  // its place is not known without what is withheld
    return found(Finding::kLadarGuilty, next, belief, model.params.modes);
  }
  const Stamp now = belief.belief.x.stamp;
  const bool on_probation = gps_probation_ != Stamp::min() && now < gps_probation_;
  FilterState next = without_gps_.state;
  next.memory.withheld.prior_map = belief.memory.withheld.prior_map;
  next.memory.withheld.gps = next.memory.gps_accused = true;
  return found(on_probation ? Finding::kGpsBackRevoked : Finding::kGpsGuilty, next, belief,
               model.params.modes);
}

/// Of GPS and LADAR, who contradicts the inertial motion, in place or in velocity? Whom that
/// motion's own error leaves open is GPS.
bool Trust::ladar_is_to_blame(const Model& model, const GpsFix& z) const {
  const FilterState& s = without_gps_.state;
  const NavState& x = s.belief.x;
  const NavState& inertial = inertial_.state.belief.x;
  // From the filter with the LADAR, the inertial motion goes half the way to the fix and farther.
  const auto sides_with = [this](const Vec3& fix, const Vec3& motion, int block) {
    const Cov& P = inertial_.state.belief.P;
    const double sigma = std::sqrt(std::max(P(block, block), P(block + 1, block + 1)));
    const Vec2 d = fix.head<2>();
    return sigma < 0.5 * d.norm() && motion.head<2>().dot(d) > 0.5 * d.squaredNorm();
  };
  const bool by_place = sides_with(gps_position(x, z, model.params.gps).r,
                                   inertial.T_world_vehicle.p - x.T_world_vehicle.p, kPosition);
  return by_place ||
         (z.has_velocity && sides_with(gps_velocity(x, z, model.params.gps, accel_world(s)).r,
                                       inertial.v_world - x.v_world, kVelocity));
}

/// Another belief begins, in which the fix is right and the place was wrong. Not the heading: fixes
/// that drift away look like another one.
void Trust::suppose_gps_right(const Model& model, const GpsFix& z, const FilterState& belief) {
  const NavState& x = belief.belief.x;
  const Vec3 off = gps_position(x, z, model.params.gps).r;
  gps_right_ = {belief, x.stamp, belief.memory.distance_m};
  FilterState& s = gps_right_.state;
  s.belief = loosen_world(belief.belief, off.cwiseAbs() + z.sigma_m, 0.0);
  s.memory.withheld.gps = s.memory.gps_accused = false;
  s.memory.of(Source::kGpsPosition).refused = 0;
  Innovations unread;
  apply(model, {x.stamp, z}, &s, &unread);
}

/// Fixes that go astray slowly contradict neither the last one nor a belief that follows them, but
/// the motion: they move away from the belief by more than it can have drifted.
bool Trust::keeps_its_shape(const Model& model, const GpsFix& z, const FilterState& belief) {
  const Vec2 off = gps_position(belief.belief.x, z, model.params.gps).r.head<2>();
  const double variance =
      Eigen::SelfAdjointEigenSolver<Mat<2, 2>>(horizontal(belief)).eigenvalues()[1];
  if (gps_right_.variance_m2 == 0.0) {
    gps_right_.off = off;
    gps_right_.variance_m2 = variance;
  }
  const double drifted = std::max(0.0, variance - gps_right_.variance_m2);
  const double fixes = 2.0 * z.sigma_m.head<2>().cwiseAbs2().maxCoeff();
  return (off - gps_right_.off).squaredNorm() <= kLimit * (drifted + fixes);
}

/// The fix's velocity is the belief's.
bool Trust::moves_along(const Model& model, const GpsFix& z, const FilterState& belief) const {
  if (!z.has_velocity) return true;
  const Residual<3> r = gps_velocity(belief.belief.x, z, model.params.gps, accel_world(belief));
  Mat<2, 2> S = (r.H * belief.belief.P * r.H.transpose() + r.R).topLeftCorner<2, 2>();
  S.diagonal().array() += params_.floor_mps * params_.floor_mps;
  const Vec2 off = r.r.head<2>();
  return off.dot(S.llt().solve(off)) <= kLimit;
}

/// Fixes come back where the motion has led, and not where the a priori map has.
std::optional<FilterState> Trust::map_is_to_blame(const Model& model, const GpsFix& z,
                                                  const FilterState& belief) {
  const Shadow& motion = without_gps_;
  const Memory& m = belief.memory;
  const bool used =
      motion.alive() && !m.withheld.prior_map && m.of(Source::kPriorMap).accepted > motion.branch;
  const bool by_motion = used && gps_doubt_ > 1.0 &&
                         nis(motion.state, z, model.params.gps, 0.0).horizontal <= model.gates[2];
  map_contradicted_ = by_motion ? map_contradicted_ + 1 : 0;
  if (map_contradicted_ < params_.doubted) return std::nullopt;
  return without_map(belief, model.params.modes);
}

FilterState Trust::without_map(const FilterState& belief, const ModeParams& modes) {
  FilterState next = without_gps_.state;
  next.memory.withheld = belief.memory.withheld;
  next.memory.withheld.prior_map = true;
  return found(Finding::kMapGuilty, next, belief, modes);
}

std::optional<FilterState> Trust::judge_quarantined_fix(const Model& model, const GpsFix& z,
                                                        const FilterState& belief) {
  const NavState& x = belief.belief.x;
  const Memory& m = belief.memory;
  if (before_.alive()) {  // it had been believed against the belief, and has contradicted itself
    return found(Finding::kGpsBackRevoked, before_.state, belief, model.params.modes);
  }
  const Nis n = nis(belief, z, model.params.gps, 0.0);
  gps_doubt_ = n.horizontal / model.gates[2];
  if (std::optional<FilterState> change = map_is_to_blame(model, z, belief)) return change;
  if (gps_right_.alive() && !keeps_its_shape(model, z, belief)) gps_right_ = {};
  if (!gps_right_.alive()) suppose_gps_right(model, z, belief);
  const bool consistent = gps_right_.alive() && gps_right_.refused_in_row == 0;
  const bool agrees = consistent && n.horizontal <= model.gates[2] && moves_along(model, z, belief);
  agreeing_[fixes_++ % agreeing_.size()] = agrees;
  if (!agrees) agreeing_since_ = Stamp::min();
  if (agrees && agreeing_since_ == Stamp::min()) agreeing_since_ = x.stamp;
  const bool settled = gps_right_.agreed >= params_.agreeing;
  const Vec3 apart = gps_right_.state.belief.x.T_world_vehicle.p - x.T_world_vehicle.p;
  rival_m_ = settled && !agrees ? apart.head<2>().norm() : 0.0;
  const auto agreeing = std::count(agreeing_.begin(), agreeing_.end(), true);
  if (agreeing >= params_.agreeing && agrees && x.stamp - agreeing_since_ >= params_.agreeing_for) {
    FilterState next = belief;
    next.memory.withheld.gps = next.memory.gps_accused = false;
    next.memory.of(Source::kGpsPosition).refused = 0;
    return found(Finding::kGpsBack, next, belief, model.params.modes);
  }
  const bool persistent = consistent && x.stamp - gps_right_.began >= params_.persistent &&
                          m.distance_m - gps_right_.began_m >= params_.persistent_m &&
                          gps_right_.agreed >= 9 * gps_right_.refused;
  if (!persistent) return std::nullopt;
  return found(Finding::kGpsRight, gps_right_.state, belief, model.params.modes);
}

/// The belief with the a priori map against the motion without it. A survey that is turned or bent
/// leads away so slowly that no single match of it says so.
std::optional<FilterState> Trust::judge_prior_match(const FilterState& belief,
                                                    const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  const bool used = belief.memory.of(Source::kPriorMap).accepted == now;
  if (!used || !without_gps_.alive() || now - without_gps_.branch < kYoung) return std::nullopt;
  map_doubt_ = std::max(difference(without_gps_.state, belief, params_.floor_m) / kMapLimit2,
                        heading_difference(without_gps_.state, belief) / kMapLimit1);
  const Vec3 apart =
      without_gps_.state.belief.x.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p;
  map_rival_m_ = map_doubt_ > kCalm ? apart.head<2>().norm() : 0.0;
  // With GPS the two also differ when it is GPS that goes astray: judge_fix tells.
  const bool by_fixes = now - belief.memory.of(Source::kGpsPosition).accepted < kFresh;
  if (map_doubt_ <= 1.0 || (by_fixes && gps_doubt_ > kCalm)) {
    map_doubted_since_ = Stamp::min();
    return std::nullopt;
  }
  if (map_doubted_since_ == Stamp::min()) map_doubted_since_ = now;
  if (now - map_doubted_since_ < params_.ladar_doubted) return std::nullopt;
  return without_map(belief, modes);
}

std::optional<FilterState> Trust::judge_match(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  ladar_right_ = {};
  if (!without_ladar_.alive() || now - without_ladar_.branch < kYoung) return std::nullopt;
  ladar_doubt_ = difference(without_ladar_.state, belief, params_.floor_m) / limit_2_;
  // With GPS the two also differ when it is GPS that goes astray: judge_fix tells.
  const Stamp fix = without_ladar_.state.memory.of(Source::kGpsPosition).accepted;
  const bool by_fixes = fix != Stamp::min() && now - fix < kFresh;
  const int refused = belief.memory.of(Source::kGpsPosition).refused;
  const bool astray = ladar_doubt_ > 1.0 && (!by_fixes || (gps_doubt_ < kCalm && refused == 0));
  if (!astray) {
    ladar_doubted_since_ = Stamp::min();
    return std::nullopt;
  }
  if (ladar_doubted_since_ == Stamp::min()) ladar_doubted_since_ = now;
  if (now - ladar_doubted_since_ < params_.ladar_doubted) return std::nullopt;
  FilterState next = without_ladar_.state;
  next.memory.withheld = belief.memory.withheld;
  next.memory.withheld.ladar = true;
  return found(Finding::kLadarGuilty, next, belief, modes);
}

std::optional<FilterState> Trust::judge_quarantined_match(const FilterState& belief,
                                                          const ModeParams& modes) {
  if (!ladar_right_.alive()) {
    // It begins a map of its own at the next match.
    ladar_right_ = {belief, belief.belief.x.stamp, belief.memory.distance_m};
    ladar_right_.state.memory.withheld.ladar = false;
    ladar_right_.state.memory.of(Source::kRolling).refused = 0;
    ladar_right_.state.belief.x.map_epoch = -1;
    return std::nullopt;
  }
  if (ladar_right_.agreed < params_.matches) return std::nullopt;
  ladar_doubt_ = difference(belief, ladar_right_.state, params_.floor_m) / limit_2_;
  if (ladar_doubt_ > kCalm) return std::nullopt;
  return found(Finding::kLadarBack, ladar_right_.state, belief, modes);
}

/// Goes on from `next` in place of `belief`.
FilterState Trust::found(Finding finding, const FilterState& next, const FilterState& belief,
                         const ModeParams& modes) {
  finding_ = finding;
  ++findings_;
  const Stamp now = belief.belief.x.stamp;
  FilterState state = next;
  state.memory.world_resets = belief.memory.world_resets;
  state.memory.last_reset_m = belief.memory.last_reset_m;
  state.memory.last_reset_rad = belief.memory.last_reset_rad;
  state.memory.last_reset = belief.memory.last_reset;
  state.memory.fix_heard = belief.memory.fix_heard;
  count_reset(modes, belief.belief.x.T_world_vehicle, &state);
  const bool of_ladar = finding == Finding::kLadarGuilty || finding == Finding::kLadarBack;
  if (finding == Finding::kGpsBack || finding == Finding::kGpsRight) {
    gps_probation_ = now + params_.probation;
  }
  if (finding == Finding::kLadarBack) ladar_probation_ = now + params_.probation;
  gps_right_ = ladar_right_ = {};
  agreeing_.fill(false);
  agreeing_since_ = ladar_doubted_since_ = map_doubted_since_ = Stamp::min();
  doubted_ = map_contradicted_ = 0;
  gps_doubt_ = ladar_doubt_ = map_doubt_ = rival_m_ = map_rival_m_ = 0.0;
  detectable_m_ = kAnything_m;
  before_ = finding == Finding::kGpsRight ? Shadow{belief, now} : Shadow{};
  // Shadows that a guilty source has led along are no good.
  const Shadow inertial = inertial_;
  branch_all(state);
  grow_up();
  if (of_ladar) inertial_ = inertial;
  return state;
}

const Shadow& Trust::shadow(Without what) const {
  if (what == Without::kAll) return inertial_;
  return what == Without::kLadar ? without_ladar_ : without_gps_;
}

Trusted Trust::gps(const FilterState& belief, const ModeParams& modes) const {
  const Memory& m = belief.memory;
  const Stamp now = belief.belief.x.stamp;
  if (m.fix_heard == Stamp::min() || now - m.fix_heard > modes.gps_timeout) return Trusted::kNone;
  if (m.withheld.gps) return Trusted::kQuarantine;
  const bool watched = gps_probation_ != Stamp::min() && now < gps_probation_;
  return watched ? Trusted::kProbation : Trusted::kFully;
}

Trusted Trust::ladar(const FilterState& belief, const ModeParams& modes) const {
  const Memory& m = belief.memory;
  const Stamp now = belief.belief.x.stamp;
  if (m.withheld.ladar) return Trusted::kQuarantine;
  const Stamp match = m.of(Source::kRolling).accepted;
  if (match == Stamp::min() || now - match > modes.rolling_timeout) return Trusted::kNone;
  const bool watched = ladar_probation_ != Stamp::min() && now < ladar_probation_;
  return watched ? Trusted::kProbation : Trusted::kFully;
}

}  // namespace rcs::wm
