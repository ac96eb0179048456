#pragma once
// How much of the work on a scan is left out so that its deadline is kept: decided before the work
// begins, from facts of the timeline only, so that a replay decides alike.

#include "rcs/base/stamp.h"

namespace rcs::sp {

/// What is left out. Each level leaves out what the one before it does, and more.
/// The order is that of registration_t::degrade_level.
enum class Degrade : int {
  kFull = 0,
  kFewerPoints = 1,  ///< coarser sampling of what is registered
  kNoPrior = 2,      ///< and no match to the a priori map
  kHold = 3,         ///< this scan is answered without a registration
};

/// Spans are in shares of the budget, from a scan's last facet to the end of the work on it.
struct DegradeParams {
  bool on = true;               ///< false: always in full
  double coarser = 1.5;         ///< source voxels of a degraded scan, in those of a full one
  double late_share = 0.8;      ///< a later start of a cycle degrades by one level
  double behind = 0.25;         ///< so does so much of the next scan that waits already
  double hold_behind = 0.5;     ///< and with so much of it waiting the scan is held
  double hold_left = 0.25;      ///< held when less of the budget is left
  double grant_full = 1.0;      ///< less of the nominal need granted: fewer points
  double grant_prior = 0.6;     ///< likewise: no a priori match
  double grant_hold = 0.2;      ///< likewise: held, but never twice in a row
  double recover_margin = 1.5;  ///< a scan is calm when facts so much worse would do
  int recover_after = 20;       ///< calm scans in a row that lead one level back
};

/// What the timeline says when a scan is about to be worked on.
struct ScanFacts {
  Duration budget{};    ///< > 0
  Duration late{};      ///< worst start of a cycle after its wakeup, since the last scan: a facet
                        ///< that comes while a scan is registered waits as long as that takes
  Duration left{};      ///< to the scan's deadline; negative: it has passed
  double behind = 0.0;  ///< facets that wait behind this scan, in scans
  double grant_share = 1e9;  ///< work units granted, in those that a full scan needs nominally
};

struct DegradeLadder {
  Degrade level = Degrade::kFull;  ///< of the scan in hand
  int calm = 0;                    ///< scans in a row for which the level below would have done
};

/// The ladder for the next scan. It goes up at once, and down by one level after recover_after calm
/// scans. A hold is for one scan: the next is tried without the a priori match, unless its own
/// facts forbid. Pure.
[[nodiscard]] DegradeLadder step(const DegradeLadder& ladder, const ScanFacts& facts,
                                 const DegradeParams& params);

}  // namespace rcs::sp
