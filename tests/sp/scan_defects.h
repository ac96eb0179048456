#pragma once
// Pairs of simulated scans with known motion, and their defects: gross outliers, an occluded part,
// moving objects, data that the model does not cover.

#include <random>
#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "sim/scenario.h"

namespace rcs::test {

/// The LADAR with which a place is scanned.
enum class Scanner {
  kImager,   ///< Demo III's: 32 x 180 cells over 20 x 90 deg ahead
  kSpinning  ///< all around, of about twice as many points
};

struct ScanPlace {
  std::string name;
  Scanner scanner = Scanner::kImager;
  sim::WorldParams world;
};

/// Terrains of the reference scenario's kind, each by both scanners.
[[nodiscard]] std::vector<ScanPlace> scan_places(const sim::Scenario& reference);

/// Scans of one place by a vehicle at rest, each in the frame of its LADAR.
struct KnownPair {
  Points model;
  Points data;
  Pose T_model_data;  ///< true
};

/// @param count  number of sites on the terrain, `apart_m` from model to data
[[nodiscard]] std::vector<KnownPair> known_pairs(const ScanPlace& place,
                                                 const sim::Scenario& reference, double apart_m,
                                                 int count);

/// A `share` of the data is replaced by points anywhere in its bounding box.
void add_outliers(double share, std::mt19937* rng, KnownPair* pair);

/// A `share` of the data is missing: to the left or to the right, by azimuth.
void occlude(double share, std::mt19937* rng, KnownPair* pair);

/// A `share` of the data is objects that have moved: each a twentieth of the scan, of adjacent
/// points, by 0.5 to 2 m in any level direction.
void move_objects(double share, std::mt19937* rng, KnownPair* pair);

/// A `share` of the data is outside of the model: it ends at an azimuth, to the left or right.
void crop_model(double share, std::mt19937* rng, KnownPair* pair);

}  // namespace rcs::test
