#pragma once
// The results of `rcs consistency` as one self-contained HTML page.

#include <string>

#include "tools/studies/consistency_output.h"

namespace rcs::studies {

/// @param vehicle  path of the configuration
[[nodiscard]] std::string consistency_page(const ConsistencyReport& report,
                                           const std::string& vehicle);

}  // namespace rcs::studies
