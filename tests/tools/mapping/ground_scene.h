#pragma once
// A vehicle that drives past various objects above the ground, its LADAR at 2 m.

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::test {

struct GroundScene {
  double noise_m = 0.02;     ///< of ranges
  double look_m = 0.0;       ///< error of the pose's height, changes every half second
  double shift_m = 0.0;      ///< error of the whole run
  Vec3 turn = Vec3::Zero();  ///< misalignment of the LADAR
  bool things = true;

  struct Shot {
    Vec3 p;          ///< by the poses of the run, in the map's frame
    Vec3 p_vehicle;  ///< as the LADAR measured it
    Vec3 from;
    Pose T_map_vehicle;
    double range_m = 0.0;
    Stamp stamp;
    std::uint32_t scan = 0;
  };

  [[nodiscard]] static double ground(double x, double y) { return 0.08 * x + 0.05 * y; }
  static constexpr double kLength_m = 40.0;
  // In y the scene is -12 to 12 m wide, and by x there are:
  [[nodiscard]] static bool in_grass(double x, double y) { return x > 4 && x < 12 && y > 2; }
  [[nodiscard]] static bool in_hedge(double x, double y) { return x > 14 && x < 16.4 && y < -5; }
  [[nodiscard]] static bool under_roof(double x, double y) { return x > 20 && x < 26 && y > 3; }
  [[nodiscard]] static bool on_road(double, double y) { return y > -4 && y < -2; }

  /// All returns of the LADAR. A car stands on the road for a second and then leaves.
  [[nodiscard]] std::vector<Shot> drive() const {
    std::vector<Shot> shots;
    std::mt19937 rng(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform;
    std::uint32_t scan = 0;
    double look_off = 0.0;
    for (double t = 0.0; t < 10.0; t += 0.1, ++scan) {
      if (scan % 5 == 0) look_off = look_m * normal(rng);
      const double x = -8.0 + 5.0 * t;
      Shot s;
      s.scan = scan;
      s.stamp = Stamp(from_seconds(100.0 + t));
      const Pose T_true{exp_so3(Vec3(0.02 * std::sin(t), 0.02 * std::cos(1.3 * t), 0.1)),
                        Vec3(x, 0.0, ground(x, 0.0) + 2.0)};
      s.T_map_vehicle = T_true;
      s.T_map_vehicle.p.z() += look_off + shift_m;
      s.from = s.T_map_vehicle.p;
      const Pose T_true_ladar = T_true * Pose{exp_so3(turn), Vec3::Zero()};
      for (int row = 0; row < 28; ++row) {
        for (int col = 0; col < 120; ++col) {
          const double down = radians(3.0 + row * 1.1 + 0.5 * uniform(rng));
          const double side = radians(-80.0 + 1.33 * (col + uniform(rng)));
          const Vec3 d_ladar(std::cos(down) * std::cos(side), std::cos(down) * std::sin(side),
                             -std::sin(down));
          const double range = cast(T_true_ladar.p, T_true_ladar.q * d_ladar, t, &rng);
          if (range > 30.0) continue;
          s.range_m = range + noise_m * normal(rng);
          s.p_vehicle = s.range_m * d_ladar;
          s.p = s.T_map_vehicle * s.p_vehicle;
          shots.push_back(s);
        }
      }
    }
    return shots;
  }

 private:
  [[nodiscard]] double cast(const Vec3& from, const Vec3& d, double t, std::mt19937* rng) const {
    std::uniform_real_distribution<double> uniform;
    constexpr double kStep_m = 0.05;
    const double high = from.z() - ground(from.x(), from.y());
    const double fall = ground(d.x(), d.y()) - d.z();  // per metre: the ground is a plane
    const double to_ground = fall > 0.0 ? high / fall : std::numeric_limits<double>::max();
    if (!things) return to_ground;
    // Free path in grass: 1 m; the hedge is opaque.
    double left = -std::log(1.0 - uniform(*rng));
    for (double r = 0.5; r < std::min(30.0, to_ground); r += kStep_m) {
      const Vec3 p = from + r * d;
      const double above = high - fall * r;
      if (in_grass(p.x(), p.y()) && above < 0.3) left -= kStep_m;
      if (in_hedge(p.x(), p.y()) && above < 1.0) left -= 4.0 * kStep_m;
      if (left < 0.0) return r;
      if (under_roof(p.x(), p.y()) && above > 1.6 && above < 1.8) return r;
      const bool crown = (p - Vec3(30.0, -7.0, ground(30.0, -7.0) + 2.2)).norm() < 1.2;
      if (crown && uniform(*rng) < kStep_m) return r;
      const bool car = t > 4.0 && t < 5.0 && p.x() > 18 && p.x() < 22 && on_road(p.x(), p.y());
      if (car && above < 1.5) return r;
    }
    return to_ground;
  }
};

}  // namespace rcs::test
