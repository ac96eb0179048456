// SpNode: a finished scan is deskewed, registered to the rolling map and to the a priori map, and
// inserted in the rolling map.
#include <algorithm>
#include <array>
#include <optional>

#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "modules/registration/coarse_search.h"
#include "modules/sp/scan/deskew.h"
#include "modules/sp/sp_node.h"

namespace rcs::sp {
namespace {

// Sigma of the distortion of a scan that is deskewed with an extrapolated motion; chosen with 25 s
// without INS and GPS on drill.toml and steep_ridge.toml, seeds 1 to 6 (from 0.02 to 0.3 m, 0.001
// to 0.05 rad).
constexpr double kDistortion_m = 0.1;
constexpr double kDistortion_rad = 0.005;
// After a gap of the INS the prediction is off by metres and degrees. A registration that matches
// less than these shares of the usual overlap is searched again from farther away, or rejected.
constexpr double kDoubtful = 0.8;
constexpr double kWrong = 0.6;
// Since the last registered scan: another view, of which less is in the map.
constexpr double kNewView_m = 3.0;
constexpr double kHardly = 0.3;
constexpr int kLostAfter = 3;        // rejected scans in a row, while WM predicts the pose
constexpr double kMinOverlap = 0.5;  // of such a scan with the map: with less it is inserted

void move_by(const Vec3& shift, const Points& points, Points* out) {
  const Vec3f by = shift.cast<float>();
  out->clear();
  for (std::size_t i = 0; i < points.size(); ++i) out->push_back(points[i] + by);
}

Mat6 distortion() { return isotropic(kDistortion_m, kDistortion_rad); }

}  // namespace

/// Until it is known whether the clock or the latency has changed, a stamp is taken as it is.
void SpNode::correct_stamp(const Cycle& cycle) {
  Stamp* reference = &assembler_.scan()->reference;
  // Without its last part a scan seems to have arrived early.
  if (inertial_.size() > 0 && assembler_.facets_missing() == 0) {
    stamps_.add(*reference, last_facet_arrival_, inertial_[inertial_.size() - 1].stamp);
  }
  const Duration shift = stamps_.shift().value_or(Duration::zero());
  *reference += shift;
  constexpr Duration kSame = from_milliseconds(50.0);  // latencies vary
  if (shift - reported_shift_ < kSame && reported_shift_ - shift < kSame) return;
  report_.publish(cycle.now, event::kSpScanClock,
                  "scan {}: the stamps of the LADAR are corrected by {:.3f} s",
                  assembler_.scan_id(), seconds(shift));
  reported_shift_ = shift;
}

/// WM fuses a scan once the INS has reached its instant. For a scan that ends a little after the
/// newest sample that is the instant of this sample, so that nothing waits for the next one.
/// Without INS it is the middle of the scan. An error of the velocity with which the scan is
/// deskewed moves no pose there. At the end of the scan it moves the pose by half of its distance
/// in the scan, and the next velocity by the opposite: the poses then alternate by metres.
void SpNode::choose_reference(Scan* scan) const {
  if (scan->dt_us.empty()) return;
  Duration ahead{};
  if (inertial_.size() == 0 || ins_is_silent(inertial_, scan->reference)) {
    const auto [first, last] = std::minmax_element(scan->dt_us.begin(), scan->dt_us.end());
    ahead = -Duration((*first + *last) / 2);
  } else {
    constexpr Duration kReferred = from_milliseconds(30.0);  // usual latency and interval of an INS
    ahead = scan->reference - inertial_[inertial_.size() - 1].stamp;
    if (ahead <= Duration::zero() || ahead > kReferred) return;
  }
  scan->reference -= ahead;
  for (auto& dt : scan->dt_us) dt += static_cast<std::int32_t>(ahead.count());
}

/// Whether the latency of a scan has changed or the clock of its stamp: by where it is, if the
/// vehicle moves enough.
void SpNode::decide_stamp(Expectation* expected) {
  if (stamps_.shift() || epoch_ == 0 || !expected->known) return;
  constexpr double kApart_m = 0.3;
  constexpr double kApart_rad = 0.03;
  constexpr double kArm_m = 10.0;  // at which a rotation counts
  Scan* scan = assembler_.scan();
  const Stamp stepped = scan->reference - stamps_.changed();
  const Expectation other = motion_guess_.expect(stepped, inertial_, config_.expectation);
  const Pose& T_late = expected->at_reference.T_rolling_vehicle;
  const Pose& T_stepped = other.at_reference.T_rolling_vehicle;
  const auto apart = [](const Pose& a, const Pose& b) { return log_se3(a.inverse() * b); };
  const Vec6 between = apart(T_late, T_stepped);
  if (!other.known ||
      (between.head<3>().norm() < kApart_m && between.tail<3>().norm() < kApart_rad)) {
    return;
  }
  std::optional<bool> clock;
  for (const Expectation* start : std::array<const Expectation*, 2>{expected, &other}) {
    const registration::Prediction prediction{start->at_reference.T_rolling_vehicle,
                                              start->covariance};
    const registration::Registration found =
        registration::register_points(source_, &map_, prediction, config_.icp, granted_, &icp_);
    granted_ -= found.used;
    if (!registration::usable(found.stop) || found.stop == registration::Stop::kBudget) continue;
    const auto distance = [&](const Pose& T) {
      const Vec6 d = apart(T, found.T_target_vehicle);
      return d.head<3>().norm() + kArm_m * d.tail<3>().norm();
    };
    const bool by_this = distance(T_stepped) < distance(T_late);
    // Where each search ends near its own start, nothing is measured.
    if (clock && *clock != by_this) return;
    clock = by_this;
  }
  if (clock) stamps_.decide(*clock);
  if (stamps_.shift().value_or(Duration::zero()) == Duration::zero()) return;
  scan->reference = stepped;
  registration_message_.utime = to_utime(stepped);
  *expected = other;
}

void SpNode::prepare_points(const Cycle& cycle, const Expectation& expected) {
  if (expected.ins_silent()) as_measured_ = *assembler_.scan();
  deskew_and_sample(expected.at_reference);
  if (ladder_.level == Degrade::kFull) {
    full_need_ = static_cast<WorkUnits>(source_.size()) * config_.icp.max_iterations;
  }
  cycle.stages->mark("deskew");
}

void SpNode::deskew_and_sample(const MotionState& motion) {
  Scan* scan = assembler_.scan();
  if (!scan->dt_us.empty()) {
    const auto [first, last] = std::minmax_element(scan->dt_us.begin(), scan->dt_us.end());
    if (*first != 0 || *last != 0) {
      tabulate_motion(motion, inertial_, scan->reference, Duration(*first), Duration(*last),
                      &motion_);
      deskew(motion_, scan);
    }
  }
  sample();
}

/// Not much denser than the voxels of the map: more points would only cost time.
void SpNode::sample() {
  constexpr double kOfVoxel = 1.0 / 3.0;
  const double scale = scale_.now();
  const bool full = ladder_.level == Degrade::kFull;
  const double voxel_m = scale * config_.map.voxel_m;
  const auto scaled = [&](double configured_m, double min_m) {
    return scale < 1.0 ? std::min(configured_m, std::max(scale * configured_m, min_m))
                       : configured_m;
  };
  const double coarser = full ? 1.0 : config_.degrade.coarser;
  map_sampler_.sample(assembler_.scan()->points, scaled(config_.map_voxel_m, kOfVoxel * voxel_m),
                      &dense_);
  source_sampler_.sample(dense_, coarser * scaled(config_.source_voxel_m, voxel_m), &source_);
}

/// Of the scan. Few points tell nothing of the place.
double SpNode::fitting_scale() {
  constexpr std::size_t kFew = 200;
  const Points& points = assembler_.scan()->points;
  if (points.size() < kFew) return scale_.now();
  range_m_ = median_range_m(points, config_.ladar.T_vehicle_mount.p, &distances_);
  return sp::fitting_scale(range_m_, config_.map.voxel_m, config_.icp.map_sigma_m);
}

/// For a new map. Allocates, if the size of what the LADAR sees has changed.
void SpNode::choose_voxels(const Cycle& cycle) {
  const double scale = fitting_scale();
  const bool same = scale == scale_.now();
  scale_.begin(scale);
  if (same) return;
  registration::RollingMapParams params = config_.map;
  params.voxel_m *= scale;
  map_ = registration::RollingMap(params);
  map_.reserve(assembler_.scan()->points.size());
  sample();
  constexpr double kCoarse = 0.7;
  const double suits_m = fitting_voxel_m(range_m_);
  report_.publish(cycle.now, event::kSpMapReseeded,
                  "half of the points are within {:.1f} m: voxels of {:.2f} m, [sp.map] voxel_m "
                  "{:.2f} m; a new rolling map starts{}",
                  range_m_, params.voxel_m, config_.map.voxel_m,
                  suits_m < kCoarse * params.voxel_m
                      ? fmt::format("; {:.2f} m would suit, but [sp.icp] map_sigma_m {:.3f} m does "
                                    "not allow it: registrations may be wrong",
                                    suits_m, config_.icp.map_sigma_m)
                      : std::string());
}

/// Without INS a rocking vehicle is not where it is predicted: the rolling map is searched from
/// farther away.
void SpNode::search_wide(const Expectation& expected, registration::Registration* rolling) {
  if (granted_ <= 0) return;
  const registration::WideMap map(map_, registration::WideMapParams{});
  const registration::WideAnswer found = registration::search_wide(
      source_, map, expected.at_reference.T_rolling_vehicle, registration::WideParams{});
  granted_ -= found.used;
  const registration::Prediction start{found.T_target_vehicle, expected.covariance};
  const registration::Registration again =
      registration::register_points(source_, &map_, start, config_.icp, granted_, &icp_);
  granted_ -= again.used;
  if (!registration::usable(again.stop)) return;
  if (!registration::usable(rolling->stop) || again.overlap > rolling->overlap) *rolling = again;
}

Pose SpNode::ladar_motion_to(const Pose& T_rolling_vehicle) const {
  const Pose T_vehicle_ladar{Quat::Identity(), config_.ladar.T_vehicle_mount.p};
  return T_vehicle_ladar.inverse() * T_rolling_last_.inverse() * T_rolling_vehicle *
         T_vehicle_ladar;
}

/// The pose at which this scan and the last one explain each other, whatever the motion between
/// them is.
void SpNode::compare_scans(const Pose& predicted, ScanPair* pair) {
  constexpr double kMuchMore = 2.0;
  // The preparation and the search pass over all points about this often.
  constexpr WorkUnits kPasses = 3;
  const WorkUnits needed = kPasses * static_cast<WorkUnits>(last_seen_.size() + dense_.size());
  const WorkUnits left = static_cast<WorkUnits>(source_.size()) * config_.icp.max_iterations;
  if (pair->matcher || last_seen_.empty() || dense_.empty() || granted_ < needed + left) return;
  granted_ -= needed;
  const registration::CloudParams params;
  const Pose T_vehicle_ladar{Quat::Identity(), config_.ladar.T_vehicle_mount.p};
  Points seen;
  move_by(-T_vehicle_ladar.p, dense_, &seen);
  pair->matcher.emplace(last_seen_, seen, params);
  const registration::CloudRegistration found =
      pair->matcher->conclude(pair->matcher->search(ladar_motion_to(predicted)));
  // A corridor does not determine the motion along it well; a motion that explains much more than
  // the predicted one is the better start all the same.
  const auto explains_more = [&] {
    const registration::Verdict at_prediction = pair->matcher->judge(ladar_motion_to(predicted));
    return registration::plausible(found.verdict, params) &&
           found.verdict.plausibility.score() > kMuchMore * at_prediction.plausibility.score();
  };
  if (!registration::usable(found.best.stop)) return;
  if (!registration::accepted(found.verdict, params) && !explains_more()) return;
  const auto add = [&](const Pose& T_last_scan) {
    pair->T_rolling_vehicle.push_back(T_rolling_last_ * T_vehicle_ladar * T_last_scan *
                                      T_vehicle_ladar.inverse());
  };
  add(found.best.T_target_vehicle);
  // The map decides what is ambiguous between two scans.
  for (std::size_t k = 1; k < std::min<std::size_t>(3, found.ranked.size()); ++k) {
    if (found.ranked[k].score < params.max_ambiguity * found.ranked[0].score) break;
    add(found.ranked[k].T_target_vehicle);
  }
}

/// A scan that matches little is registered from the motion that it and the last scan determine. If
/// they determine none, and contradict the registration, the scan is rejected: ground alone matches
/// anywhere.
/// @param least  overlap of a registration from that motion
void SpNode::register_by_last_scan(double least, ScanPair* pair,
                                   registration::Prediction* prediction,
                                   registration::Registration* rolling) {
  const bool compared = pair->matcher.has_value();
  compare_scans(prediction->T_target_vehicle, pair);
  if (!pair->matcher) return;
  if (pair->T_rolling_vehicle.empty()) {
    if (!registration::usable(rolling->stop)) return;
    const registration::Verdict verdict =
        pair->matcher->judge(ladar_motion_to(rolling->T_target_vehicle));
    if (!registration::contradictory(verdict, registration::CloudParams{})) return;
    pair->contradiction = verdict.plausibility;
    rolling->stop = registration::Stop::kDiverged;
    rolling->T_target_vehicle = prediction->T_target_vehicle;
    rolling->information.setZero();
    return;
  }
  const std::size_t first = compared ? 1 : 0;  // the best was the start already
  for (std::size_t k = first; k < pair->T_rolling_vehicle.size(); ++k) {
    registration::Prediction own = *prediction;
    own.T_target_vehicle = pair->T_rolling_vehicle[k];
    const registration::Registration again =
        registration::register_points(source_, &map_, own, config_.icp, granted_, &icp_);
    granted_ -= again.used;
    if (!registration::usable(again.stop) || again.stop == registration::Stop::kBudget) continue;
    if (registration::usable(rolling->stop) && rolling->overlap >= again.overlap) continue;
    if (again.overlap < least) continue;
    *prediction = own;
    *rolling = again;
  }
}

/// Without INS the motion during the scan is known only once the scan is registered: it is deskewed
/// again with the motion from the last scan to it, and registered again. Twice is worse.
void SpNode::follow_motion(const Expectation& expected, registration::Registration* rolling) {
  if (!registration::usable(rolling->stop)) return;
  Scan* scan = assembler_.scan();
  const std::optional<MotionState> motion =
      motion_guess_.motion_to(scan->reference, rolling->T_target_vehicle);
  if (!motion) return;
  *scan = as_measured_;
  deskew_and_sample(*motion);
  const registration::Prediction start{rolling->T_target_vehicle, expected.covariance};
  const registration::Registration again =
      registration::register_points(source_, &map_, start, config_.icp, granted_, &icp_);
  granted_ -= again.used;
  if (registration::usable(again.stop) && again.stop != registration::Stop::kBudget) {
    *rolling = again;
  }
}

void SpNode::remember_scan(const Pose& T_rolling_vehicle) {
  move_by(-config_.ladar.T_vehicle_mount.p, dense_, &last_seen_);
  T_rolling_last_ = T_rolling_vehicle;
}

void SpNode::seed(const Cycle& cycle, const Pose& T_rolling_vehicle) {
  // Distinct from the epochs of an earlier run of this process, so that WM cannot confuse them.
  const auto from_time =
      static_cast<std::int32_t>((registration_message_.utime / 1000) % 1'000'000'000);
  epoch_ = std::max(epoch_ + 1, from_time + 1);
  failures_ = 0;
  usual_overlap_.forget();  // of a map of one scan less overlaps
  choose_voxels(cycle);
  map_.clear();
  map_.insert(dense_, T_rolling_vehicle);
  motion_guess_.forget_poses();
  motion_guess_.remember(from_utime(registration_message_.utime), T_rolling_vehicle);
  remember_scan(T_rolling_vehicle);
  registration::Registration seeded;
  seeded.stop = registration::Stop::kSeeded;
  seeded.T_target_vehicle = T_rolling_vehicle;
  seeded.points = static_cast<int>(source_.size());
  answer(seeded, registration_t::TARGET_ROLLING);
  registration_out_.publish(&registration_message_);
  publish_points(T_rolling_vehicle);
}

/// A faulty INS, or a belief that it has spoilt, predicts where nothing matches: the motion since
/// the last scans predicts again, without them.
void SpNode::register_by_own_motion(registration::Prediction* prediction,
                                    registration::Registration* rolling) {
  const std::optional<Pose> start = motion_guess_.continued(assembler_.scan()->reference);
  if (!start || granted_ <= 0) return;
  const ExpectationParams& sigma = config_.expectation;
  const registration::Prediction own{*start, isotropic(sigma.coast_sigma_m, sigma.coast_sigma_rad)};
  const registration::Registration again =
      registration::register_points(source_, &map_, own, config_.icp, granted_, &icp_);
  granted_ -= again.used;
  // A search that the budget has ended may have measured nothing.
  if (!registration::usable(again.stop) || again.stop == registration::Stop::kBudget) return;
  *prediction = own;
  *rolling = again;
}

/// The scan matches little of the map where it is predicted: it is registered from the motion since
/// the last scan, then from a search of the map from farther away. What is found counts only if it
/// matches as much of the scan as usual, and the last scan does not contradict it. Otherwise a view
/// that is new is used, and one that contradicts the last scan is rejected.
void SpNode::recover(const Cycle& cycle, const Expectation& expected, ScanPair* pair,
                     registration::Prediction* prediction, registration::Registration* rolling) {
  const double where_predicted = rolling->overlap;
  register_by_last_scan(kDoubtful * usual_overlap_.mean(), pair, prediction, rolling);
  if (matches_less_than(kDoubtful, *rolling)) {
    registration::Registration found = *rolling;
    search_wide(expected, &found);
    if (matches_less_than(kDoubtful, found)) return;
    if (pair->matcher &&
        registration::contradictory(pair->matcher->judge(ladar_motion_to(found.T_target_vehicle)),
                                    registration::CloudParams{})) {
      return;
    }
    pair->contradiction.reset();
    prediction->T_target_vehicle = found.T_target_vehicle;
    *rolling = found;
  } else if (rolling->overlap == where_predicted) {
    return;  // nothing matches more
  }
  const Vec6 off =
      log_se3(expected.at_reference.T_rolling_vehicle.inverse() * rolling->T_target_vehicle);
  report_.publish(cycle.now, event::kSpRegistrationRecovered,
                  "scan {} found {:.2f} m and {:.1f} deg from where it was predicted; it matches "
                  "{:.0f} %",
                  assembler_.scan_id(), off.head<3>().norm(), degrees(off.tail<3>().norm()),
                  100.0 * rolling->overlap);
}

/// Whether the registration fails, or matches less of the scan than a share of what is usual here.
bool SpNode::matches_less_than(double share, const registration::Registration& r) const {
  return !registration::usable(r.stop) || r.overlap < share * usual_overlap_.mean();
}

bool SpNode::matches_less_than_usual(const registration::Registration& r) const {
  return !registration::usable(r.stop) || r.overlap < usual_overlap_.least();
}

void SpNode::register_scan(const Cycle& cycle, const Expectation& expected) {
  registration::Prediction prediction{expected.at_reference.T_rolling_vehicle, expected.covariance};
  ScanPair pair;
  if (expected.motion_unknown) {
    compare_scans(prediction.T_target_vehicle, &pair);
    if (!pair.T_rolling_vehicle.empty()) {
      prediction.T_target_vehicle = pair.T_rolling_vehicle.front();
    }
  }
  registration::Registration rolling =
      registration::register_points(source_, &map_, prediction, config_.icp, granted_, &icp_);
  granted_ -= rolling.used;
  if (!registration::usable(rolling.stop)) register_by_own_motion(&prediction, &rolling);
  if (expected.by_scans && matches_less_than(kDoubtful, rolling)) {
    register_by_last_scan(0.0, &pair, &prediction, &rolling);
  }
  if (!expected.ins_lost && !expected.by_scans) {
    // A belief of WM is wrong if nothing has matched it for several scans; other views are not.
    const bool failing = failures_ >= kLostAfter;
    const bool lost = expected.by_belief ? failing && matches_less_than(kHardly, rolling)
                                         : matches_less_than_usual(rolling);
    if (lost) recover(cycle, expected, &pair, &prediction, &rolling);
    // What matches hardly anything matches by chance. A search that converges may have found a new
    // view; one that does not has found nothing, as in scans that a wrong gyro has distorted.
    const bool unsettled = expected.by_belief && rolling.stop != registration::Stop::kConverged;
    const bool by_chance = matches_less_than(kHardly, rolling) && (failing || unsettled);
    if (registration::usable(rolling.stop) && by_chance) {
      rolling.stop = registration::Stop::kDiverged;
    }
  }
  if (expected.ins_lost && matches_less_than(kDoubtful, rolling)) search_wide(expected, &rolling);
  if (expected.ins_silent()) follow_motion(expected, &rolling);
  if (expected.ins_lost) {
    // A search that ends at the iteration limit may have an error of many sigmas. While the INS is
    // silent it is still better than no registration.
    const double moved_m = (prediction.T_target_vehicle.p - T_rolling_last_.p).norm();
    const bool settled = rolling.stop != registration::Stop::kMaxIterations &&
                         (moved_m > kNewView_m || !matches_less_than(kWrong, rolling));
    if (!settled && expected.ins_returned) rolling.stop = registration::Stop::kDiverged;
    rolling.information = registration::with_distortion(rolling.information, distortion());
  }
  cycle.stages->mark("register");
  if (!registration::usable(rolling.stop)) ++account_.failed;
  answer(rolling, registration_t::TARGET_ROLLING);
  registration_out_.publish(&registration_message_);

  if (!registration::usable(rolling.stop)) {
    if (pair.contradiction) {
      report_.publish(cycle.now, event::kSpRegistrationFailed,
                      "scan {} not used: it contradicts the last scan: {:.0f} % of what is not "
                      "ground lies on surfaces of it, {:.0f} % in its free space",
                      assembler_.scan_id(), 100.0 * pair.contradiction->explained,
                      100.0 * pair.contradiction->contradicted);
    } else {
      report_.publish(
          cycle.now, event::kSpRegistrationFailed,
          "scan {} not used: registration ended with {}, {} of {} points matched, {:.2f} m "
          "from the prediction",
          assembler_.scan_id(), registration::name_of(rolling.stop), rolling.pairs, rolling.points,
          rolling.correction_m);
    }
    // Without INS the scans are faulty rather than the map, which is kept for longer.
    constexpr int kLongerWithoutIns = 3;
    const int limit = config_.reseed_after * (expected.ins_lost ? kLongerWithoutIns : 1);
    if (++failures_ >= limit && !source_.empty()) {
      report_.publish(cycle.now, event::kSpMapReseeded,
                      "{} registrations in a row failed, limit {}; a new rolling map starts",
                      failures_, limit);
      seed(cycle, prediction.T_target_vehicle);
    }
    return;
  }
  failures_ = 0;
  if (!expected.ins_lost) usual_overlap_.add(rolling.overlap);
  const Pose T_rolling_vehicle = registration::fused_pose(prediction, rolling);
  motion_guess_.remember(from_utime(registration_message_.utime), T_rolling_vehicle);
  remember_scan(T_rolling_vehicle);
  publish_points(T_rolling_vehicle);
  if (ladder_.level < Degrade::kNoPrior) {
    match_prior(cycle, T_rolling_vehicle, expected.ins_lost);
    search_start(cycle, T_rolling_vehicle);
  }
  // Just after a gap of the INS a scan is distorted and degrades the map: it is inserted only if
  // the vehicle is about to leave the map. During the gap it is deskewed with its own motion.
  const bool distorted = expected.ins_returned;
  if (!distorted || rolling.overlap < kMinOverlap) map_.insert(dense_, T_rolling_vehicle);
  if (T_world_rolling_) {
    prior_.follow((*T_world_rolling_ * T_rolling_vehicle).p, cycle.now, &report_);
  }
  cycle.stages->mark("map");
}

void SpNode::match_prior(const Cycle& cycle, const Pose& T_rolling_vehicle, bool distorted) {
  if (!T_world_rolling_ || !prior_.T_map_world()) return;
  const Pose& T_map_world = *prior_.T_map_world();
  const Pose T_world_vehicle = *T_world_rolling_ * T_rolling_vehicle;
  prior_scan_.take(dense_, T_world_vehicle.q.conjugate() * Vec3::UnitZ(),
                   prior_.map().has_points() ? config_.prior.points.max_points : 0,
                   config_.prior_scan);
  const registration::Prediction prediction{T_map_world * T_world_vehicle,
                                            world_covariance_ + isotropic(0.01, 0.001)};
  PriorMatch match = match_prior_map(prior_scan_.ground(), prior_scan_.standing(), prior_.map(),
                                     prediction, config_.prior, granted_, &prior_match_);
  if (distorted) {
    match.registration.information =
        registration::with_distortion(match.registration.information, distortion());
  }
  match.registration.T_target_vehicle = T_map_world.inverse() * match.registration.T_target_vehicle;
  answer(match.registration, registration_t::TARGET_PRIOR_MAP);
  registration_message_.n_tiles = 1;
  registration_message_.tile_id.assign(1, match.tile_id);
  registration_message_.map_bias_sigma_m = match.bias_sigma_m;
  registration_message_.map_bias_length_m = match.bias_length_m;
  registration_out_.publish(&registration_message_);
  cycle.stages->mark("prior");
}

/// WM has no position in frame world yet: the result of the search becomes its first. It is
/// published with each scan until WM has accepted it.
void SpNode::search_start(const Cycle& cycle, const Pose& T_rolling_vehicle) {
  if (!start_.on() || !T_level_rolling_) return;
  const std::optional<registration::Registration> found = start_.step(
      dense_, *T_level_rolling_ * T_rolling_vehicle, granted_, cycle.now, &prior_, &report_);
  cycle.stages->mark("start");
  if (!found) return;
  const MapLevel& level = prior_.map().level(0);
  answer(*found, registration_t::TARGET_PRIOR_MAP);
  registration_message_.n_tiles = 0;
  registration_message_.tile_id.clear();
  registration_message_.map_bias_sigma_m = level.bias_sigma_m;
  registration_message_.map_bias_length_m = level.bias_correlation_m;
  registration_out_.publish(&registration_message_);
}

void SpNode::publish_points(const Pose& T_rolling_vehicle) {
  points_out_.publish(dense_, config_.publish_voxel_m, T_rolling_vehicle,
                      registration_message_.utime, registration_message_.scan_id, epoch_);
}

}  // namespace rcs::sp
