#pragma once
// Real time: CLOCK_MONOTONIC in microseconds, shared by all processes of one computer.

#include <cstdint>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/timeline/timeline.h"

namespace rcs {

/// The computer's wall clock, which may be set. Used only for the waiting time of messages, because
/// LCM stamps them with it (LcmBus::deliver_one), for stamps that other systems read or write
/// (modules/ros2_bridge), and for the validity of keys (modules/gateway).
[[nodiscard]] std::int64_t wall_utime();

/// Ctrl-C and SIGTERM as a descriptor. Create it first: threads started later inherit the mask.
class StopSignals {
 public:
  StopSignals();  ///< @throws std::system_error: out of descriptors
  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  FileHandle fd_;
};

/// Waits by epoll on LCM's descriptor, an absolute timer and the stop signals.
class LiveTimeline final : public Timeline {
 public:
  /// Deliveries in a row while a cycle is due: enough to empty the bus after a stall, few enough
  /// that a flood of messages cannot starve the nodes.
  static constexpr int kMaxBurst = 1000;

  /// @throws std::system_error: out of descriptors
  LiveTimeline(LcmBus* bus, const StopSignals* stop);

  [[nodiscard]] Stamp now() const override;
  Step advance(Stamp until) override;
  void begin_cycle(Duration /*nominal_compute*/) override {}
  Stamp end_cycle() override { return now(); }

 private:
  void arm(Stamp until);

  LcmBus* bus_;
  const StopSignals* stop_;
  FileHandle epoll_;
  FileHandle timer_;
  Stamp armed_ = Stamp::max();  // max: the timer is off
  int burst_ = 0;
};

}  // namespace rcs
