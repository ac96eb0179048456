#include "modules/sp/degrade.h"

#include <algorithm>

#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

double share(Duration d, Duration budget) { return seconds(d) / seconds(budget); }

/// The work before this scan delayed it, or facets have queued up.
bool pressed(const ScanFacts& f, const DegradeParams& p, double margin) {
  return margin * share(f.late, f.budget) >= p.late_share || margin * f.behind >= p.behind;
}

/// The lowest level that the scan's own facts require, if they were worse by `margin`.
Degrade demanded(const ScanFacts& f, const DegradeParams& p, double margin) {
  if (share(f.left, f.budget) < margin * p.hold_left) return Degrade::kHold;
  if (margin * f.behind >= p.hold_behind) return Degrade::kHold;
  const double granted = f.grant_share / margin;
  if (granted < p.grant_hold) return Degrade::kHold;
  if (granted < p.grant_prior) return Degrade::kNoPrior;
  return granted < p.grant_full ? Degrade::kFewerPoints : Degrade::kFull;
}

/// Held only because of a small grant. This can be permanent if the configuration is wrong, and a
/// vehicle that never registers a scan is worse than one that is late.
bool held_by_grant(const ScanFacts& f, const DegradeParams& p) {
  return share(f.left, f.budget) >= p.hold_left && f.behind < p.hold_behind;
}

Degrade next_level(Degrade level, int by) {
  return static_cast<Degrade>(static_cast<int>(level) + by);
}

}  // namespace

std::string_view name_of(DegradeCause cause) {
  switch (cause) {
    case DegradeCause::kLeft:
      return "too little time to the deadline";
    case DegradeCause::kBehind:
      return "the next scan is waiting";
    case DegradeCause::kGrant:
      return "less work granted than a full scan needs";
    case DegradeCause::kLate:
      return "cycle start too late";
    case DegradeCause::kNone:
      break;
  }
  return "calm";
}

DegradeCause cause_of(const ScanFacts& f, const DegradeParams& p) {
  if (share(f.left, f.budget) < p.hold_left) return DegradeCause::kLeft;
  if (f.behind >= p.behind || f.behind >= p.hold_behind) return DegradeCause::kBehind;
  if (share(f.late, f.budget) >= p.late_share) return DegradeCause::kLate;
  return f.grant_share < p.grant_full ? DegradeCause::kGrant : DegradeCause::kNone;
}

DegradeLadder step(const DegradeLadder& ladder, const ScanFacts& facts,
                   const DegradeParams& params) {
  RCS_CHECK(facts.budget > Duration::zero() && params.recover_margin >= 1.0);
  if (!params.on) return {};
  const Degrade base = std::min(ladder.level, Degrade::kNoPrior);
  Degrade wanted = demanded(facts, params, 1.0);
  if (wanted == Degrade::kHold && ladder.level == Degrade::kHold && held_by_grant(facts, params)) {
    wanted = Degrade::kNoPrior;
  }
  if (pressed(facts, params, 1.0)) {
    // A whole budget late: one level less would have been too late, too.
    const int by = facts.late >= facts.budget ? 2 : 1;
    wanted = std::max(wanted, std::min(next_level(base, by), Degrade::kNoPrior));
  }
  if (wanted > base) return {wanted, 0};

  const bool calm = demanded(facts, params, params.recover_margin) < base &&
                    !pressed(facts, params, params.recover_margin);
  if (base == Degrade::kFull || !calm) return {base, 0};
  if (ladder.calm + 1 < params.recover_after) return {base, ladder.calm + 1};
  return {next_level(base, -1), 0};
}

}  // namespace rcs::sp
