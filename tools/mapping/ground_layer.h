#pragma once
// Which of the heights that are seen in a place is the ground's.

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

/// The ground in a mixture of returns: N(above_m, sigma_m) is the ground, what is above it
/// (grass, which lets some of the light through) is spread evenly.
struct GroundLayer {
  double above_m = 0.0;
  double sigma_m = 0.0;  ///< of a return of the ground
  double share = 1.0;    ///< of the returns near the ground that are the ground's, [0.02, 1)

  /// How surely a return is one of the ground, [0, 1].
  [[nodiscard]] double is_ground(double height_m) const;
};

/// The lowest height that returns gather at, by the EM algorithm for the mixture (Dempster, Laird
/// and Rubin 1977) from the lowest maximum of their density that holds a fair share of them.
/// @param weight  HeightCounts::kLayers sums
/// @param least  weight that a ground has at least
[[nodiscard]] std::optional<GroundLayer> find_ground(
    const std::array<double, HeightCounts::kLayers>& weight, double least);

}  // namespace rcs::mapping
