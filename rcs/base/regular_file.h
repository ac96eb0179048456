#pragma once
// Files from outside are opened only if they are files.

#include <string>

#include "rcs/base/result.h"

namespace rcs {

/// An error, with the path, unless it names a regular file: a FIFO would be waited for without an
/// end, and a device may never end.
[[nodiscard]] Outcome check_regular_file(const std::string& path);

}  // namespace rcs
