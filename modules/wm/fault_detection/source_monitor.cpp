#include "modules/wm/fault_detection/source_monitor.h"

#include <algorithm>

namespace rcs::wm {

SourceState next_state(SourceState state, const SourceFacts& facts) {
  if (facts.excluded) return facts.agrees ? SourceState::kReadmitting : SourceState::kExcluded;
  const SourceState fused = facts.contradicted ? SourceState::kSuspect : SourceState::kUsed;
  switch (state) {
    case SourceState::kUsed:
    case SourceState::kSuspect:
      return fused;
    case SourceState::kExcluded:
    case SourceState::kReadmitting:
      return facts.readmitted ? SourceState::kProbation : fused;
    case SourceState::kProbation:
      return facts.watched ? SourceState::kProbation : fused;
  }
  return fused;
}

void SourceMonitor::exclude(Stamp now) {
  wait_ = recently_readmitted(now) ? std::min<Duration>(2 * wait_, kLongestWait) : kAgrees;
  excluded_ = now;
}

void SourceMonitor::step(bool excluded, bool contradicted, bool agrees, Stamp now) {
  const bool readmitted = readmitted_ == now;
  state_ = next_state(state_, {excluded, contradicted, agrees, readmitted, on_probation(now)});
}

}  // namespace rcs::wm
