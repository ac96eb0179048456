// The INS against the LADAR, GPS and the wheels. The inertial sub-filter predicts every measurement
// from the INS alone; the sub-filter without INS predicts it from all other sources.
#include <algorithm>
#include <cmath>
#include <functional>

#include "modules/wm/fault_detection/fault_detection.h"
#include "modules/wm/fault_detection/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr double kFloor_rad = 2e-3;     // errors of a scan's rotation that are not modelled
constexpr double kFloor_m = 0.1;        // the same of its translation
constexpr double kFloor_mps = 0.1;      // and of the velocity of a fix
constexpr double kMaxWeight = 4.0;      // of a ratio, in the time that a test must last
constexpr double kLongestStep_s = 0.3;  // a single measurement is not enough
constexpr double kVoteShare = 0.1;      // of the newest vote of the wheels in the low-passed one
constexpr double kFixShare = 0.15;      // of the newest fix in the low-passed velocities
constexpr double kNearer = 0.5;         // to the fixes than the other one: they support it
// A measurement votes if the two hypotheses differ by more, in its standard deviations.
constexpr double kDistinct = 3.0;
// Ratio beyond which INS and LADAR contradict each other by a fault if nothing else shows whose.
constexpr double kUndecided = 6.0;
constexpr double kUndecidedPoor = 20.0;  // where the LADAR has been poor: no fault but an alert
constexpr double kPoorFor_m = 500.0;     // distance over which a LADAR that was poor is suspected
constexpr double kAgrees = 0.6;          // ratio of fixes that the INS predicts
constexpr Duration kPredicted = from_seconds(5.0);  // age of an inertial motion that fixes confirm
constexpr Duration kVisible = from_seconds(10.0);   // weighted time after which fixes would show it
constexpr double kPoor = 2.0;  // factor of the errors of a LADAR that decides nothing
// The INS turns smoothly: if one scan causes more of the contradiction, the LADAR is faulty.
constexpr double kOneScan = 0.5;

/// Normalized innovation squared of a part of a residual.
template <int N, int M>
double nis_of(const Residual<M>& z, const Cov& P, int first, double floor) {
  const Mat<N, kSize> H = z.H.template middleRows<N>(first);
  Mat<N, N> S = H * P * H.transpose() + z.R.template block<N, N>(first, first);
  S.diagonal().array() += floor * floor;
  const Vec<N> r = z.r.template segment<N>(first);
  return r.dot(S.llt().solve(r));
}

/// Residuals of one measurement in two filters.
/// @return 1 if it supports the motion without INS, -1 if it supports the INS, 0 if its noise hides
///   the difference
template <int M>
double compare(const Residual<M>& by_ins, const Residual<M>& without_ins) {
  const Eigen::LLT<Mat<M, M>> noise(by_ins.R);
  const Vec<M> apart = by_ins.r - without_ins.r;
  if (apart.dot(noise.solve(apart)) < kDistinct * kDistinct) return 0.0;
  const double ins = by_ins.r.dot(noise.solve(by_ins.r));
  const double others = without_ins.r.dot(noise.solve(without_ins.r));
  return others < ins ? 1.0 : -1.0;
}

}  // namespace

void FaultDetection::InertialTest::add(double ratio_now, Stamp now) {
  const Duration since = tested == Stamp::min() ? Duration::zero() : now - tested;
  const double dt_s = std::min(seconds(since), kLongestStep_s);
  evidence_s = ratio_now > 1.0 ? evidence_s + dt_s * std::min(ratio_now, kMaxWeight) : 0.0;
  ratio = ratio_now;
  tested = now;
}

bool FaultDetection::InertialTest::lasts(Stamp now, Duration time) const {
  return ratio > 1.0 && now - tested < kFresh && evidence_s >= seconds(time);
}

/// The pose of a scan in the rolling map, of which rotation and translation are tested on their
/// own: the sum of the two tests would hide a small rotation behind an uncertain position.
std::optional<double> FaultDetection::test_by_match(const Model& model,
                                                    const RollingMatch& as_registered,
                                                    Inertial* inertial) const {
  const RollingMatch z =
      scaled(as_registered, model.ladar_scales.at(inertial->subfilter.state.belief.x.stamp));
  const FilterState& s = inertial->subfilter.state;
  if (!inertial->subfilter.alive() || z.map_epoch != s.belief.x.map_epoch) {
    inertial->matches = {};
    return std::nullopt;
  }
  // Averaged in the axes of the map; tested in those of the vehicle, not along the directions that
  // this scan observes: those differ from scan to scan. An unobserved direction has a large sigma.
  Residual<6> r;
  r.H = rolling_pose_jacobian(s.belief.x);  // of a small residual
  int unobserved = 0;
  const Quat& q = z.T_rolling_vehicle.q;
  inertial->matches.add(
      q, log_se3(T_rolling_vehicle(s.belief.x).inverse() * z.T_rolling_vehicle),
      registration_covariance(s.belief.x, z.information, model.params.rolling.match, &unobserved));
  if (inertial->matches.count() < MatchMean::kMatches / 2) return std::nullopt;
  r.R = inertial->matches.covariance(q);
  r.r = inertial->matches.mean(q);
  inertial->residual = r.r;
  const double driven_m = s.bookkeeping.distance_m - inertial->began_m;
  const double translation =
      nis_of<3>(r, s.belief.P, 0, std::hypot(kFloor_m, params_.floor_share * driven_m));
  const double rotation = nis_of<3>(r, s.belief.P, 3, kFloor_rad);
  inertial->in_rotation = rotation > translation;
  inertial->rotation = rotation / limit_3_;
  return std::max(translation, rotation) / limit_3_;
}

void FaultDetection::test_ins_by_ladar(const Model& model, const RollingMatch& z) {
  if (z.seeded) {  // the result of the old map stays for a moment: its loss may be due to the INS
    scan_ = {};
    for (Inertial* i : {&inertial_new_, &inertial_young_, &inertial_}) i->matches = {};
    return;
  }
  std::optional<double> ratio;
  for (Inertial* inertial : {&inertial_new_, &inertial_young_, &inertial_}) {
    const std::optional<double> one = test_by_match(model, z, inertial);
    if (one) ratio = std::max(ratio.value_or(0.0), *one);
  }
  const NavState& x = inertial_.subfilter.state.belief.x;
  if (ratio) ins_by_ladar_.add(*ratio, x.stamp);

  const Quat by_ins = T_rolling_vehicle(x).q;
  if (scan_.map_epoch == z.map_epoch) {
    const Quat ladar = scan_.by_ladar.conjugate() * z.T_rolling_vehicle.q;
    const Quat ins = scan_.by_ins.conjugate() * by_ins;
    scan_.apart_rad[scan_.scans++ % scan_.apart_rad.size()] =
        log_so3(ins.conjugate() * ladar).norm();
  }
  scan_.by_ladar = z.T_rolling_vehicle.q;
  scan_.by_ins = by_ins;
  scan_.map_epoch = z.map_epoch;
}

void FaultDetection::test_ins_by_fix(const Model& model, const GpsFix& z, const FilterState& belief,
                                     Stamp stamp) {
  const FilterState& s = inertial_.subfilter.state;
  // A fix that both reject tests nothing. If only the filter with the INS accepts it, the other one
  // has diverged by the LADAR.
  const auto accepts = [stamp](const FilterState& f) {
    return f.bookkeeping.of(Source::kGpsPosition).accepted == stamp;
  };
  if (!accepts(without_ins_.state) && !accepts(belief)) return;
  const double driven_m = s.bookkeeping.distance_m - without_gps_began_m_;
  const Nis n = nis(s, z, model.params.gps, params_.floor_share * driven_m);
  double ratio = n.horizontal / limit_2_;
  const Bookkeeping& by =
      accepts(without_ins_.state) ? without_ins_.state.bookkeeping : belief.bookkeeping;
  if (by.heights_refused == 0) {
    ratio = std::max(ratio, n.vertical / limit_1_);
  }
  if (z.has_velocity) {
    const Residual<3> velocity = gps_velocity(s.belief.x, z, model.params.gps, accel_world(s));
    ratio = std::max(ratio, nis_of<3>(velocity, s.belief.P, 0, kFloor_mps) / limit_3_);
  }
  ins_by_gps_.add(ratio, stamp);
  vote_by_fix(model, z);
  const bool predicts = ratio < kAgrees && stamp - inertial_.subfilter.branch > kPredicted;
  // A fault of the INS that has just begun is not visible in the fixes yet.
  const Duration visible = fix_vote_ < 0.0 ? params_.ladar_refuted : kVisible;
  if (predicts && ins_by_ladar_.ratio > kContradicts && ins_by_ladar_.lasts(stamp, visible)) {
    ladar_poor_m_ = s.bookkeeping.distance_m;
  }
  const NavState& x = s.belief.x;
  votes_.add(stamp, z, (x.T_world_vehicle.q.conjugate() * x.v_world).x() < 0.0);
}

/// Between INS and LADAR: which of the motions by one of them, both without GPS, the fix supports.
void FaultDetection::vote_by_fix(const Model& model, const GpsFix& z) {
  fix_vote_ = 0.0;
  if (!neither_.alive() || !z.has_velocity) return;
  const auto residual = [&](const FilterState& s) {
    return gps_velocity(s.belief.x, z, model.params.gps, accel_world(s));
  };
  const Residual<3> ins = residual(inertial_.subfilter.state);
  const Residual<3> ladar = residual(neither_.state);
  off_by_ins_mps_ += kFixShare * (ins.r.head<2>() - off_by_ins_mps_);
  off_by_ladar_mps_ += kFixShare * (ladar.r.head<2>() - off_by_ladar_mps_);
  const double noise = 0.5 * kFixShare * ins.R.diagonal().head<2>().maxCoeff();
  const auto beyond = [&](double off_mps, const FilterState& s) {
    const double own = s.belief.P.diagonal().segment<2>(kVelocity).maxCoeff();
    return off_mps > kDistinct * std::sqrt(noise + own + kFloor_mps * kFloor_mps);
  };
  const double by_ins = off_by_ins_mps_.norm();
  const double by_ladar = off_by_ladar_mps_.norm();
  // A wrong heading is common to both: it does not count.
  if (by_ladar < kNearer * by_ins && beyond(by_ins, inertial_.subfilter.state)) fix_vote_ = 1.0;
  if (by_ins < kNearer * by_ladar && beyond(by_ladar, neither_.state)) fix_vote_ = -1.0;
}

/// Between INS and GPS, if there is no LADAR.
void FaultDetection::vote_by_wheels(const OdometryParams& params, const OdometrySample& z,
                                    bool excluded) {
  const NavState& ins = inertial_.subfilter.state.belief.x;
  const NavState& others = without_ins_.state.belief.x;
  const auto slip = [&](Residual<2> r) {
    const double sigma_mps = params.slip * std::abs(z.speed_mps);
    r.R(0, 0) += sigma_mps * sigma_mps;
    r.r[1] = 0.0;  // the yaw rate is compared by the LADAR
    return r;
  };
  const auto lateral = [&](Residual<2> r) {
    const double sigma_mps = params.side_slip * z.speed_mps;
    r.R.diagonal().array() += sigma_mps * sigma_mps;
    return r;
  };
  const double shaking_mps2 =
      std::sqrt(inertial_.subfilter.state.bookkeeping.stillness.variance_force);
  double vote = 0.0;
  if (!excluded) {
    vote = compare(slip(wheel_speed(ins, z, params)), slip(wheel_speed(others, z, params)));
  }
  if (vote == 0.0 && params.constrained) {
    vote = compare(lateral(non_holonomic(ins, params, shaking_mps2)),
                   lateral(non_holonomic(others, params, shaking_mps2)));
  }
  wheels_vote_ += kVoteShare * (vote - wheels_vote_);
}

/// Tests the inertial motion by scans and fixes, and collects the votes of the other sources.
void FaultDetection::test_ins(const Model& model, const Measurement& m, const FilterState& belief) {
  votes_.expire(m.stamp, !belief.bookkeeping.excluded.ins);
  for (InertialTest* test : {&ins_by_ladar_, &ins_by_gps_, &ins_by_constraint_, &ins_rises_}) {
    // The source has fallen silent: its last result must not last for ever.
    if (test->tested != Stamp::min() && m.stamp - test->tested > kFresh) *test = {};
  }
  if (std::holds_alternative<GpsFix>(m.value) || ins_by_gps_.tested == Stamp::min()) {
    fix_vote_ = 0.0;  // it is of the newest fix
  }
  if (std::max({ins_by_ladar_.ratio, ins_by_gps_.ratio, ins_by_constraint_.ratio}) < kQuiet) {
    ins_quiet_ = m.stamp;
  }
  follow_courses(model, m);
  if (belief.bookkeeping.excluded.any_of_ins()) follow_rotation(m, belief);
  if (!inertial_.subfilter.alive() || !without_ins_.alive()) return;
  if (m.stamp - inertial_.subfilter.branch < kYoung) return;
  const NavState& ins = inertial_.subfilter.state.belief.x;
  const OdometryParams& odometry = model.params.odometry;
  if (m.imu() == nullptr) test_ins_by_constraint(odometry, m.stamp);
  if (const auto* z = std::get_if<RollingMatch>(&m.value)) {
    int unobserved = 0;
    const Mat6 covariance =
        registration_covariance(ins, z->information, model.params.rolling.match, &unobserved);
    const Cov& P = inertial_.subfilter.state.belief.P;
    const double sigma_mps = std::sqrt(P.diagonal().segment<3>(kVelocity).maxCoeff());
    votes_.add(ins.stamp, *z, covariance, model.params.drive,
               {ins.T_world_vehicle, inertial_.subfilter.branch, sigma_mps}, odometry.constrained);
    if (belief.bookkeeping.excluded.ladar) {
      ins_by_ladar_ = {};
    } else {
      test_ins_by_ladar(model, *z);
    }
  } else if (const auto* fix = std::get_if<GpsFix>(&m.value)) {
    votes_.add_course(m.stamp, *fix);
    test_ins_by_fix(model, *fix, belief, m.stamp);
  } else if (const auto* wheels = std::get_if<OdometrySample>(&m.value)) {
    vote_by_wheels(odometry, *wheels, belief.bookkeeping.excluded.wheels);
    const auto accepted = [&](const FilterState& s) {
      return s.bookkeeping.of(Source::kOdometry).accepted == m.stamp;
    };
    votes_.add(m.stamp, *wheels, ins.wheel_scale, accepted(belief) || accepted(without_ins_.state));
  }
}

/// In high grass and on steep slopes registrations have errors that their covariances do not
/// contain: known where GPS has shown that the INS was right.
bool FaultDetection::ladar_is_poor() const {
  const LadarScale scale = ladar_scale();
  const double since_m = inertial_.subfilter.state.bookkeeping.distance_m - ladar_poor_m_;
  return since_m < kPoorFor_m || std::max(scale.position, scale.rotation) > kPoor;
}

/// Whether a single scan causes the contradiction: the INS turns smoothly.
bool FaultDetection::by_one_scan() const {
  std::array<double, 32> apart_rad = scan_.apart_rad;
  std::partial_sort(apart_rad.begin(), apart_rad.begin() + 2, apart_rad.end(), std::greater<>());
  if (apart_rad[1] >= kOneScan * apart_rad[0]) return false;
  const auto explains = [&](const Inertial& i) {
    return i.in_rotation && apart_rad[0] > kOneScan * i.residual.tail<3>().norm();
  };
  return explains(inertial_) || explains(inertial_young_) || explains(inertial_new_);
}

/// Between INS and LADAR, which contradict each other: the references that distinguish them decide,
/// then the fixes that the INS predicts or not. Without fixes only a large contradiction is a
/// fault, and none where the LADAR is poor.
FaultDetection::Faulty FaultDetection::ins_or_ladar(Stamp now) const {
  const bool fixes = ins_by_gps_.tested != Stamp::min() && now - ins_by_gps_.tested < kFresh;
  if (violates_constraint(kSuspectAcross) || votes_.gyro_axes_wrong()) return Faulty::kIns;
  for (const double vote : {votes_.verdict(), fixes ? fix_vote_ : 0.0}) {
    if (std::abs(vote) > kMajority) return vote > 0.0 ? Faulty::kIns : Faulty::kLadar;
  }
  if (!fixes && votes_.long_turns() > kMajority) return Faulty::kIns;
  // The end of a fault is another fault of an INS that was readmitted with the biases of the first.
  const bool relapse = monitors_.ins.recently_readmitted(now);
  if (!relapse && monitors_.ladar.recently_readmitted(now)) return Faulty::kLadar;
  const bool poor = ladar_is_poor();
  const bool jump = !poor && ins_by_ladar_.ratio > kUndecided && by_one_scan();
  if (fixes) {
    if (jump) return Faulty::kLadar;
    const bool both = relapse || (!poor && ins_by_ladar_.ratio > kContradicts);
    return both && ins_by_gps_.ratio > 1.0 ? Faulty::kIns : Faulty::kUnknown;
  }
  if (relapse) return Faulty::kIns;
  if (poor || ins_by_ladar_.ratio < kUndecided) return Faulty::kUnknown;
  return jump ? Faulty::kLadar : Faulty::kIns;
}

/// Wheels and LADAR, which are independent of each other, both contradict the filter and agree with
/// the one without INS: no third source is needed. A few samples of each are enough, because after
/// them the registrations, which the INS predicts, follow it.
bool FaultDetection::only_ins_is_accepted(const FilterState& belief) const {
  constexpr int kSamples = 10;
  // None of an INS that was readmitted with the biases of a fault that may have ended since.
  const int matches = monitors_.ins.on_probation(belief.belief.x.stamp) ? 0 : 3;
  const Stamp now = belief.belief.x.stamp;
  const Bookkeeping& without_ins = without_ins_.state.bookkeeping;
  const auto contradicts = [&](Source source, int refused) {
    const SourceRecord& record = without_ins.of(source);
    return belief.bookkeeping.of(source).refused >= refused && record.refused == 0 &&
           record.accepted > now - kFresh;
  };
  const bool fixes = belief.bookkeeping.of(Source::kGpsPosition).accepted > now - kFresh;
  return !fixes && contradicts(Source::kOdometry, kSamples) &&
         contradicts(Source::kRolling, matches);
}

std::optional<FilterState> FaultDetection::decide_ins(const FilterState& belief,
                                                      const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  if (!without_ins_.alive() || now - without_ins_.branch < kYoung) return std::nullopt;
  if (only_ins_is_accepted(belief)) return exclude_ins(belief, modes);
  if (ins_by_ladar_.lasts(now, params_.ladar_refuted)) {
    const Faulty faulty = ins_or_ladar(now);
    if (faulty == Faulty::kIns) return exclude_ins(belief, modes);
    const bool known = without_ladar_.alive() && now - without_ladar_.branch >= kYoung;
    if (faulty == Faulty::kLadar && known && !belief.bookkeeping.excluded.ladar) {
      return exclude_ladar(belief, modes);
    }
  }
  if (ins_by_constraint_.lasts(now, params_.ladar_refuted) && violates_constraint(1.0)) {
    return exclude_ins(belief, modes);
  }
  // Without LADAR only the wheels can decide between INS and GPS.
  const bool by_gps = ins_by_gps_.lasts(now, params_.ladar_refuted) && wheels_vote_ > kMajority;
  if (!by_gps) return std::nullopt;
  return exclude_ins(belief, modes);
}

/// The scans confirm the rotation by the INS: its forces are wrong. While fixes are received they
/// bound the error without a gyro: only a rotation that is clearly right is used, and none soon
/// after a readmission, when a fault has had no time to show.
bool FaultDetection::gyro_is_right(Stamp now) const {
  constexpr double kConfirmed = 0.5;
  constexpr double kClearlyConfirmed = 0.15;
  const bool fixes = ins_by_gps_.tested != Stamp::min() && now - ins_by_gps_.tested < kFresh;
  if (fixes && monitors_.ins.recently_readmitted(now)) return false;
  const double limit = fixes ? kClearlyConfirmed : kConfirmed;
  const auto contradicts = [limit](const Inertial& i) {
    return i.subfilter.alive() && i.matches.count() >= MatchMean::kMatches && i.rotation > limit;
  };
  return inertial_.matches.count() >= MatchMean::kMatches && !contradicts(inertial_) &&
         !contradicts(inertial_young_) && !contradicts(inertial_new_) &&
         !votes_.gyro_axes_wrong() && !votes_.gyro_unconfirmed() &&
         std::max({votes_.long_turns(), votes_.course_turns(), votes_.unconfirmed_turns()}) <
             kMajority;
}

double FaultDetection::ins_test_ratio() const {
  if (std::max(votes_.verdict(), fix_vote_) > kMajority) return ins_by_ladar_.ratio;
  return ins_by_ladar_.ratio / (ladar_is_poor() ? kUndecidedPoor : kUndecided);
}

}  // namespace rcs::wm
