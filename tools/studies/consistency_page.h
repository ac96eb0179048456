#pragma once
// The results of `rcs consistency` as one self-contained HTML page.

#include <string>

#include "tools/report/html_page.h"
#include "tools/studies/consistency_output.h"

namespace rcs::studies {

[[nodiscard]] std::string consistency_page(const ConsistencyReport& report,
                                           const report::PageOrigin& origin);

}  // namespace rcs::studies
