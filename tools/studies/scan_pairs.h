#pragma once
// Pairs of scans with known motion and trials on them: the data sets of Table 1 of the paper
// (Madhavan and Messina), and guesses with a given error.

#include <map>
#include <random>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::studies {

struct ScanPair {
  int model = 0;  ///< numbers of the scans
  int data = 0;
  Pose T_model_data;  ///< true, or the reference
};

/// Consecutive pairs, and pairs of scans that are 20 apart.
struct ScanSet {
  std::map<int, Points> scans;  ///< by number, each in the frame of its LADAR
  std::vector<ScanPair> pairs;
};

struct Trial {
  ScanPair pair;
  Pose guess;  ///< initial T_model_data
};

/// Rows of Table 1. #2 and #3 start with an error typical of navigation: 0.3 m and 1 deg.
enum class DataSet {
  kConsecutive = 1,  ///< guess: identity
  kTwentyApart = 2,
  kMovedBy1m = 3,          ///< #2, and 1 m more along each axis
  kTurnedAndMovedBy3m = 4  ///< #1, with +-10 deg of yaw and +-3 m along each axis
};
constexpr int kApart = 20;

/// Error of a guess.
struct Offset {
  double m = 0.0;
  double rad = 0.0;
};

/// Uniform direction and axis, exact magnitude.
[[nodiscard]] Pose random_offset(const Offset& offset, std::mt19937* rng);

/// @param seeds  trials of each pair; one in #1, at most 16 in #4
[[nodiscard]] std::vector<Trial> trials_of(DataSet set, const std::vector<ScanPair>& pairs,
                                           int seeds);

/// Basin of convergence: consecutive pairs, guesses with the error `offset`.
[[nodiscard]] std::vector<Trial> basin_trials(const std::vector<ScanPair>& pairs,
                                              const Offset& offset, int seeds);

/// Guesses for a global search: consecutive pairs, any heading, uniform in a level disc around the
/// truth, rolled and pitched by up to `tilt_rad` each.
[[nodiscard]] std::vector<Trial> global_trials(const std::vector<ScanPair>& pairs, double radius_m,
                                               double tilt_rad, int seeds);

[[nodiscard]] Offset error_of(const Pose& truth, const Pose& answer);

/// True for an error below 0.1 m and 0.5 deg.
[[nodiscard]] bool is_success(const Offset& error);

}  // namespace rcs::studies
