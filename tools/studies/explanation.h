#pragma once
// Why a run was as it was at one moment: what had come in, what WM made of it, what SP and BG
// answered.

#include <string>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "rcs/node/log/log_file.h"

namespace rcs::studies {

/// @param log  read from its beginning
/// @param after  the log's first message
/// @return text for people, or an error when the log ends before
[[nodiscard]] Result<std::string> why_story(LogReader* log, Duration after);

}  // namespace rcs::studies
