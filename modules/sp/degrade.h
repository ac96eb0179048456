#pragma once
// Degrade levels: the work on a scan that is left out to meet its deadline. The level is decided
// before the work begins, from facts of the timeline only, so that a replay decides the same.

#include <string_view>

#include "rcs/base/stamp.h"

namespace rcs::sp {

/// What is left out. Each level includes what the level before it leaves out.
/// The order is that of registration_t::degrade_level.
enum class Degrade : int {
  kFull = 0,
  kFewerPoints = 1,  ///< coarser sampling of the registered points
  kNoPrior = 2,      ///< and no match to the a priori map
  kHold = 3,         ///< no registration: the prediction is published
};

/// Durations are shares of the budget, from a scan's last facet to the end of the work on it.
struct DegradeParams {
  bool on = true;               ///< false: always the full work
  double coarser = 1.5;         ///< voxel edge of a degraded scan, in those of a full one
  double late_share = 0.8;      ///< a later start of a cycle degrades by one level
  double behind = 0.25;         ///< as does this share of the next scan waiting already
  double hold_behind = 0.5;     ///< with this share of it waiting, the scan is held
  double hold_left = 0.25;      ///< with less of the budget left, the scan is held
  double grant_full = 1.0;      ///< with less of the nominal need granted: fewer points
  double grant_prior = 0.6;     ///< likewise: no match to the a priori map
  double grant_hold = 0.2;      ///< likewise: held, but never twice in a row
  double recover_margin = 1.5;  ///< a scan is calm if facts worse by this factor need no more
  int recover_after = 20;       ///< calm scans in a row after which the level falls by one
};

/// Facts of the timeline when the work on a scan begins.
struct ScanFacts {
  Duration budget{};    ///< > 0
  Duration late{};      ///< largest delay of a cycle's start after its wakeup since the last scan:
                        ///< a facet that arrives during a registration waits for its end
  Duration left{};      ///< to the scan's deadline; negative: it has passed
  double behind = 0.0;  ///< facets that wait after this scan, in scans
  double grant_share = 1e9;  ///< granted work units over the nominal need of a full scan
};

struct DegradeLadder {
  Degrade level = Degrade::kFull;  ///< of the current scan
  int calm = 0;                    ///< scans in a row for which the level below would suffice
};

/// The limit that a scan exceeds.
enum class DegradeCause { kNone, kLeft, kBehind, kGrant, kLate };

[[nodiscard]] std::string_view name_of(DegradeCause cause);
/// The limit for which the level rises; kNone: the facts require the full work.
[[nodiscard]] DegradeCause cause_of(const ScanFacts& facts, const DegradeParams& params);

/// The ladder for the next scan. It rises at once, and falls by one level after recover_after calm
/// scans. A hold is for one scan: the next is processed without the match to the a priori map,
/// unless its own facts require a hold. Pure.
[[nodiscard]] DegradeLadder step(const DegradeLadder& ladder, const ScanFacts& facts,
                                 const DegradeParams& params);

}  // namespace rcs::sp
