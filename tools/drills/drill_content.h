#pragma once
// Stimuli that change the content of one sensor message: wrong values, stamps, empty or frozen
// facets. Everything else, such as a loss or a delay, is in drill_stimulus.h.

#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// What a stimulus remembers from message to message.
struct ContentState {
  std::mt19937_64 random;
  int changed = 0;  ///< messages
  /// First content of the window by channel and facet (frozen).
  std::map<std::pair<std::string, int>, std::vector<std::uint8_t>> first;
};

/// Applies a stimulus that changes the content; the others and messages that cannot be decoded pass
/// unchanged.
/// @param since_s  time after the begin of the stimulus
void change_content(const Stimulus& s, double since_s, ContentState* state, SourceEvent* event);

/// @return whether `source` publishes on `channel`
[[nodiscard]] bool publishes_on(DrillSource source, std::string_view channel);

/// The fault of a fix.
void change_fix(const Stimulus& s, double since_s, gps_fix_t* fix);

}  // namespace rcs::drills
