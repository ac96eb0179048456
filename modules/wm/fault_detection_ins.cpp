// The INS against the LADAR, GPS and the wheels. The inertial sub-filter predicts every measurement
// from the INS alone; the sub-filter without INS predicts it from all other sources.
#include <algorithm>
#include <cmath>

#include "modules/wm/fault_detection.h"
#include "modules/wm/filter_difference.h"

namespace rcs::wm {
namespace {

constexpr double kFloor_rad = 2e-3;     // errors of a scan's rotation that are not modelled
constexpr double kFloor_m = 0.1;        // the same of its translation
constexpr double kMaxWeight = 4.0;      // of a ratio, in the time that a test must last
constexpr double kLongestStep_s = 0.3;  // a single measurement is not enough
constexpr int kMatches = 10;            // that are averaged
constexpr double kVoteTime_s = 1.0;     // time constant of the votes
constexpr double kMajority = 0.5;       // of the low-passed votes, from -1 to 1
// A measurement votes if the two hypotheses differ by more, in its standard deviations.
constexpr double kDistinct = 3.0;
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
double Trust::test_by_match(const Model& model, const RollingMatch& z, Inertial* inertial) const {
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

/// GPS and the wheels compare the inertial motion with the motion without INS. Both sources are
/// part of the latter, so a vote counts only while another test contradicts the INS.
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
    if (belief.memory.withheld.ladar) {
      ins_by_ladar_ = {};
    } else {
      test_ins_by_ladar(model, *z);
    }
  }
  const auto low_pass = [this](int source, double vote, double dt_s) {
    votes_[source] += std::min(1.0, dt_s / kVoteTime_s) * (vote - votes_[source]);
  };
  if (const auto* z = std::get_if<GpsFix>(&m.value)) {
    const double driven_m = inertial_.subfilter.state.memory.distance_m - without_gps_began_m_;
    const Nis n =
        nis(inertial_.subfilter.state, *z, model.params.gps, params_.floor_share * driven_m);
    const bool accepted = without_ins_.state.memory.of(Source::kGpsPosition).accepted == m.stamp;
    ins_by_gps_.add(accepted ? n.horizontal / limit_2_ : 0.0, m.stamp);
    double vote = compare(gps_position(ins, *z, model.params.gps),
                          gps_position(others, *z, model.params.gps));
    if (vote == 0.0 && z->has_velocity) {
      vote =
          compare(gps_velocity(ins, *z, model.params.gps, accel_world(inertial_.subfilter.state)),
                  gps_velocity(others, *z, model.params.gps, accel_world(without_ins_.state)));
    }
    low_pass(0, vote, 0.3);
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
    low_pass(1, vote, 0.1);
  }
}

/// Between INS and LADAR, which contradict each other: the source that distinguishes them decides.
/// If none does, a rotation that begins with a single scan is one of the LADAR or its mount, and
/// everything else is a fault of the INS.
bool Trust::ins_is_faulty() const {
  const double vote = std::abs(votes_[0]) > std::abs(votes_[1]) ? votes_[0] : votes_[1];
  if (std::abs(vote) > kMajority) return vote > 0.0;
  const double largest_rad = *std::max_element(scan_.apart_rad.begin(), scan_.apart_rad.end());
  const auto by_one_scan = [largest_rad](const Inertial& i) {
    return i.in_rotation && largest_rad > kOneScan * i.residual.tail<3>().norm();
  };
  return !by_one_scan(inertial_) && !by_one_scan(inertial_young_) && !by_one_scan(inertial_new_);
}

std::optional<FilterState> Trust::decide_ins(const FilterState& belief, const ModeParams& modes) {
  const Stamp now = belief.belief.x.stamp;
  if (!without_ins_.alive() || now - without_ins_.branch < kYoung) return std::nullopt;
  const bool by_ladar = ins_by_ladar_.lasts(now, params_.ladar_refuted) && ins_is_faulty();
  // Without LADAR only the wheels can decide between INS and GPS.
  const bool by_gps = ins_by_gps_.lasts(now, params_.ladar_refuted) && votes_[1] > kMajority;
  if (!by_ladar && !by_gps) return std::nullopt;
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
  const bool relapse = ins_probation_ != Stamp::min() && now - ins_probation_ < kRelapse;
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

double Trust::ins_alternative_m(const FilterState& belief) const {
  if (!without_ins_.alive() || !(ins_by_ladar_.ratio > 1.0)) return 0.0;
  const NavState& others = without_ins_.state.belief.x;
  return (others.T_world_vehicle.p - belief.belief.x.T_world_vehicle.p).head<2>().norm();
}

}  // namespace rcs::wm
