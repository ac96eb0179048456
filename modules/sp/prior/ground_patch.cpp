#include "modules/sp/prior/ground_patch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace rcs::sp {
namespace {

constexpr int kSide = 256;  // slots along each axis
// A point from a range larger by this factor does not replace a nearer one, even if it is lower:
// the error by the tilt grows with the range.
constexpr float kFarther = 1.5F;
// A point from a range smaller by this factor replaces the other even if it is higher.
constexpr float kNearer = 0.6F;

std::uint64_t scattered(const GroundCell& c) {
  std::uint64_t h = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.i)) << 32U) |
                    static_cast<std::uint32_t>(c.j);
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;  // splitmix64
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
  return h ^ (h >> 31U);
}

}  // namespace

GroundPatch::GroundPatch(const GroundPatchParams& params)
    : params_(params), slots_(static_cast<std::size_t>(kSide) * kSide) {}

void GroundPatch::clear() { std::fill(slots_.begin(), slots_.end(), GroundCell{}); }

void GroundPatch::add(const Points& lowest_vehicle, const Pose& T_level_vehicle, double way_m) {
  const Mat3f R = T_level_vehicle.rotation().cast<float>();
  const Vec3f t = T_level_vehicle.p.cast<float>();
  const auto reach_m = static_cast<float>(params_.reach_m);
  const auto cell_m = static_cast<float>(params_.cell_m);
  const auto way = static_cast<float>(way_m);
  for (std::size_t k = 0; k < lowest_vehicle.size(); ++k) {
    const float range_m = lowest_vehicle[k].norm();
    if (!(range_m < reach_m)) continue;
    const Vec3f p = R * lowest_vehicle[k] + t;
    const auto i = static_cast<std::int32_t>(std::floor(p.x() / cell_m));
    const auto j = static_cast<std::int32_t>(std::floor(p.y() / cell_m));
    GroundCell& slot = slots_[static_cast<std::size_t>((j & (kSide - 1)) * kSide) +
                              static_cast<std::size_t>(i & (kSide - 1))];
    if (slot.first_way_m < 0.0F || slot.i != i || slot.j != j) {
      slot = {p, range_m, way, way, i, j};
      continue;
    }
    slot.last_way_m = way;
    const bool lower = p.z() < slot.p_level.z() && range_m < kFarther * slot.range_m;
    if (!lower && range_m >= kNearer * slot.range_m) continue;
    slot.p_level = p;
    slot.range_m = std::min(range_m, slot.range_m);
  }
}

void GroundPatch::gather(double first_way_m, double last_way_m,
                         std::vector<GroundCell>* out) const {
  out->clear();
  for (const GroundCell& c : slots_) {
    if (c.first_way_m >= 0.0F && c.first_way_m >= first_way_m && c.last_way_m >= last_way_m) {
      out->push_back(c);
    }
  }
  std::sort(out->begin(), out->end(),
            [](const GroundCell& a, const GroundCell& b) { return scattered(a) < scattered(b); });
}

}  // namespace rcs::sp
