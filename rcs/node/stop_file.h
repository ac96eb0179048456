#pragma once
// The file that latches emergency stops: its existence is the latch. It lists the stops as text. An
// empty, truncated or damaged file is a stop without a name, so no failure during writing can lose
// a stop.

#include <string>
#include <vector>

#include "lcmtypes/rcs/stop_t.hpp"
#include "rcs/base/result.h"

namespace rcs {

/// Content of the file; a name of an issuer must be printable.
[[nodiscard]] std::string stop_file_text(const std::vector<stop_t>& stops);

struct LatchedStops {
  std::vector<stop_t> stops;  ///< empty: not latched
  std::string damage;         ///< why they are one stop without a name; empty: they are not
};
/// Stops latched at `path`: latched if anything exists there, or if that cannot be determined.
[[nodiscard]] LatchedStops read_stop_file(const std::string& path);

struct StopJob {
  std::string path;
  std::string text;              ///< stop_file_text(); empty: the file is to be removed
  bool only_if_missing = false;  ///< an existing file is left as it is
};
/// Creates the folder if needed, and waits until a text is on the disk; a removal takes effect
/// without waiting. Errors name the file and the cause.
Outcome execute(const StopJob& job);

/// Creates the folder of `path` if needed, waits until it is on the disk, and checks that files can
/// be created in it.
Outcome check_stop_folder(const std::string& path);
/// The same without creating anything, as far as permissions show it: whether this user can create
/// files in the folder of `path`, or the folder itself.
[[nodiscard]] Outcome examine_stop_folder(const std::string& path);
/// @return the file at `path` is on the disk
[[nodiscard]] bool sync_stop_file(const std::string& path);

/// Names come from the bus and are printed on terminals.
[[nodiscard]] std::string printable_name(std::string text);

}  // namespace rcs
