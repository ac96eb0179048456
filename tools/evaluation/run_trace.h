#pragma once
// What a run published of its speed and its protection levels, and the configuration of its nodes.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::evaluation {

/// Protection levels of WM and their alert limits; infinite: none is known.
struct ProtectionRecord {
  Stamp stamp;
  double horizontal_m = 0.0;
  double vertical_m = 0.0;
  double limit_horizontal_m = 0.0;
  double limit_vertical_m = 0.0;
};

struct SpeedRecord {
  Stamp stamp;
  double speed_mps = 0.0;  ///< by WM
};

struct RunTrace {
  std::vector<ProtectionRecord> protection;  ///< in the order of the log
  std::vector<SpeedRecord> speed;            ///< at most 10 a second, stamps ascending
  /// Path and hash of each configuration that *_PROCESS messages name; empty: the log has none, as
  /// that of a replay.
  std::string configuration;
};

/// @param log  path
/// @return an error if the log cannot be read
[[nodiscard]] Result<RunTrace> read_trace(const std::string& log);

}  // namespace rcs::evaluation
