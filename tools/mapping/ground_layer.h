#pragma once
// Estimates the height of the ground from a distribution of heights.

#include <array>
#include <cstdint>
#include <optional>

namespace rcs::mapping {

/// Heights of returns above a surface, by weight, in layers of 2 cm from -0.5 m to 0.78 m.
struct HeightCounts {
  static constexpr int kLayers = 64;
  static constexpr double kLayer_m = 0.02;
  static constexpr double kLowest_m = -0.5;
  std::array<std::uint16_t, kLayers> weight{};
  std::uint16_t returns = 0;

  [[nodiscard]] static constexpr double middle_m(int layer) {
    return kLowest_m + (layer + 0.5) * kLayer_m;
  }
  /// @param weight  [1, 255]
  /// @return false for a height that is out of range
  bool add(double above_m, int weight);
};

/// The ground in a mixture of returns: N(above_m, sigma_m) is the ground, returns above it
/// (permeable grass) are distributed uniformly.
struct GroundLayer {
  double above_m = 0.0;
  double sigma_m = 0.0;  ///< of a return of the ground
  double share = 1.0;    ///< share of ground in the returns near it, [0.02, 1)

  /// Probability that a return is of the ground, [0, 1].
  [[nodiscard]] double is_ground(double height_m) const;
};

/// The lowest mode of the returns, by the EM algorithm for the mixture (Dempster, Laird and Rubin
/// 1977), starting at the lowest maximum of their density with a sufficient share of them.
/// @param weight  HeightCounts::kLayers sums
/// @param least  minimum weight of the ground
[[nodiscard]] std::optional<GroundLayer> find_ground(
    const std::array<double, HeightCounts::kLayers>& weight, double least);

}  // namespace rcs::mapping
