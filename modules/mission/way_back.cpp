#include "modules/mission/way_back.h"

#include <limits>

namespace rcs::mission {
namespace {

// Two passes of the same place, on a loop or where the vehicle has backed: the vehicle, which is
// wider, has driven over all ground between them.
constexpr double kSamePlace_m = 1.0;
constexpr std::size_t kMaxInPart = 4000;

}  // namespace

double WayBack::distance_m(const Breadcrumb& a, const Breadcrumb& b) {
  if (a.epoch >= 0 && a.epoch == b.epoch) return (a.p_rolling - b.p_rolling).norm();
  if (a.in_world && b.in_world) return (a.p_world - b.p_world).norm();
  return std::numeric_limits<double>::infinity();
}

void WayBack::note(const Breadcrumb& here) {
  if (here.epoch < 0 && !here.in_world) return;
  // The vehicle has driven back without notes: the rest of the way out is not behind it.
  if (returns_) cut(here);
  returns_ = false;
  if (!crumbs_.empty() && distance_m(crumbs_.back(), here) < kEach_m) return;
  if (crumbs_.size() == kMaxCrumbs) {
    for (std::size_t k = 0; k < kMaxCrumbs / 2; ++k) crumbs_[k] = crumbs_[2 * k];
    crumbs_.resize(kMaxCrumbs / 2);
  }
  crumbs_.push_back(here);
}

WayPart WayBack::first_part(std::int32_t epoch) const {
  WayPart part;
  if (crumbs_.empty()) return part;
  std::size_t at = crumbs_.size() - 1;
  part.rolling = epoch >= 0 && crumbs_[at].epoch == epoch;
  part.epoch = part.rolling ? epoch : -1;
  while (part.places.size() < kMaxInPart) {
    const Breadcrumb& here = crumbs_[at];
    if (part.rolling ? here.epoch != epoch : !here.in_world) break;
    part.places.push_back(part.rolling ? here.p_rolling : here.p_world);
    part.to_the_start = at == 0;
    if (at == 0) break;
    // The oldest pass of this place cuts off all loops between.
    std::size_t next = at - 1;
    for (std::size_t older = 0; older + 1 < at; ++older) {
      if (distance_m(crumbs_[older], here) > kSamePlace_m) continue;
      next = older;
      // Of two passes of the same place one is enough.
      if (distance_m(crumbs_[older], here) < 0.5 * kEach_m) part.places.pop_back();
      break;
    }
    at = next;
  }
  return part;
}

void WayBack::move_world(const Pose& T_now_before) {
  for (Breadcrumb& c : crumbs_) {
    if (c.in_world) c.p_world = T_now_before * c.p_world;
  }
}

double WayBack::begin_return(const Breadcrumb& here) {
  returns_ = true;
  return cut(here);
}

double WayBack::cut(const Breadcrumb& here) {
  double nearest = std::numeric_limits<double>::infinity();
  std::size_t at = 0;
  for (std::size_t k = 0; k < crumbs_.size(); ++k) {
    const double d = distance_m(crumbs_[k], here);
    if (d > nearest) continue;
    nearest = d;
    at = k;
  }
  if (nearest < std::numeric_limits<double>::infinity()) crumbs_.resize(at + 1);
  return nearest;
}

}  // namespace rcs::mission
