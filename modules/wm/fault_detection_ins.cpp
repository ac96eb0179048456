// The INS against the LADAR, GPS and the wheels. The inertial sub-filter predicts every measurement
// from the INS alone; the sub-filter without INS predicts it from all other sources.
#include <algorithm>
#include <cmath>
#include <functional>

#include "modules/wm/fault_detection.h"
#include "modules/wm/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr double kFloor_rad = 2e-3;     // errors of a scan's rotation that are not modelled
constexpr double kFloor_m = 0.1;        // the same of its translation
constexpr double kMaxWeight = 4.0;      // of a ratio, in the time that a test must last
constexpr double kLongestStep_s = 0.3;  // a single measurement is not enough
constexpr int kMatches = 10;            // that are averaged
constexpr double kVoteShare = 0.1;      // of the newest vote of the wheels in the low-passed one
constexpr double kMajority = 0.5;       // of the low-passed votes, from -1 to 1
// A measurement votes if the two hypotheses differ by more, in its standard deviations.
constexpr double kDistinct = 3.0;
// Ratio beyond which INS and LADAR contradict each other by a fault if nothing else shows whose.
constexpr double kUndecided = 6.0;
constexpr double kPoor = 2.0;  // factor of the errors of a LADAR that decides nothing
// The INS turns smoothly: if one scan causes more of the contradiction, the LADAR is faulty.
constexpr double kOneScan = 0.5;
constexpr Duration kGpsAgrees = from_seconds(5.0);    // age of a fix that confirms GPS
constexpr Duration kExcludedFor = from_seconds(1.0);  // before a readmission is considered
constexpr Duration kLongestWait = from_seconds(300.0);
constexpr Duration kRelapse = from_seconds(60.0);  // after a readmission
constexpr int kAgreeing = 10;                      // measurements that readmit the INS, at least
constexpr int kShareAgreeing = 9;                  // accepted ones for each rejected one
// Sigma of the biases of a readmitted INS.
constexpr double kOpenGyro_radps = 0.02;
constexpr double kOpenAccel_mps2 = 0.3;

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

void Trust::InertialTest::add(double ratio_now, Stamp now) {
  const Duration since = tested == Stamp::min() ? Duration::zero() : now - tested;
  const double dt_s = std::min(seconds(since), kLongestStep_s);
  evidence_s = ratio_now > 1.0 ? evidence_s + dt_s * std::min(ratio_now, kMaxWeight) : 0.0;
  ratio = ratio_now;
  tested = now;
}

bool Trust::InertialTest::lasts(Stamp now, Duration time) const {
  return ratio > 1.0 && now - tested < kFresh && evidence_s >= seconds(time);
}

/// The pose of a scan in the rolling map, of which rotation and translation are tested on their
/// own: the sum of the two tests would hide a small rotation behind an uncertain position.
double Trust::test_by_match(const Model& model, const RollingMatch& as_registered,
                            Inertial* inertial) const {
  const RollingMatch z =
      scaled(as_registered, model.ladar_scales.at(inertial->subfilter.state.belief.x.stamp));
  const FilterState& s = inertial->subfilter.state;
  if (!inertial->subfilter.alive() || z.map_epoch != s.belief.x.map_epoch) {
    inertial->matches = 0;
    return 0.0;
  }
  // In the axes of the vehicle, not along the directions that this scan observes: those differ from
  // scan to scan. An unobserved direction has a large sigma.
  Residual<6> r;
  r.r = log_se3(T_rolling_vehicle(s.belief.x).inverse() * z.T_rolling_vehicle);
  r.H = rolling_pose_jacobian(s.belief.x);  // of a small residual
  int unobserved = 0;
  r.R = registration_covariance(s.belief.x, z.information, model.params.rolling.match, &unobserved);
  const double share = std::max(1.0 / ++inertial->matches, 1.0 / kMatches);
  inertial->residual += share * (r.r - inertial->residual);
  if (inertial->matches < kMatches / 2) return 0.0;
  r.r = inertial->residual;
  r.R *= share;
  const double driven_m = s.memory.distance_m - inertial->began_m;
  const double translation =
      nis_of<3>(r, s.belief.P, 0, std::hypot(kFloor_m, params_.floor_share * driven_m));
  const double rotation = nis_of<3>(r, s.belief.P, 3, kFloor_rad);
  inertial->in_rotation = rotation > translation;
  return std::max(translation, rotation) / limit_3_;
}

void Trust::test_ins_by_ladar(const Model& model, const RollingMatch& z) {
  if (z.seeded) {
    scan_ = {};
    ins_by_ladar_ = {};
    for (Inertial* inertial : {&inertial_new_, &inertial_young_, &inertial_}) inertial->matches = 0;
    return;
  }
  double ratio = 0.0;
  for (Inertial* inertial : {&inertial_new_, &inertial_young_, &inertial_}) {
    ratio = std::max(ratio, test_by_match(model, z, inertial));
  }
  const NavState& x = inertial_.subfilter.state.belief.x;
  ins_by_ladar_.add(ratio, x.stamp);

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

/// Tests the inertial motion by scans and fixes, and collects the votes of the other sources.
void Trust::test_ins(const Model& model, const Measurement& m, const FilterState& belief) {
  for (InertialTest* test : {&ins_by_ladar_, &ins_by_gps_}) {
    // The source has fallen silent: its last result must not last for ever.
    if (test->tested != Stamp::min() && m.stamp - test->tested > kFresh) *test = {};
  }
  if (!inertial_.subfilter.alive() || !without_ins_.alive()) return;
  if (m.stamp - inertial_.subfilter.branch < kYoung) return;
  const NavState& ins = inertial_.subfilter.state.belief.x;
  const NavState& others = without_ins_.state.belief.x;
  if (const auto* z = std::get_if<RollingMatch>(&m.value)) {
    int unobserved = 0;
    votes_.add(
        ins.stamp, *z,
        registration_covariance(ins, z->information, model.params.rolling.match, &unobserved),
        model.params.drive, ins.T_world_vehicle, inertial_.subfilter.branch);
    if (belief.memory.withheld.ladar) {
      ins_by_ladar_ = {};
    } else {
      test_ins_by_ladar(model, *z);
    }
  }
  if (const auto* z = std::get_if<GpsFix>(&m.value)) {
    const double driven_m = inertial_.subfilter.state.memory.distance_m - without_gps_began_m_;
    const Nis n =
        nis(inertial_.subfilter.state, *z, model.params.gps, params_.floor_share * driven_m);
    const bool accepted = without_ins_.state.memory.of(Source::kGpsPosition).accepted == m.stamp;
    ins_by_gps_.add(accepted ? n.horizontal / limit_2_ : 0.0, m.stamp);
    if (accepted) {
      votes_.add(m.stamp, *z, (ins.T_world_vehicle.q.conjugate() * ins.v_world).x() < 0.0);
    }
  }
  if (const auto* z = std::get_if<OdometrySample>(&m.value)) {
    const OdometryParams& params = model.params.odometry;
    const auto slip = [&](Residual<2> r) {
      const double sigma_mps = params.slip * std::abs(z->speed_mps);
      r.R(0, 0) += sigma_mps * sigma_mps;
      r.r[1] = 0.0;  // the yaw rate is compared by the LADAR
      return r;
    };
    const auto lateral = [&](Residual<2> r) {
      const double sigma_mps = params.side_slip * z->speed_mps;
      r.R.diagonal().array() += sigma_mps * sigma_mps;
      return r;
    };
    const double shaking_mps2 =
        std::sqrt(inertial_.subfilter.state.memory.stillness.variance_force);
    double vote =
        compare(slip(wheel_speed(ins, *z, params)), slip(wheel_speed(others, *z, params)));
    if (vote == 0.0 && params.constrained) {
      vote = compare(lateral(non_holonomic(ins, params, shaking_mps2)),
                     lateral(non_holonomic(others, params, shaking_mps2)));
    }
    wheels_vote_ += kVoteShare * (vote - wheels_vote_);
    votes_.add(m.stamp, *z, ins.wheel_scale);
  }
}

/// The end of a fault is a second fault for an INS that was readmitted with its biases.
bool Trust::readmitted_lately(Stamp now) const {
  return ins_probation_ != Stamp::min() && now - ins_probation_ < kRelapse;
}

/// Between INS and LADAR, which contradict each other: the reference that distinguishes them
/// decides. If none does, only a large contradiction is a fault: registrations in high grass or on
/// steep slopes have errors that their covariances do not contain. One that begins with a single
/// scan is a fault of the LADAR or its mount, another one of the INS.
Trust::Faulty Trust::ins_or_ladar() const {
  const double verdict = votes_.verdict();
  if (std::abs(verdict) > kMajority) return verdict > 0.0 ? Faulty::kIns : Faulty::kLadar;
  if (readmitted_lately(ins_by_ladar_.tested)) return Faulty::kIns;
  const LadarScale scale = ladar_scale();
  const bool poor = std::max(scale.position, scale.rotation) > kPoor;
  if (poor || ins_by_ladar_.ratio < kUndecided) return Faulty::kUnknown;
  std::array<double, 32> apart_rad = scan_.apart_rad;
  std::partial_sort(apart_rad.begin(), apart_rad.begin() + 2, apart_rad.end(), std::greater<>());
  const bool sudden = apart_rad[1] < kOneScan * apart_rad[0];
  const auto by_one_scan = [&](const Inertial& i) {
    return sudden && i.in_rotation && apart_rad[0] > kOneScan * i.residual.tail<3>().norm();
  };
  const bool ladar =
      by_one_scan(inertial_) || by_one_scan(inertial_young_) || by_one_scan(inertial_new_);
  return ladar ? Faulty::kLadar : Faulty::kIns;
}

std::optional<FilterState> Trust::decide_ins(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  if (!without_ins_.alive() || now - without_ins_.branch < kYoung) return std::nullopt;
  if (ins_by_ladar_.lasts(now, params_.ladar_refuted)) {
    const Faulty faulty = ins_or_ladar();
    if (faulty == Faulty::kIns) return exclude_ins(belief, modes);
    const bool known = without_ladar_.alive() && now - without_ladar_.branch >= kYoung;
    if (faulty == Faulty::kLadar && known && !belief.memory.withheld.ladar) {
      return exclude_ladar(belief, modes);
    }
  }
  // Without LADAR only the wheels can decide between INS and GPS.
  const bool by_gps = ins_by_gps_.lasts(now, params_.ladar_refuted) && wheels_vote_ > kMajority;
  if (!by_gps) return std::nullopt;
  return exclude_ins(belief, modes);
}

/// The filter continues from the one that has not used the INS since its branch.
FilterState Trust::exclude_ins(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  FilterState next = without_ins_.state;
  next.memory.withheld = belief.memory.withheld;
  // GPS was excluded for contradicting a filter that the INS had caused to diverge.
  const Stamp fix = next.memory.of(Source::kGpsPosition).accepted;
  if (belief.memory.gps_accused && fix > now - kGpsAgrees) {
    next.memory.withheld.gps = next.memory.gps_accused = false;
    next.memory.of(Source::kGpsPosition).refused = 0;
  }
  const bool relapse = readmitted_lately(now);
  ins_wait_ = relapse ? std::min<Duration>(2 * ins_wait_, kLongestWait) : kInsAgrees;
  ins_excluded_ = now;
  next.memory.withheld.ins = true;
  return found(Finding::kInsFaulty, next, belief, modes);
}

void Trust::open_biases(Stamp now, FilterState* s) {
  s->memory.withheld.ins = false;
  s->memory.ins_stamp = now;
  s->belief.P.diagonal().segment<3>(kGyroBias).array() += kOpenGyro_radps * kOpenGyro_radps;
  s->belief.P.diagonal().segment<3>(kAccelBias).array() += kOpenAccel_mps2 * kOpenAccel_mps2;
}

/// The hypothesis that the INS is right again, with biases that are not known.
std::optional<FilterState> Trust::decide_excluded_ins(const Measurement& m,
                                                      const FilterState& belief,
                                                      const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  if (ins_excluded_ == Stamp::min()) ins_excluded_ = now;  // the filter has been restarted since
  if (!ins_right_.alive()) {
    if (m.imu() == nullptr || now - ins_excluded_ < kExcludedFor) return std::nullopt;
    ins_right_ = {belief, now, belief.memory.distance_m};
    open_biases(now, &ins_right_.state);
    return std::nullopt;
  }
  const bool long_enough = now - ins_right_.began >= ins_wait_ && ins_right_.agreed >= kAgreeing &&
                           ins_right_.agreed >= kShareAgreeing * ins_right_.refused &&
                           ins_right_.refused_in_row == 0;
  if (!long_enough || !ins_right_.state.belief.x.inertial) return std::nullopt;
  if (difference(belief, ins_right_.state, params_.floor_m) > limit_2_) {
    ins_right_ = {};
    return std::nullopt;
  }
  ins_probation_ = now + params_.probation;
  return found(Finding::kInsReadmitted, ins_right_.state, belief, modes);
}

double Trust::ins_test_ratio() const {
  const bool decided = votes_.verdict() > kMajority;
  return std::max(ins_by_ladar_.ratio / (decided ? 1.0 : kUndecided), ins_by_gps_.ratio);
}

double Trust::ins_alternative_m(const FilterState& belief) const {
  if (!without_ins_.alive() || !(ins_test_ratio() > 1.0)) return 0.0;
  const NavState& others = without_ins_.state.belief.x;
  return (others.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p).head<2>().norm();
}

}  // namespace rcs::wm
