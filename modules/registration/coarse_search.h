#pragma once
// Coarse search: registers points to the distributions of a WideMap, the largest voxels first.

#include <vector>

#include "modules/registration/coarse_ndt_map.h"
#include "modules/registration/registration.h"
#include "rcs/base/points.h"

namespace rcs::registration {

struct WideParams {
  int points = 800;  ///< of the scan that are used, approximately, [100, 100000]
  /// Squared distance, in sigmas, at which the weight is 1/4, [1, 1000]. Chosen on frames 5, 15,
  /// 25, ... of the KITTI drive.
  double robust = 27.0;
  int max_iterations = 40;  ///< at each of the two largest sizes, [1, 1000]
};

/// Gauss-Newton descents of one scan on one map, with Geman-McClure weights.
class Descent {
 public:
  /// @param source_vehicle  in the sensor's density: the near ground, which has most of the points,
  ///        stabilizes height, roll and pitch while the other directions converge
  Descent(Points source_vehicle, const WideMap* map, double robust);

  /// @param level  of the map
  /// @param most   iterations
  void descend(std::size_t level, int most, Pose* T_target_vehicle);
  /// Mean weight of the points, [0, 1].
  [[nodiscard]] double score(std::size_t level, const Pose& T_target_vehicle);

  [[nodiscard]] int iterations() const { return iterations_; }  ///< of all descents
  [[nodiscard]] WorkUnits used() const { return used_; }

 private:
  struct Match {
    Vec3f asked;
    const WideMap::Gaussian* gaussian;
  };
  struct Sums {
    Mat6 H;
    Vec6 b;
    double weight = 0.0;
    int pairs = 0;
  };
  Sums sum(std::size_t level, const Pose& T);
  void forget_matches();

  Points source_;
  const WideMap* map_;
  double robust_;
  std::vector<Match> matches_;
  std::size_t level_ = 0;  // of the matches
  int iterations_ = 0;
  WorkUnits used_ = 0;
};

struct WideAnswer {
  Pose T_target_vehicle;
  double score = 0.0;  ///< Descent::score() at the finest of the sizes
  int iterations = 0;
  WorkUnits used = 0;
};

/// Two descents from the same guess, one from the largest voxel size and one from the finest: with
/// little overlap, structure in only one of the two misleads the largest. Returns the one that
/// explains more of the scan.
[[nodiscard]] WideAnswer search_wide(const Points& source_vehicle, const WideMap& map,
                                     const Pose& guess, const WideParams& params);

}  // namespace rcs::registration
