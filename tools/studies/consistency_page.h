#pragma once
// What `rcs consistency` found as one self-contained page.

#include <string>

#include "tools/studies/consistency_output.h"

namespace rcs::studies {

/// @param vehicle  the configuration's path
[[nodiscard]] std::string consistency_page(const ConsistencyReport& report,
                                           const std::string& vehicle);

}  // namespace rcs::studies
