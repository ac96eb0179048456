#include "tools/rcs/vehicle/up_recorder.h"

#include "rcs/node/stop_latch.h"

namespace rcs::cli {

Result<ProcessCommand> recorder_command(const std::string& folder, const ParamFile& file,
                                        const std::string& lcm_url) {
  std::string chosen = folder;
  if (chosen.empty()) {
    const Result<std::string> state = state_folder(file);
    if (!state) return state.error();
    if (state->empty()) {
      return Error{file.name() +
                   ": no folder to record to: give --record FOLDER, or set [process] "
                   "state_directory"};
    }
    chosen = *state + "/recordings";
  }
  return ProcessCommand{"rcs", {"record", chosen, "--lcm-url", lcm_url}};
}

}  // namespace rcs::cli
