#pragma once
// The stimuli of a drill as a pure function of a stream of sensor messages: the same stream,
// stimuli and seed give the same messages.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/timeline/lockstep_timeline.h"
#include "tools/drills/drill_content.h"

namespace rcs::drills {

/// Passes on the events of another source, changed by the stimuli in their order. SIM_TRUTH is
/// never changed.
class StimulatedSource final : public EventSource {
 public:
  /// @param source  must outlive this
  /// @param seed  of the random facets and cells
  StimulatedSource(EventSource* source, const std::vector<Stimulus>& stimuli, std::uint64_t seed);

  [[nodiscard]] Stamp peek() override;
  void take(SourceEvent* event) override;

 private:
  struct Active {
    Stimulus stimulus;
    ContentState content;
    std::optional<SourceEvent> held;  // waits for its successor
  };

  void read_ahead();
  void release_held();
  void pass(SourceEvent event, Stamp due);

  EventSource* source_;
  std::vector<Active> active_;
  std::optional<Stamp> begin_;  // arrival of the first sensor message: zero of the stimulus times
  std::multimap<Stamp, SourceEvent> ready_;  // equal due times in the order of arrival
};

/// The channels of a drive: the sensor channels and SIM_TRUTH.
[[nodiscard]] std::vector<std::string> drive_channels();

}  // namespace rcs::drills
