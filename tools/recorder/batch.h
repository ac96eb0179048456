#pragma once
// Records (events of a log, or lines of the audit log) that are stored together.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::recorder {

struct Batch {
  std::vector<std::uint8_t> bytes;
  std::vector<std::size_t> ends;  ///< of each record, in `bytes`; ascending
  Stamp stamp;                    ///< wall clock of the first record

  [[nodiscard]] bool empty() const { return ends.empty(); }
  [[nodiscard]] std::size_t begin_of(std::size_t record) const {
    return record == 0 ? 0 : ends[record - 1];
  }
  /// Keeps the buffers.
  void clear() {
    bytes.clear();
    ends.clear();
  }
};

}  // namespace rcs::recorder
