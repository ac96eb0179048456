#include "modules/sp/start/initial_localization_node.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <string_view>

#include "lcmtypes/events.h"
#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

constexpr double kColumn_m = 1.0;

constexpr std::array<std::string_view, 7> kReasons = {
    "none",
    "too little ground collected",
    "the a priori map has no data in the start region",
    "no pose in the start region fits the ground: wrong region, or wrong map",
    "the ground has too few features",
    "several poses fit the ground",
    "newly observed ground refuted the candidate pose"};

}  // namespace

registration::Registration as_registration(const Pose& T_map_vehicle, const Mat<4>& covariance,
                                           double tilt_sigma_rad) {
  Mat6 in_map = Mat6::Zero();
  in_map.topLeftCorner<3, 3>() = covariance.topLeftCorner<3, 3>();
  in_map.block<3, 1>(0, 5) = covariance.block<3, 1>(0, 3);
  in_map.block<1, 3>(5, 0) = covariance.block<1, 3>(3, 0);
  in_map(3, 3) = in_map(4, 4) = tilt_sigma_rad * tilt_sigma_rad;
  in_map(5, 5) = covariance(3, 3);
  const Mat3 R_vehicle_map = T_map_vehicle.rotation().transpose();
  Mat6 turn = Mat6::Zero();
  turn.topLeftCorner<3, 3>() = R_vehicle_map;
  turn.bottomRightCorner<3, 3>() = R_vehicle_map;
  registration::Registration r;
  r.stop = registration::Stop::kConverged;
  r.T_target_vehicle = T_map_vehicle;
  r.information = Mat6(turn * in_map * turn.transpose()).ldlt().solve(Mat6::Identity());
  r.information = (0.5 * (r.information + r.information.transpose())).eval();
  return r;
}

StartSearch::StartSearch(const SpConfig& config, const PriorTerrain& prior)
    : params_(config.initial_localization) {
  if (!config.start || !prior.there()) return;
  const Vec3 middle = LocalFrame(prior.map().datum()).to_world(config.start->place);
  region_.middle_m = middle.head<2>();
  region_.radius_m = config.start->within_m;
  // A compass heading is clockwise from north.
  region_.yaw_rad = wrap_angle(0.5 * kPi - config.start->heading_rad);
  region_.within_rad = config.start->heading_within_rad;
  localizer_.emplace(params_);
  const bool begun = localizer_->begin(region_);
  RCS_CHECK(begun);  // load_sp_config() has checked it
  const auto n =
      static_cast<std::size_t>(config.ladar.rows) * static_cast<std::size_t>(config.ladar.cols);
  lowest_.reserve(n);
  sampler_.reserve(n);
}

std::optional<registration::Registration> StartSearch::step(const Points& points_vehicle,
                                                            const Pose& T_level_vehicle,
                                                            WorkUnits granted, Stamp now,
                                                            PriorTerrain* prior, Report* report) {
  if (!begun_) {
    begun_ = true;
    T_level_start_ = T_level_vehicle;
  }
  // The map around the vehicle, if it had started in the middle of the region.
  const double yaw = wrap_angle(region_.yaw_rad - yaw_of(T_level_start_.q));
  const Vec2 way = (T_level_vehicle.p - T_level_start_.p).head<2>();
  prior->follow_in_map(region_.middle_m + Eigen::Rotation2Dd(yaw) * way, now, report);
  sampler_.sample(points_vehicle, T_level_vehicle.q.conjugate() * Vec3::UnitZ(), kColumn_m,
                  &lowest_);
  if (status().state != InitialLocalizationState::kFound) {
    localizer_->add(lowest_, T_level_vehicle);
    localizer_->work(prior->map(), std::min(granted, params_.units));
    tell(now, report);
  }
  if (status().state != InitialLocalizationState::kFound) return std::nullopt;
  registration::Registration found =
      as_registration(status().T_map_level * T_level_vehicle,
                      localizer_->covariance_at(T_level_vehicle), params_.fit.tilt_sigma_rad);
  found.T_target_vehicle = prior->T_map_world()->inverse() * found.T_target_vehicle;
  return found;
}

void StartSearch::tell(Stamp now, Report* report) {
  const InitialLocalizationStatus& s = status();
  if (s.state == reported_state_ && s.reason == reported_reason_) return;
  const bool news = s.state == InitialLocalizationState::kFound ||
                    s.state == InitialLocalizationState::kConfirming ||
                    s.reason != reported_reason_;
  reported_state_ = s.state;
  reported_reason_ = s.reason;
  if (!news) return;
  if (s.state == InitialLocalizationState::kFound) {
    report->publish(
        now, event::kSpStartFound,
        "start confirmed on the a priori map after {:.0f} m: log-likelihood {:.1f} above "
        "the next pose, {:.1f} above featureless ground",
        s.travelled_m, s.margin, s.evidence);
  } else if (s.state == InitialLocalizationState::kConfirming) {
    report->publish(now, event::kSpStartConfirming,
                    "one candidate pose left after {:.0f} m: newly observed ground must confirm it",
                    s.travelled_m);
  } else {
    report->publish(now, event::kSpStartUnknown,
                    "start unresolved: {}; {} hypotheses left, {:.0f} m rms apart, after {:.0f} m",
                    kReasons[static_cast<std::size_t>(s.reason)], s.hypotheses, s.scatter_m,
                    s.travelled_m);
  }
}

}  // namespace rcs::sp
