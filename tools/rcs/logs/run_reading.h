#pragma once
// Reads the log of a run with a progress bar and Ctrl-C.

#include <string>
#include <string_view>

#include "tools/rcs/terminal.h"
#include "tools/recording/run_log.h"

namespace rcs::cli {

/// @param command  label of the progress bar
inline Result<recording::RunLog> read_run(std::string_view command, const std::string& path) {
  const InterruptGuard interrupt;
  Progress progress(command, Progress::kSteps);
  return recording::read_run(path, [&](double share) {
    progress.at_share(share);
    return !interrupt.requested();
  });
}

}  // namespace rcs::cli
