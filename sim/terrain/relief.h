#pragma once
// The bare ground: the surface of a DEM, if there is one, plus fractal relief by seed, plus
// features and roads of the scenario.

#include <cstdint>
#include <vector>

#include "sim/terrain/dem.h"
#include "sim/terrain/feature.h"
#include "sim/terrain/road.h"

namespace rcs::sim {

/// Relief of one scale: a uniform cubic B-spline through white noise on a square lattice.
struct Octave {
  double spacing_m = 1.0;  ///< of the lattice; hills are about three spacings apart
  double rms_m = 0.0;      ///< root mean square of the height
};

/// Height of the bare ground in frame world [m]; twice continuously differentiable (once where a
/// DEM is used), except at features.
class Relief {
 public:
  /// @param dem  its centre is put at x = y = 0, its mean height at z = 0; width 0: none
  Relief(std::uint64_t seed, std::vector<Octave> octaves, Dem dem,
         std::vector<Feature> features = {}, std::vector<Road> roads = {});

  [[nodiscard]] double height(double x_m, double y_m) const;

  /// Heights on a lattice, x fastest: z(i, j) at ((i0 + i) * step_m, (j0 + j) * step_m). Points
  /// that two calls share are bit-identical.
  void fill(std::int64_t i0, std::int64_t j0, double step_m, int width, int height,
            std::vector<float>* z_m) const;

  /// A smooth unit-variance field, about Gaussian, for objects that grow in patches.
  [[nodiscard]] static double field(std::uint64_t seed, double spacing_m, double x_m, double y_m);
  /// The same on a lattice as in fill(); with equal signs, but not bit-identical.
  static void fill_field(std::uint64_t seed, double spacing_m, std::int64_t i0, std::int64_t j0,
                         double step_m, int side, std::vector<float>* values);

  [[nodiscard]] const std::vector<Feature>& features() const { return features_; }
  [[nodiscard]] const std::vector<Road>& roads() const { return roads_; }

 private:
  [[nodiscard]] double dem_height(double x_m, double y_m) const;
  [[nodiscard]] double octave_height(std::size_t octave, double x_m, double y_m) const;
  /// relief_share() of each road on a lattice as in fill(); empty: the road does not reach it.
  [[nodiscard]] std::vector<std::vector<float>> road_shares(std::int64_t i0, std::int64_t j0,
                                                            double step_m, int width,
                                                            int height) const;
  /// Adds one octave on a lattice, see fill().
  void add_octave(std::size_t octave, std::int64_t i0, std::int64_t j0, double step_m, int width,
                  int height, std::vector<float>* z_m) const;

  std::uint64_t seed_;
  std::vector<Octave> octaves_;
  Dem dem_;
  std::vector<Feature> features_;
  std::vector<Road> roads_;
};

}  // namespace rcs::sim
