#pragma once
// Sensor noise: one stream for each sensor, so that the noise of a sensor does not depend on
// others.

#include <cmath>
#include <cstdint>
#include <random>

#include "rcs/base/linear.h"
#include "sim/base/hash.h"

namespace rcs::sim {

/// Streams of the seed of a scenario.
enum class Stream : std::uint64_t {
  kLadar = 1,
  kInertial = 2,
  kGps = 3,
  kOdometry = 4,
  kMap = 5,
  kCourse = 6,
  kHazards = 7,
  kActors = 8,
  kLosses = 9
};

class Random {
 public:
  Random(std::uint64_t seed, Stream stream)
      : engine_(mix(mix(seed) + static_cast<std::uint64_t>(stream))) {}

  double normal() { return normal_(engine_); }
  double uniform() { return uniform_(engine_); }
  std::uint64_t bits() { return engine_(); }
  Vec3 normal3() {
    const double x = normal();
    const double y = normal();
    return {x, y, normal()};
  }
  Vec3 direction() { return normal3().normalized(); }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

/// First-order Gauss-Markov process of three independent axes: correlation exp(-dt / tau).
class GaussMarkov {
 public:
  GaussMarkov(double sigma, double tau, Random* random)
      : sigma_(sigma), tau_(tau), value_(sigma * random->normal3()) {}

  const Vec3& step(double dt, Random* random) {
    const double keep = std::exp(-dt / tau_);
    value_ = keep * value_ + sigma_ * std::sqrt(1.0 - keep * keep) * random->normal3();
    return value_;
  }
  [[nodiscard]] const Vec3& value() const { return value_; }

 private:
  double sigma_;
  double tau_;
  Vec3 value_;
};

}  // namespace rcs::sim
