#pragma once
// The top-level tables of a vehicle's configuration. Each program reads its own tables and ignores
// the others; a name that is not listed here is an error in the file for every program.

#include <algorithm>
#include <string>
#include <vector>

namespace rcs {

/// All tables except `own`, which the caller reads: those that ParamFile::finish() must ignore.
[[nodiscard]] inline std::vector<std::string> tables_but(const std::vector<std::string>& own) {
  std::vector<std::string> others;
  for (const char* const table :
       {"vehicle", "world", "start", "ladar", "ins", "gps", "odometry", "sp", "wm", "bg", "mission",
        "gateway", "ros2_bridge", "up", "process", "budget"}) {
    if (std::find(own.begin(), own.end(), table) == own.end()) others.emplace_back(table);
  }
  return others;
}

}  // namespace rcs
