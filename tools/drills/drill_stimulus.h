#pragma once
// A drill's stimuli as a pure function of a stream of sensor messages: the same stream, stimuli and
// seed give the same messages.

#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// Passes on the events of another source, changed where a stimulus says so. Stimuli act in their
/// order. SIM_TRUTH is never changed.
class StimulatedSource final : public EventSource {
 public:
  /// @param source  outlives this
  /// @param seed  of what is drawn: which facets, which cells
  StimulatedSource(EventSource* source, const std::vector<Stimulus>& stimuli, std::uint64_t seed);

  [[nodiscard]] Stamp peek() override;
  void take(SourceEvent* event) override;

 private:
  struct Active {
    Stimulus stimulus;
    std::mt19937_64 random;
    int changed = 0;                  // messages
    std::optional<gps_fix_t> frozen;  // the first of the window
    std::optional<SourceEvent> held;  // waits for its successor
  };

  void read_ahead();
  void release_held();
  void pass(SourceEvent event, Stamp due);

  EventSource* source_;
  std::vector<Active> active_;
  std::optional<Stamp> begin_;  // arrival of the first sensor message: time zero of the stimuli
  std::multimap<Stamp, SourceEvent> ready_;  // of equal due in the order of their coming
};

/// The channels of a drive: the sensors' and SIM_TRUTH.
[[nodiscard]] std::vector<std::string> drive_channels();

/// @return whether `source` speaks on `channel`
[[nodiscard]] bool speaks_on(DrillSource source, std::string_view channel);

/// Source and kind of a fix's fault, at `since_s` after the stimulus began.
void change_fix(const Stimulus& s, double since_s, gps_fix_t* fix);

}  // namespace rcs::drills
