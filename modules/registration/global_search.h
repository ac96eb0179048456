#pragma once
// Global search: the pose of a scan in a map with almost no prior knowledge, from many starts of
// which the best are refined. For comparison, simulated annealing around an iterative registration,
// which Madhavan and Messina propose as further work.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "modules/registration/coarse_search.h"

namespace rcs::registration {

/// Calls work(k) for all k < count, in any order, or concurrently.
using ForAll = std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;

struct GlobalParams {
  double radius_m = 10.0;  ///< largest horizontal error of the guess; [0, 100]
  double tilt_rad = 0.61;  ///< approximate largest roll and pitch error; 0: none; [0, 1.5]
  int headings = 12;       ///< start headings in a full turn, [1, 72]
  int around = 6;          ///< start positions around the guess, [0, 36]
  int points = 200;        ///< of the scan while there are many hypotheses, [50, 100000]
  int followed = 12;       ///< best starts that are refined with all points, [1, 100]
  int ranked = 4;          ///< best of these that are returned, [1, 100]
  /// Concurrent descents, [1, 64]; the result is bitwise the same. For more than one, the caller
  /// provides the threads by `for_all`.
  int threads = 1;
  ForAll for_all;
  double apart_m = 1.0;      ///< hypotheses nearer than this,
  double apart_rad = 0.087;  ///< and turned by less, count as one
};

struct Hypothesis {
  Pose T_target_vehicle;
  double score = 0.0;  ///< Descent::score() at the finest size
};

/// Deterministic, and executed in pieces: for use outside of the hard cycle.
class GlobalSearch {
 public:
  /// @param map  outlives the search
  GlobalSearch(const Points& source_vehicle, const WideMap* map, const Pose& guess,
               const GlobalParams& params, const WideParams& wide);

  /// Continues until the grant is used up (exceeded by one start of each thread at most) or the
  /// search is complete.
  /// @return true if complete
  bool go_on(WorkUnits granted);

  /// Distinct hypotheses, the best first; valid once the search is complete.
  [[nodiscard]] const std::vector<Hypothesis>& ranked() const { return hypotheses_; }
  [[nodiscard]] std::size_t starts() const { return starts_.size(); }
  [[nodiscard]] WorkUnits used() const;

 private:
  void start(Descent* coarse, std::size_t k);
  void follow(Descent* fine, std::size_t k);
  /// Concurrent calls of work(), as many as there are threads and tasks left.
  std::size_t beside_each_other(std::size_t left, const std::function<void(std::size_t)>& work);

  GlobalParams params_;
  std::vector<Descent> coarse_;  // of each thread
  std::vector<Descent> fine_;
  std::vector<Pose> starts_;
  std::vector<Hypothesis> hypotheses_;
  std::size_t started_ = 0;   // starts that have become hypotheses
  std::size_t followed_ = 0;  // hypotheses that were followed
  bool is_done_ = false;
};

/// Sorts by score and keeps the best of those that count as one.
void keep_distinct(const GlobalParams& params, std::size_t most, std::vector<Hypothesis>* list);

struct AnnealParams {
  int moves = 400;              ///< [1, 100000]
  double sigma_m = 4.0;         ///< of a horizontal move, while it is hot, [0.01, 100]
  double sigma_rad = 1.0;       ///< of its heading, [0, 3.2]
  double tilt_sigma_rad = 0.2;  ///< of its roll and pitch, [0, 1.5]
  double hot = 0.05;            ///< temperature at the start, in score, [1e-6, 1]
  double cold = 0.002;          ///< and at the end
  std::uint32_t seed = 1;
};

/// Each move is a random one and a short descent; worse ones are accepted by Metropolis' rule.
/// @param used  work units; may be null
[[nodiscard]] Hypothesis anneal(const Points& source_vehicle, const WideMap& map, const Pose& guess,
                                const AnnealParams& params, const GlobalParams& global,
                                const WideParams& wide, WorkUnits* used);

}  // namespace rcs::registration
