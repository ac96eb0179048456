#pragma once
// Deterministic time for replay, simulation and tests: events of a source and messages of a
// LocalBus drive the nodes, as fast as they can, in one thread.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/node/bus/local_bus.h"
#include "rcs/node/timeline/timeline.h"

namespace rcs {

/// A message from outside the nodes. Reused from one take() to the next: no allocation once warm.
struct SourceEvent {
  std::string channel;
  std::vector<std::uint8_t> data;
};

/// What happens outside the nodes: the sensors of a simulation, the events of a log.
class EventSource {
 public:
  EventSource() = default;
  EventSource(const EventSource&) = delete;
  EventSource& operator=(const EventSource&) = delete;
  virtual ~EventSource() = default;

  /// When the next event is due; Stamp::max() at the end. Repeatable.
  [[nodiscard]] virtual Stamp peek() = 0;
  /// The event that peek() announced.
  virtual void take(SourceEvent* event) = 0;
};

/// The tail of a replay: long enough for the results of the last scan, and shorter than the
/// 200 ms of silence that the nodes would report as lost sensors. The end of a log is no fault.
constexpr Duration kReplayTail = std::chrono::milliseconds(150);

/// What a node publishes in a cycle that starts at t becomes visible at t + nominal_compute, and
/// the node is busy until then. Events of equal due: the nodes' messages first, then the source.
class LockstepTimeline final : public Timeline {
 public:
  /// @param tail  time that goes on after the source's last event, so that work under way is
  ///              finished; what is still in the queue then is delivered at its own due
  LockstepTimeline(LocalBus* bus, EventSource* source, Duration tail);

  [[nodiscard]] Stamp now() const override { return now_; }
  Step advance(Stamp until) override;
  void begin_cycle(Duration nominal_compute) override;
  Stamp end_cycle() override;

  /// Source events due before the time already reached: delivered at once, and counted here.
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
