#include "sim/vehicle/drive_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::sim {
namespace {

// Limits are often given twice, here and in the driver: a rounding error must not decide.
constexpr double kRounding = 1e-9;

double towards(double target, double value, double most) {
  return value + std::clamp(target - value, -most, most);
}

}  // namespace

// Both axles of a bicycle steer, the rear one by -s times the tangent of the front one: the origin
// between them then moves at the angle b to the body with
//   sin b = curvature * wheelbase (1 - s) / (2 (1 + s)).
// For s = 0 this is the bicycle with front steering (Rajamani 2012, ch. 2).
DriveModel::DriveModel(const DriveParams& params, double wheelbase_m, const CoursePoint& start)
    : params_(params),
      slip_m_(0.5 * wheelbase_m * (1.0 - params.rear_steer) / (1.0 + params.rear_steer)),
      place_(start),
      newest_issued_s_(-std::numeric_limits<double>::infinity()) {}

bool DriveModel::plausible(const DriveCommand& c, double arrival_s) const {
  // Comparisons with NaN are false.
  return c.issued_s <= arrival_s && c.valid_until_s - c.issued_s > 0.0 &&
         c.valid_until_s - c.issued_s <= kLongest_s &&
         c.speed_mps <= params_.speed_max_mps + kRounding &&
         c.speed_mps >= -params_.reverse_max_mps - kRounding &&
         std::abs(c.curvature_1pm) <= params_.curvature_max_1pm + kRounding &&
         c.accel_limit_mps2 >= 0.0;
}

void DriveModel::command(const DriveCommand& command, double arrival_s) {
  if (!plausible(command, arrival_s)) {
    ++account_.implausible;
  } else if (command.issued_s <= newest_issued_s_) {
    ++account_.stale;
  } else if (arrival_s >= command.valid_until_s && !command.emergency_stop) {
    ++account_.expired;
  } else {
    newest_issued_s_ = command.issued_s;
    arrived_.push_back({command, arrival_s});
    ++account_.taken;
  }
}

const DriveCommand* DriveModel::in_force(double time_s) {
  const double received_s = time_s - params_.delay_s;
  std::size_t newest = 0;
  while (newest + 1 < arrived_.size() && arrived_[newest + 1].arrival_s <= received_s) ++newest;
  arrived_.erase(arrived_.begin(), arrived_.begin() + static_cast<std::ptrdiff_t>(newest));
  const bool commanded = !stopped_for_good_ && !arrived_.empty() &&
                         arrived_.front().arrival_s <= received_s &&
                         received_s < arrived_.front().command.valid_until_s;
  if (!commanded && !silent_ && speed_mps_ != 0.0) ++account_.silences;
  silent_ = !commanded;
  return commanded ? &arrived_.front().command : nullptr;
}

void DriveModel::step_to(double time_s) {
  const double dt_s = time_s - time_s_;
  time_s_ = time_s;
  const DriveCommand* const c = in_force(time_s);

  // The newest command that has taken effect, which may have expired since.
  const bool stopped = !arrived_.empty() && arrived_.front().command.emergency_stop &&
                       arrived_.front().arrival_s <= time_s - params_.delay_s;
  const double target_mps = c == nullptr || c->brake || stopped ? 0.0 : c->speed_mps;
  const bool slower = target_mps * speed_mps_ < 0.0 || std::abs(target_mps) < std::abs(speed_mps_);
  double limit_mps2 = params_.acceleration_mps2;
  if (slower) {
    const bool hard = stopped_for_good_ || stopped || (c != nullptr && c->brake);
    limit_mps2 = hard ? params_.hard_braking_mps2 : params_.braking_mps2;
  } else if (c != nullptr && c->accel_limit_mps2 > 0.0) {
    limit_mps2 = std::min(limit_mps2, c->accel_limit_mps2);
  }
  // A change of direction passes through rest: brakes do not push back.
  const double aim_mps = target_mps * speed_mps_ < 0.0 ? 0.0 : target_mps;
  const double before_mps = speed_mps_;
  speed_mps_ = towards(aim_mps, speed_mps_, limit_mps2 * dt_s);
  // Without a command the steering is unchanged.
  const double before_1pm = curvature_1pm_;
  if (c != nullptr) {
    curvature_1pm_ = towards(c->curvature_1pm, curvature_1pm_, params_.curvature_rate * dt_s);
  }

  const double way_m = 0.5 * (before_mps + speed_mps_) * dt_s;
  const double curvature_1pm = 0.5 * (before_1pm + curvature_1pm_);
  const double turn_rad = way_m * curvature_1pm;
  const double slip_rad = std::asin(std::clamp(slip_m_ * curvature_1pm, -1.0, 1.0));
  const double course_rad = place_.heading_rad + 0.5 * turn_rad + slip_rad;
  place_.p_world += way_m * Vec2(std::cos(course_rad), std::sin(course_rad));
  place_.heading_rad += turn_rad;
}

}  // namespace rcs::sim
