#include "modules/wm/fault_detection/wheels_vote.h"

#include <algorithm>
#include <cmath>

namespace rcs::wm {
namespace {

constexpr Duration kLongestWindow = from_seconds(3.0);
constexpr Duration kSpacing = from_milliseconds(90.0);  // least, of the scans that are kept
// Of the wheels: they slip. Of a course: it is that of the antenna, which rocks.
constexpr double kTolerance_m = 0.3;
constexpr double kToleranceShare = 0.05;
constexpr double kTurn_rad = 0.06;
constexpr double kCourse_rad = 0.12;
constexpr double kChord_s = 0.9;  // between fixes without velocity
constexpr double kNearer = 0.5;   // of two that agree against a third
constexpr double kShare = 0.2;    // of the newest comparison
constexpr double kMajority = 0.5;

/// The second is off by more than the tolerance from the first, and a reference is near the first.
bool odd(double by_ladar, double by_wheels, double by_reference, double tolerance) {
  const double off = std::abs(by_wheels - by_ladar);
  return off > tolerance && std::abs(by_wheels - by_reference) > tolerance &&
         std::abs(by_ladar - by_reference) < kNearer * off;
}

}  // namespace

void WheelsVote::add(Stamp stamp, const OdometrySample& z, double wheel_scale) {
  wheels_distance_.add(stamp, z.speed_mps / wheel_scale);
  if (std::isfinite(z.yaw_rate_radps)) wheels_turn_.add(stamp, z.yaw_rate_radps);
}

void WheelsVote::add(Stamp stamp, const GpsFix& z) {
  Vec3 v_mps = z.v_world;
  if (!z.has_velocity) {
    const double since_s = seconds(stamp - from_);
    if (from_ != Stamp::min() && since_s > 0.0 && since_s < kChord_s) return;
    const bool fresh = from_ != Stamp::min() && since_s > 0.0 && since_s < 2.0 * kChord_s;
    v_mps = fresh ? Vec3((z.p_world - from_m_) / since_s) : Vec3(Vec3::Zero());
    from_ = stamp;
    from_m_ = z.p_world;
    if (!fresh) return;
  }
  fixes_distance_.add(stamp, v_mps.norm());
  course_.add(stamp, v_mps);
}

void WheelsVote::add(Stamp stamp, const RollingMatch& z, const Quat* by_ins) {
  const bool back = count_ > 0 && stamp <= scans_[(count_ - 1) % scans_.size()].stamp;
  if (z.map_epoch != map_epoch_ || back) count_ = 0;
  map_epoch_ = z.map_epoch;
  Scan now;
  now.stamp = stamp;
  now.T_rolling_vehicle = z.T_rolling_vehicle;
  now.by_wheels = {wheels_distance_.at(stamp), wheels_turn_.at(stamp)};
  now.by_fixes = {fixes_distance_.at(stamp), course_.turn().at(stamp)};
  now.ins = by_ins != nullptr;
  if (by_ins != nullptr) now.by_ins = *by_ins;
  bool contradicts = false;
  for (std::size_t k = 1; k <= std::min(count_, scans_.size()); ++k) {
    const Scan& scan = scans_[(count_ - k) % scans_.size()];
    if (stamp - scan.stamp < kWindow) continue;
    if (stamp - scan.stamp <= kLongestWindow) contradicts = compare(scan, now);
    break;
  }
  vote_ += kShare * ((contradicts ? 1.0 : 0.0) - vote_);
  // Of a LADAR with many scans a second the ring would be shorter than the window.
  const bool kept = count_ > 0 && stamp - scans_[(count_ - 1) % scans_.size()].stamp < kSpacing;
  if (!kept) scans_[count_++ % scans_.size()] = now;
}

void WheelsVote::begin() {
  count_ = 0;
  vote_ = 0.0;
}

bool WheelsVote::compare(const Scan& begin, const Scan& end) {
  const auto complete = [&](const MotionSum& sum) {
    return sum.complete_since(end.stamp) <= begin.stamp;
  };
  if (!complete(wheels_distance_)) return false;
  const Pose moved = begin.T_rolling_vehicle.inverse() * end.T_rolling_vehicle;
  const double ladar_m = moved.p.norm();
  const double ladar_rad = yaw_of(moved.q);
  const double wheels_m = std::abs(end.by_wheels.distance_m - begin.by_wheels.distance_m);
  const double wheels_rad = end.by_wheels.turn_rad - begin.by_wheels.turn_rad;
  const bool turns = complete(wheels_turn_);
  compared_ = end.stamp;
  apart_ = {wheels_m - ladar_m, turns ? wheels_rad - ladar_rad : 0.0};
  const bool by_distance =
      complete(fixes_distance_) &&
      odd(ladar_m, wheels_m, end.by_fixes.distance_m - begin.by_fixes.distance_m,
          kTolerance_m + kToleranceShare * ladar_m);
  const bool by_course =
      turns && complete(course_.turn()) &&
      odd(ladar_rad, wheels_rad, end.by_fixes.turn_rad - begin.by_fixes.turn_rad, kCourse_rad);
  by_fixes_ = by_distance || by_course;
  const bool by_ins =
      turns && begin.ins && end.ins &&
      odd(ladar_rad, wheels_rad, yaw_of(begin.by_ins.conjugate() * end.by_ins), kTurn_rad);
  return by_fixes_ || by_ins;
}

bool WheelsVote::turn_alike(Stamp now) const {
  const bool known = compared_ != Stamp::min() && now - compared_ <= kLongestWindow;
  return !known || std::abs(apart_.turn_rad) < kTurn_rad;
}

bool WheelsVote::contradicts() const { return vote_ > kMajority; }

}  // namespace rcs::wm
