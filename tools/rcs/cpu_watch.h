#pragma once
// How much of the processor a piece of work takes.

#include "rcs/node/budget.h"

namespace rcs::tools {

/// The thread's CPU time since it was made, in whole microseconds.
class CpuWatch {
 public:
  CpuWatch() { clock_.start_cycle(); }
  /// Once.
  [[nodiscard]] double stop_ms() {
    clock_.end_cycle();
    return 1e3 * seconds(clock_.used_cpu());
  }

 private:
  StageClock clock_;
};

}  // namespace rcs::tools
