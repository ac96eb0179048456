#pragma once
// The way that the vehicle has driven, and whether it drives back on it.

#include <vector>

#include "rcs/base/linear.h"

namespace rcs::registration {

class DrivenWay {
 public:
  DrivenWay() { places_.reserve(kMaxPlaces); }

  void clear();
  void drive_to(const Vec3f& p);

  [[nodiscard]] float length_m() const { return length_m_; }
  /// The newest position is one at which the vehicle was before it drove away and came back.
  [[nodiscard]] bool leads_back() const;

 private:
  // 20 km; then each second place is kept.
  static constexpr std::size_t kMaxPlaces = 10'000;
  static constexpr float kEach_m = 2.0F;

  struct Place {
    Vec3f p;
    float way_m;
  };
  std::vector<Place> places_;
  Vec3f last_ = Vec3f::Zero();
  float length_m_ = 0.0F;
  bool begun_ = false;
};

}  // namespace rcs::registration
