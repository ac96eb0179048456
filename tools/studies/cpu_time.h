#pragma once
// CPU time of a piece of work.

#include "rcs/node/budget.h"

namespace rcs::studies {

/// CPU time of all threads of the process since the construction of this object.
class CpuWatch {
 public:
  [[nodiscard]] double stop_ms() const { return 1e3 * seconds(process_cpu() - start_); }

 private:
  Duration start_ = process_cpu();
};

}  // namespace rcs::studies
