#pragma once
// Where a scan lies in a map when next to nothing is known of it: many starts, of which the good
// ones are followed further. Beside it, for comparison, simulated annealing around an iterative
// registration, which Madhavan and Messina propose as further work.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "modules/registration/coarse_search.h"

namespace rcs::registration {

/// Calls work(k) for all k < count, in any order, or at once.
using ForAll = std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;

struct GlobalParams {
  double radius_m = 10.0;  ///< the guess is off by so much at most, level; [0, 100]
  double tilt_rad = 0.61;  ///< and may be rolled and pitched by about so much; 0: not; [0, 1.5]
  int headings = 12;       ///< starts of a turn, [1, 72]
  int around = 6;          ///< places around the guess, [0, 36]
  int points = 200;        ///< of the scan while there are many hypotheses, [50, 100000]
  int followed = 12;       ///< best of the starts that are looked at with all points, [1, 100]
  int ranked = 4;          ///< best of these that are answered, [1, 100]
  /// Descents beside each other, [1, 64]; the answer is the same to the bit. For more than one a
  /// caller gives the threads, by `for_all`.
  int threads = 1;
  ForAll for_all;
  double apart_m = 1.0;      ///< hypotheses nearer than this,
  double apart_rad = 0.087;  ///< and turned by less, are one
};

struct Hypothesis {
  Pose T_target_vehicle;
  double score = 0.0;  ///< Descent::score() at the finest size
};

/// Deterministic, and done in pieces: for beside the hard cycle.
class GlobalSearch {
 public:
  /// @param map  outlives the search
  GlobalSearch(const Points& source_vehicle, const WideMap* map, const Pose& guess,
               const GlobalParams& params, const WideParams& wide);

  /// Goes on until the grant is used up (by one start of each thread more, at most) or everything
  /// is done.
  /// @return true when done
  bool go_on(WorkUnits granted);

  /// Distinct ones, the best first; once it is done.
  [[nodiscard]] const std::vector<Hypothesis>& ranked() const { return hypotheses_; }
  [[nodiscard]] std::size_t starts() const { return starts_.size(); }
  [[nodiscard]] WorkUnits used() const;

 private:
  void start(Descent* coarse, std::size_t k);
  void follow(Descent* fine, std::size_t k);
  /// As many calls of work() as there are threads, and work still to be done.
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

/// Sorts by score and keeps the best of those that are one.
void keep_distinct(const GlobalParams& params, std::size_t most, std::vector<Hypothesis>* list);

struct AnnealParams {
  int moves = 400;              ///< [1, 100000]
  double sigma_m = 4.0;         ///< of a move, level, while it is hot, [0.01, 100]
  double sigma_rad = 1.0;       ///< of its heading, [0, 3.2]
  double tilt_sigma_rad = 0.2;  ///< of its roll and pitch, [0, 1.5]
  double hot = 0.05;            ///< temperature at the start, in score, [1e-6, 1]
  double cold = 0.002;          ///< and at the end
  std::uint32_t seed = 1;
};

/// Each move is a random one and a short descent; worse ones are taken as Metropolis does.
/// @param used  work units; null: not asked
[[nodiscard]] Hypothesis anneal(const Points& source_vehicle, const WideMap& map, const Pose& guess,
                                const AnnealParams& params, const GlobalParams& global,
                                const WideParams& wide, WorkUnits* used);

}  // namespace rcs::registration
