#pragma once
// How much of the processor a piece of work takes.

#include "rcs/node/budget.h"

namespace rcs::studies {

/// The process's CPU time since it was made, of all its threads.
class CpuWatch {
 public:
  [[nodiscard]] double stop_ms() const { return 1e3 * seconds(process_cpu() - start_); }

 private:
  Duration start_ = process_cpu();
};

}  // namespace rcs::studies
