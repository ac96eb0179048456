#pragma once
// Deterministic time for replay, simulation and tests: events of a source and messages of a
// LocalBus drive the nodes in one thread, as fast as possible.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/node/bus/local_bus.h"
#include "rcs/node/timeline/timeline.h"

namespace rcs {

/// A message from outside the nodes. Reused by take(): no allocation after warm-up.
struct SourceEvent {
  std::string channel;  ///< empty: nothing arrives
  std::vector<std::uint8_t> data;
};

/// Events from outside the nodes: the sensors of a simulation, the events of a log.
class EventSource {
 public:
  EventSource() = default;
  EventSource(const EventSource&) = delete;
  EventSource& operator=(const EventSource&) = delete;
  virtual ~EventSource() = default;

  /// Due time of the next event; Stamp::max() at the end. Repeatable.
  [[nodiscard]] virtual Stamp peek() = 0;
  /// Returns the event whose due time peek() returned.
  virtual void take(SourceEvent* event) = 0;
};

/// The tail of a replay: long enough for the results of the last scan, and shorter than the 200 ms
/// of silence after which the nodes report lost sensors. The end of a log is not a fault.
constexpr Duration kReplayTail = std::chrono::milliseconds(150);

/// Messages that a node publishes in a cycle that starts at t are delivered from t +
/// nominal_compute on, and the node is busy until then. At equal due times: the nodes' messages
/// first, then the source.
class LockstepTimeline final : public Timeline {
 public:
  /// @param tail  time after the source's last event, in which work in progress is completed;
  ///              messages still queued at its end are delivered at their own due time
  LockstepTimeline(LocalBus* bus, EventSource* source, Duration tail);

  [[nodiscard]] Stamp now() const override { return now_; }
  Step advance(Stamp until) override;
  void begin_cycle(Duration nominal_compute) override;
  Stamp end_cycle() override;

  /// Source events due before the current time: delivered at once, and counted here.
  [[nodiscard]] std::int64_t stepped_back() const { return stepped_back_; }

 private:
  void move_to(Stamp t);
  void deliver_from_source(Stamp due);

  LocalBus* bus_;
  EventSource* source_;
  Duration tail_;
  Stamp now_;
  Stamp end_;  // of the tail, as far as the source has been read
  Stamp busy_until_;
  SourceEvent event_;
  std::int64_t stepped_back_ = 0;
};

}  // namespace rcs
