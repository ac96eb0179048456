#include "modules/registration/driven_way.h"

namespace rcs::registration {
namespace {

constexpr float kNear_m = 5.0F;    // of a lane, and of a vehicle that keeps to its own tracks
constexpr float kStep_m = 0.5F;    // less is the noise of a vehicle at rest
constexpr float kApart_m = 30.0F;  // of way: the vehicle turned round, and did not stand

}  // namespace

void DrivenWay::clear() {
  places_.clear();
  length_m_ = 0.0F;
  begun_ = false;
}

void DrivenWay::drive_to(const Vec3f& p) {
  const float step_m = begun_ ? (p - last_).norm() : 0.0F;
  if (begun_ && step_m < kStep_m) return;
  begun_ = true;
  length_m_ += step_m;
  last_ = p;
  if (!places_.empty() && length_m_ - places_.back().way_m < kEach_m) return;
  if (places_.size() == kMaxPlaces) {
    for (std::size_t k = 0; k < kMaxPlaces / 2; ++k) places_[k] = places_[2 * k];
    places_.resize(kMaxPlaces / 2);
  }
  places_.push_back({p, length_m_});
}

bool DrivenWay::leads_back() const {
  for (const Place& place : places_) {
    if (length_m_ - place.way_m < kApart_m) return false;
    if ((place.p - last_).squaredNorm() < kNear_m * kNear_m) return true;
  }
  return false;
}

}  // namespace rcs::registration
