#pragma once
// The top-level tables of a vehicle's configuration. Each program reads its own and leaves the rest
// alone; a name that is not here is a mistake in the file, whoever reads it.

#include <algorithm>
#include <string>
#include <vector>

namespace rcs {

/// All but those that the caller reads itself: what ParamFile::finish() is to pass over.
[[nodiscard]] inline std::vector<std::string> tables_but(const std::vector<std::string>& own) {
  std::vector<std::string> others;
  for (const char* const table : {"vehicle", "world", "start", "ladar", "ins", "gps", "odometry",
                                  "sp", "wm", "bg", "gateway", "up", "process", "budget"}) {
    if (std::find(own.begin(), own.end(), table) == own.end()) others.emplace_back(table);
  }
  return others;
}

}  // namespace rcs
