// apply(): the gate of each source, and the readmission of measurements rejected by mistake.
#include "modules/wm/measurement_fusion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/wm/filter.h"

namespace rcs::wm {
namespace {

constexpr double kNoGate = std::numeric_limits<double>::infinity();

/// Fuses one measurement into the state.
class Fuser {
 public:
  Fuser(const Model& model, FilterState* state, Innovations* records)
      : model_(model), s_(*state), records_(*records) {}

  void operator()(const ImuSample&);
  void operator()(const RollingMatch& z);
  void operator()(const PriorMatch& z);
  void operator()(const GpsFix& z);
  void operator()(const OdometrySample& z);

 private:
  template <class F>
  Reason fuse(Source source, const F& residual_at);
  Reason fuse_place(const GpsFix& fix);
  void follow_claim(const Vec3& sigma_m);
  void follow_map(const MapBias& said);
  const TileStatus& watch_tile(const PriorMatch& z, const Residual<6>& alone, double* nis);
  [[nodiscard]] double new_share(Source source, double correlation_m) const;
  void look_at(Source source, const Residual<3>& z);
  void constrain();
  void refuse(Source source, Reason reason) { note({stamp(), source, reason}); }
  void note(const Innovation& i);
  [[nodiscard]] RegistrationParams match_params(const RollingMatch& z) const;
  bool clone(const RollingMatch& z);
  void correct_local(Source source, const NavState& before);
  [[nodiscard]] Stamp stamp() const { return s_.belief.x.stamp; }

  const Model& model_;
  FilterState& s_;
  Innovations& records_;
};

void Fuser::note(const Innovation& i) {
  SourceRecord& record = s_.bookkeeping.of(i.source);
  if (i.reason == Reason::kAccepted) {
    record = {stamp(), s_.bookkeeping.distance_m, 0, record.in_row + 1};
    const bool fixes = i.source == Source::kGpsPosition || i.source == Source::kPriorMap;
    if (fixes) s_.bookkeeping.unconfirmed = false;
  } else if (i.reason == Reason::kGate || i.reason == Reason::kEpoch) {
    ++record.refused;
    record.in_row = 0;
  }
  records_.add(i);
}

/// Registrations measure the attitude. Other sources change it only through the correlations of a
/// linearized motion.
double max_turn_rad(Source source) {
  const bool measures_attitude = source == Source::kRolling || source == Source::kPriorMap;
  return measures_attitude ? std::numeric_limits<double>::infinity() : 0.15;
}

/// @param residual_at  NavState -> Residual<M>
template <class F>
Reason Fuser::fuse(Source source, const F& residual_at) {
  constexpr int M = decltype(residual_at(s_.belief.x))::kRows;
  const Residual<M> z = residual_at(s_.belief.x);
  const double gate = model_.gates[static_cast<std::size_t>(z.dof)];
  const Fusion<M> f = update_iterated<M>(s_.belief, residual_at, gate, max_turn_rad(source));
  Innovation i{stamp(), source, f.reason, z.dof, f.nis, gate};
  i.r.template head<M>() = z.r;
  i.sigma.template head<M>() = f.sigma;
  if (f.reason == Reason::kAccepted) {
    const NavState before = s_.belief.x;
    s_.belief = f.belief;
    correct_local(source, before);
    count_reset(model_.params.modes, before.T_world_vehicle, &s_);
  }
  note(i);
  return f.reason;
}

/// Records the innovation of a measurement of a quarantined source.
void Fuser::look_at(Source source, const Residual<3>& z) {
  const Fusion<3> f = update(s_.belief, z, kNoGate);
  Innovation i{stamp(), source, Reason::kQuarantine, z.dof, f.nis, model_.gates[3]};
  i.r.head<3>() = z.r;
  i.sigma.head<3>() = f.sigma;
  note(i);
}

/// A match moves the local pose as it moves the vehicle in its map. Corrections that move vehicle
/// and map together (GPS, the a priori map) do not.
void Fuser::correct_local(Source source, const NavState& before) {
  if (before.map_epoch < 0) return;
  Bookkeeping& m = s_.bookkeeping;
  const Pose moved = T_rolling_vehicle(before).inverse() * T_rolling_vehicle(s_.belief.x);
  m.uncorrected = m.uncorrected * moved;
  if (source != Source::kRolling) return;
  m.T_local_vehicle = m.T_local_vehicle * m.uncorrected;
  m.uncorrected = Pose{};
}

/// With an INS the weakly observed directions of a LADAR that is suspected are not used; without
/// it nothing else measures them.
RegistrationParams Fuser::match_params(const RollingMatch& z) const {
  const RegistrationParams& params = model_.params.rolling.match;
  return s_.belief.x.inertial ? params : params_of(z, params);
}

/// Restarts the rolling-map frame at the vehicle. False if the scan does not observe the whole
/// pose.
bool Fuser::clone(const RollingMatch& z) {
  int unobserved = 0;
  const Mat6 covariance =
      registration_covariance(s_.belief.x, z.information, match_params(z), &unobserved);
  if (unobserved > 0) return false;
  s_.belief = start_epoch(s_.belief, z.T_rolling_vehicle, z.map_epoch, covariance);
  s_.bookkeeping.uncorrected = Pose{};
  note({stamp(), Source::kRolling, Reason::kAccepted});
  return true;
}

/// Scans close together see the same points of the ground, in the scan and in the map, and share
/// their error: what is new in a match comes with the way since the last one.
double Fuser::new_share(Source source, double correlation_m) const {
  const SourceRecord& last = s_.bookkeeping.of(source);
  if (last.accepted == Stamp::min()) return 1.0;
  return std::min(1.0, (s_.bookkeeping.distance_m - last.distance_m) / correlation_m);
}

void Fuser::operator()(const RollingMatch& as_registered) {
  constexpr double kMinWeight = 0.02;  // at standstill
  const RollingMatch z = scaled(as_registered, model_.ladar_scales.at(stamp()));
  const RollingParams& rolling = model_.params.rolling;
  const RegistrationParams params = match_params(z);
  if (z.seeded) {
    // Also without LADAR: the new map is where the vehicle is, which measures nothing.
    s_.belief = start_epoch(s_.belief, z.T_rolling_vehicle, z.map_epoch);
    s_.bookkeeping.uncorrected = Pose{};
    s_.bookkeeping.rejected_matches.stamp = Stamp::min();
  }
  if (s_.bookkeeping.excluded.ladar) {
    refuse(Source::kRolling, Reason::kQuarantine);
    return;
  }
  if (z.seeded) {
    note({stamp(), Source::kRolling, Reason::kAccepted});
    return;
  }
  // Rejected for long while SP tracks its map steadily: the estimated pose of that map is wrong.
  const bool refused_long =
      s_.bookkeeping.of(Source::kRolling).refused + 1 >= rolling.refused_until_reset;
  if (z.map_epoch != s_.belief.x.map_epoch) {
    // The first message of a newer epoch was lost, or SP was started before WM. An older epoch is
    // late data, unless it persists: then SP was restarted.
    const bool newer = z.map_epoch > s_.belief.x.map_epoch;
    if ((newer || refused_long) && clone(z)) return;
    if (refused_long) {
      // On flat, open ground no scan observes the whole pose. Without a map, or with one that SP no
      // longer has, WM would wait for such a scan at rest for ever, as BG would for WM: the map is
      // where SP has the vehicle, as when it was seeded there.
      s_.belief = start_epoch(s_.belief, z.T_rolling_vehicle, z.map_epoch,
                              observed_covariance(z.information, params));
      s_.bookkeeping.uncorrected = Pose{};
      note({stamp(), Source::kRolling, Reason::kAccepted});
      return;
    }
    refuse(Source::kRolling, Reason::kEpoch);
    return;
  }
  const double way_m = s_.bookkeeping.distance_m - s_.bookkeeping.of(Source::kRolling).distance_m;
  const double weight = std::max(kMinWeight, new_share(Source::kRolling, rolling.correlation_m));
  const auto match = [&](const NavState& x) { return rolling_match(x, z, params, weight); };
  const Residual<6> r = match(s_.belief.x);
  const double gate = model_.gates[static_cast<std::size_t>(r.dof)];
  const Vec3 apart_m = displacement(s_.belief.x, z, params);
  if (refused_long && update(s_.belief, r, gate).reason == Reason::kGate && clone(z)) {
    RejectedMatches& rejected = s_.bookkeeping.rejected_matches;
    const bool again = rejected.reset > stamp() - RejectedMatches::kResetLasts;
    rejected.add(stamp(), apart_m);
    rejected.reset_m = again ? Vec3(rejected.reset_m + apart_m) : apart_m;
    rejected.reset = stamp();
    rejected.stamp = Stamp::min();
    return;
  }
  if (fuse(Source::kRolling, match) != Reason::kAccepted) {
    s_.bookkeeping.rejected_matches.add(stamp(), apart_m);
    return;
  }
  s_.bookkeeping.rejected_matches.stamp = Stamp::min();
  s_.bookkeeping.unconfirmed = s_.bookkeeping.unconfirmed || ladar_is_alone(s_);
  // The scan with its error is part of the map now, to which later scans are matched.
  const Mat6 inherited = rolling.inherited * observed_covariance(z.information, params);
  s_.bookkeeping.inherited_m2 = inherited.diagonal().head<2>().maxCoeff();
  s_.bookkeeping.inherited_rad2 = inherited(5, 5);
  s_.belief = move_map(s_.belief, std::clamp(way_m, 0.0, 1.0) * inherited);
}

/// Another survey has another bias.
void Fuser::follow_map(const MapBias& said) {
  const MapBias bias = modelled_bias(said, model_.params);
  if (bias == s_.bookkeeping.map_bias) return;
  s_.bookkeeping.map_bias = bias;
  renew_map_offset(bias.sigma_m, &s_.belief);
}

/// Weights a tile by how well its matches have agreed with the other sources. A tile that is
/// outdated or less accurate than stated loses weight, a wrong one is excluded; agreement restores
/// it. A match contributes in proportion to what the filter knows without it.
const TileStatus& Fuser::watch_tile(const PriorMatch& z, const Residual<6>& alone, double* nis) {
  constexpr double kMax = 25.0;  // limits the effect of one outlier on a tile
  Bookkeeping& m = s_.bookkeeping;
  const auto newer = [](const TileStatus& a, const TileStatus& b) {
    return a.known != b.known ? b.known : a.distance_m < b.distance_m;
  };
  const TileStatus newest = *std::max_element(m.tiles.begin(), m.tiles.end(), newer);
  auto tile = std::find_if(m.tiles.begin(), m.tiles.end(),
                           [&z](const TileStatus& t) { return t.known && t.tile_id == z.tile_id; });
  if (tile == m.tiles.end()) {
    // A survey that is wrong here is probably wrong in the adjacent tile.
    TileStatus fresh = newest;
    fresh.tile_id = z.tile_id;
    fresh.known = true;
    tile = std::min_element(m.tiles.begin(), m.tiles.end(), newer);
    *tile = fresh;
  }
  const Mat<6, 3> J = alone.H.middleCols<3>(kMapBias);
  const Mat6 by_map = alone.R + m.map_bias.sigma_m * m.map_bias.sigma_m * J * J.transpose();
  const Mat6 S = alone.R + alone.H * s_.belief.P * alone.H.transpose();
  const Eigen::LLT<Mat6> llt(S);
  const int dof = std::max(1, alone.dof);
  const double tells = (llt.solve(by_map).trace() - (6 - dof)) / dof;
  *nis = alone.r.dot(llt.solve(alone.r));
  const double way_m = newest.known ? m.distance_m - newest.distance_m : 0.0;
  const double share = std::clamp(tells * way_m / model_.params.prior.nis_window_m, 0.0, 1.0);
  if (std::isfinite(*nis)) tile->excess += share * (std::min(*nis / dof, kMax) - tile->excess);
  tile->distance_m = m.distance_m;
  tile->suspected =
      tile->excess > (tile->suspected ? TileStatus::kReadmittedBelow : TileStatus::kExcludedAbove);
  m.newest_tile = *tile;
  return *tile;
}

void Fuser::operator()(const PriorMatch& z) {
  const Bookkeeping& m = s_.bookkeeping;
  if (!m.georeferenced) {
    refuse(Source::kPriorMap, Reason::kNoDatum);
    return;
  }
  if (m.excluded.ladar || m.excluded.prior_map) {
    refuse(Source::kPriorMap, Reason::kQuarantine);
    return;
  }
  // With an uncertain heading a rotated map would be accepted.
  const double heading = s_.belief.P(kAttitude + 2, kAttitude + 2);
  const double most = model_.params.prior.heading_sigma_rad;
  if (m.of(Source::kPriorMap).accepted == Stamp::min() && heading > most * most) {
    refuse(Source::kPriorMap, Reason::kQuarantine);
    return;
  }
  constexpr double kMin = 0.02;
  const double weight = new_share(Source::kPriorMap, model_.params.prior.correlation_m);
  if (weight < kMin) {
    refuse(Source::kPriorMap, Reason::kRepeated);
    return;
  }
  follow_map(z.bias);
  const PriorMapParams& params = model_.params.prior;
  const Residual<6> alone = prior_match(s_.belief.x, z, params, 1.0);
  double nis = 0.0;
  const TileStatus& tile = watch_tile(z, alone, &nis);
  if (tile.suspected) {
    refuse(Source::kPriorMap, Reason::kQuarantine);
    return;
  }
  // A match that fails the gate at full weight is not accepted for its small weight.
  const bool refused = nis > model_.gates[static_cast<std::size_t>(alone.dof)];
  const double share = refused ? 1.0 : weight / std::max(1.0, tile.excess);
  fuse(Source::kPriorMap, [&](const NavState& x) { return prior_match(x, z, params, share); });
}

void Fuser::operator()(const GpsFix& z) {
  Bookkeeping& m = s_.bookkeeping;
  if (!m.georeferenced) {
    refuse(Source::kGpsPosition, Reason::kNoDatum);
    return;
  }
  const FaultDetectionParams& fault_detection = model_.params.fault_detection;
  // After a long silence neither the fixes nor the belief are reliable.
  if (m.fix_received != Stamp::min() && stamp() - m.fix_received > fault_detection.silence) {
    m.excluded.gps = true;
  }
  m.fix_received = stamp();
  const GpsParams& params = model_.params.gps;
  const Belief before = s_.belief;
  const GpsScale scale = m.gps_scale;
  follow_claim(z.sigma_m.cwiseMax(params.sigma_floor_m));
  GpsFix fix = z;
  fix.slow_m = m.gps_scale.unit_m;
  const Residual<3> position = gps_position(s_.belief.x, fix, params);
  // A rejected fix does not change the model of the receiver's error either.
  const auto forget_claim = [&] {
    s_.belief = before;
    m.gps_scale = scale;
  };
  if (m.excluded.gps) {
    look_at(Source::kGpsPosition, position);
    forget_claim();
    return;
  }
  if (fuse_place(fix) == Reason::kGate) {
    forget_claim();
    if (m.of(Source::kGpsPosition).refused >= fault_detection.refused) {
      m.excluded.gps = m.gps_suspected = true;
      return;
    }
  }
  if (!z.has_velocity) return;
  const Vec3 accel = accel_world(s_);
  fuse(Source::kGpsVelocity, [&](const NavState& x) { return gps_velocity(x, z, params, accel); });
}

/// The time-correlated GPS error is a state in units of the reported sigma: another satellite
/// geometry scales both. A change of the solution, which changes the reported sigma by a large
/// factor, does not scale the error: an error seen at two scales (a float solution that becomes
/// fixed) would determine the position to centimetres. When the reported sigma grows by that
/// factor, the error continues in metres; when it falls, the error is renewed, and the smaller unit
/// is used once the reported sigma stays small.
void Fuser::follow_claim(const Vec3& sigma_m) {
  constexpr double kMuch = 3.0;
  constexpr Duration kStays = from_seconds(5.0);
  GpsScale& g = s_.bookkeeping.gps_scale;
  if (g.unit_m.isZero()) g.unit_m = sigma_m;
  const double ratio = sigma_m.norm() / g.unit_m.norm();
  if (ratio < 1.0 / kMuch && g.finer_since == Stamp::max()) {
    g.finer_since = stamp();
    if (g.renewed != Stamp::min() && stamp() - g.renewed < kStays) return;  // it alternates
    g.renewed = stamp();
    renew_gps_offset(sigma_m.cwiseQuotient(g.unit_m).cwiseMin(1.0), &s_.belief);
    return;
  }
  if (ratio < 1.0 / kMuch && stamp() - g.finer_since < kStays) return;
  if (ratio < 1.0 / kMuch || ratio > kMuch) {
    const Vec3 by_axis = sigma_m.cwiseQuotient(g.unit_m);
    renew_gps_offset(by_axis.cwiseMin(by_axis.cwiseInverse()), &s_.belief);
  }
  g.finer_since = Stamp::max();
  g.unit_m = sigma_m;
}

/// The height alone may be wrong (another geoid or datum): the position is then fused without it.
Reason Fuser::fuse_place(const GpsFix& fix) {
  Bookkeeping& m = s_.bookkeeping;
  const auto position = [&](const NavState& x) { return gps_position(x, fix, model_.params.gps); };
  const Residual<3> z = position(s_.belief.x);
  if (update(s_.belief, z, model_.gates[3]).reason != Reason::kGate) {
    m.heights_refused = 0;
    m.heights_undecided = false;
    m.height_accepted = stamp();
    return fuse(Source::kGpsPosition, position);
  }
  const Reason reason =
      fuse(Source::kGpsPosition, [&](const NavState& x) { return without_height(position(x)); });
  if (reason != Reason::kAccepted) return reason;
  // Without the forces of the INS the height of the filter may have drifted, and the fixes are
  // right. It cannot jump from one fix to the next, which is a fault of GPS (33 m, ADR 121), or the
  // end of one that it has followed: who was right is not known for a minute.
  constexpr int kDrifted = 15;
  constexpr double kDrift_mps = 1.0;
  constexpr Duration kPersists = from_seconds(60.0);
  m.height_off_m = std::abs(z.r.z());
  if (m.heights_refused == 0) {
    const double variance = (z.H * s_.belief.P * z.H.transpose() + z.R)(2, 2);
    const double since_s =
        m.height_accepted == Stamp::min() ? kNoGate : seconds(stamp() - m.height_accepted);
    m.heights_jumped =
        m.height_off_m > std::sqrt(model_.gates[3] * variance) + kDrift_mps * since_s;
    m.heights_since = stamp();
    m.heights_undecided = false;
  }
  m.heights_undecided = m.heights_undecided || !uses_forces(s_);
  const bool persists = !m.heights_jumped || stamp() - m.heights_since > kPersists;
  if (++m.heights_refused < kDrifted || !m.heights_undecided || !persists) return reason;
  s_.belief = loosen_world(s_.belief, Vec3(0.0, 0.0, m.height_off_m), 0.0);
  m.heights_refused = 0;
  m.heights_undecided = false;
  return reason;
}

void Fuser::operator()(const OdometrySample& z) {
  Bookkeeping& m = s_.bookkeeping;
  if (m.excluded.odometry) return;
  if (m.excluded.wheels) {
    refuse(Source::kOdometry, Reason::kQuarantine);
    constrain();
    return;
  }
  m.odometry_mps = z.speed_mps;
  m.odometry_received = stamp();
  constexpr double kUnknown_rad = 0.03;  // as after a silence; on the road 0.001 to 0.005
  const double tilt_rad = std::sqrt(s_.belief.P.diagonal().segment<2>(kAttitude).maxCoeff());
  const double unknown_rad = tilt_rad > kUnknown_rad ? tilt_rad : 0.0;
  fuse(Source::kOdometry,
       [&](const NavState& x) { return wheel_speed(x, z, model_.params.odometry, unknown_rad); });
  constrain();
}

void Fuser::operator()(const ImuSample&) { constrain(); }

/// Non-holonomic constraint: a vehicle on wheels or tracks moves along its own axis, with or
/// without odometry. It sways on its suspension, so consecutive samples are correlated.
void Fuser::constrain() {
  constexpr Duration kEvery = from_milliseconds(500.0);
  Bookkeeping& m = s_.bookkeeping;
  const OdometryParams& params = model_.params.odometry;
  if (!params.constrained || m.excluded.odometry) return;
  if (m.constrained > stamp() - kEvery) return;
  if (m.constrained < stamp() - 2 * kEvery) m.divergences = {};  // not tested in between
  m.constrained = stamp();
  const double shaking_mps2 = std::sqrt(m.stillness.variance_force);
  const auto constraint = [&](const NavState& x) { return non_holonomic(x, params, shaking_mps2); };
  const Residual<2> z = constraint(s_.belief.x);
  // A slide ends, and a body that pitches and rolls on steep ground returns: a residual that
  // persists for so many times is an error of the filter. Axis by axis: on the same ground a filter
  // that diverges sideways is rejected vertically with varying residuals.
  constexpr int kNoSlide = 4;
  constexpr double kAlike = 0.5;
  const auto alike = [](double mps, const Divergence& before) {
    return std::abs(mps - before.mps) < kAlike * std::abs(before.mps);
  };
  int axis = 0;
  for (Divergence& divergence : m.divergences) {
    const double off_mps = z.r[axis];
    if (divergence.times >= kNoSlide && alike(off_mps, divergence)) {
      const Vec3 wrong_mps = off_mps * z.H.block<1, 3>(axis, kVelocity).normalized();
      const Vec3 displaced_m = kNoSlide * seconds(kEvery) * wrong_mps;
      s_.belief.P.block<3, 3>(kVelocity, kVelocity) += wrong_mps * wrong_mps.transpose();
      s_.belief.P.block<3, 3>(kPosition, kPosition) += displaced_m * displaced_m.transpose();
      fuse(Source::kNonHolonomic, [&](const NavState& x) {
        const Residual<2> both = constraint(x);
        Residual<2> one;
        one.dof = 1;
        one.r[0] = both.r[axis];
        one.H.row(0) = both.H.row(axis);
        one.R(0, 0) = both.R(axis, axis);
        return one;
      });
      divergence = {};
      return;
    }
    ++axis;
  }
  if (fuse(Source::kNonHolonomic, constraint) == Reason::kAccepted) {
    m.divergences = {};
    return;
  }
  const Mat<2, 2> S = z.R + z.H * s_.belief.P * z.H.transpose();
  axis = 0;
  for (Divergence& divergence : m.divergences) {
    constexpr double kOff = 4.0;  // the axes are rejected together: which one is it?
    const double off_mps = z.r[axis];
    const bool off = off_mps * off_mps > kOff * S(axis, axis);
    const int before = alike(off_mps, divergence) ? divergence.times : 0;
    divergence = off ? Divergence{off_mps, before + 1} : Divergence{};
    ++axis;
  }
}

Duration age(Stamp now, Stamp accepted) {
  return accepted == Stamp::min() ? Duration(-1) : now - accepted;
}

bool fresh(Duration a, Duration timeout) { return a.count() >= 0 && a <= timeout; }

}  // namespace

void apply(const Model& model, const Measurement& measurement, FilterState* state,
           Innovations* records) {
  std::visit(Fuser(model, state, records), measurement.value);
}

Ages ages(const FilterState& s) {
  const Stamp now = s.belief.x.stamp;
  const Bookkeeping& m = s.bookkeeping;
  return {age(now, m.ins_stamp), age(now, m.of(Source::kGpsPosition).accepted),
          age(now, m.of(Source::kOdometry).accepted), age(now, m.of(Source::kRolling).accepted),
          age(now, m.of(Source::kPriorMap).accepted)};
}

double distance_since_gps_m(const FilterState& s) {
  return s.bookkeeping.distance_m - s.bookkeeping.of(Source::kGpsPosition).distance_m;
}

Mode mode(const FilterState& s, const WmParams& params) {
  const Ages a = ages(s);
  const bool ins = fresh(a.ins, params.history.ins_timeout);
  const bool gps = s.bookkeeping.georeferenced && fresh(a.gps, params.modes.gps_timeout);
  const bool ladar = fresh(a.rolling, params.modes.rolling_timeout);
  if (ins && gps) return ladar ? Mode::kGpsInsLadar : Mode::kGpsIns;
  if (ins) return ladar ? Mode::kInsLadar : Mode::kInsDeadReckoning;
  if (gps) return Mode::kGpsLadar;
  return ladar ? Mode::kLadar : Mode::kLost;
}

}  // namespace rcs::wm
