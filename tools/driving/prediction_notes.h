#pragma once
// The uncertainty that WM predicted for the chosen routes of a closed-loop drive, against the one
// that it states there.

#include <deque>
#include <optional>
#include <vector>

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "rcs/node/bus/tap.h"

namespace rcs::driving {

struct PredictionOutcome {
  /// One each second on a route that was chosen without GPS, while GPS is lost: standard deviation
  /// that WM states there, worst horizontal direction, over the predicted one. Sorted.
  std::vector<double> ratios;
  /// Largest standard deviation that WM stated on these routes, and that was predicted for them
  /// [m].
  double stated_max_m = 0.0;
  double predicted_max_m = 0.0;
};

/// Records a run from its bus.
class PredictionNotes {
 public:
  explicit PredictionNotes(Bus* bus);
  [[nodiscard]] PredictionOutcome outcome() const;

 private:
  void accept(const path_uncertainty_t& m);
  void accept(const routes_t& m);
  void accept(const nav_state_t& m);

  PredictionOutcome outcome_;
  std::deque<path_uncertainty_t> answers_;      // the newest ones
  std::optional<path_uncertainty_t> of_route_;  // that is driven
  std::int64_t noted_utime_ = 0;
  Tap<path_uncertainty_t> predictions_;
  Tap<routes_t> routes_;
  Tap<nav_state_t> nav_states_;
};

/// Share of the ratios within [0.5, 2]; 1: there are none.
[[nodiscard]] double share_predicted(const std::vector<double>& sorted_ratios);

}  // namespace rcs::driving
