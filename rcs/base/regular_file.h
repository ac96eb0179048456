#pragma once
// Input files are opened only if they are regular files.

#include <string>

#include "rcs/base/result.h"

namespace rcs {

/// Returns an error with the path unless it names a regular file: opening a FIFO can block forever,
/// and reading a device may never end. Reports the file as an input (rcs/base/input_files.h).
[[nodiscard]] Outcome check_regular_file(const std::string& path);

}  // namespace rcs
