#pragma once
// How much larger the errors of the LADAR are than its registrations and the model of the rolling
// map state, measured against INS, wheels and GPS. In high grass the factor is up to ten.

#include <algorithm>
#include <array>
#include <cstddef>

#include "modules/wm/measurement_models.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// Factors of standard deviations, >= 1.
struct LadarScale {
  double position = 1.0;
  double rotation = 1.0;
};

/// The registration with the information of its scaled covariance.
[[nodiscard]] inline RollingMatch scaled(RollingMatch z, const LadarScale& scale) {
  Vec6 weight;
  weight << Vec3::Constant(1.0 / scale.position), Vec3::Constant(1.0 / scale.rotation);
  z.information = weight.asDiagonal() * z.information * weight.asDiagonal();
  z.observed_scale *= std::max(scale.position, scale.rotation);
  return z;
}

/// A direction that the scan observes is still observed with larger errors, if less well.
[[nodiscard]] inline RegistrationParams params_of(const RollingMatch& z,
                                                  RegistrationParams params) {
  params.observed_sigma_m *= z.observed_scale;
  return params;
}

/// The scales by time.
class LadarScales {
 public:
  /// @param begin  of the inputs that the scale applies to, increasing
  void add(Stamp begin, const LadarScale& scale) {
    entries_[count_++ % entries_.size()] = {begin, scale};
  }
  [[nodiscard]] LadarScale at(Stamp stamp) const {
    for (std::size_t k = 1; k <= std::min(count_, entries_.size()); ++k) {
      const Entry& e = entries_[(count_ - k) % entries_.size()];
      if (e.begin <= stamp) return e.scale;
    }
    return {};
  }

 private:
  struct Entry {
    Stamp begin = Stamp::min();
    LadarScale scale;
  };
  std::array<Entry, 64> entries_{};
  std::size_t count_ = 0;
};

}  // namespace rcs::wm
