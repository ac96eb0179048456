#pragma once

#include <string_view>

namespace rcs::report {

/// plot.js: values under the pointer, and zoom, for all plots of a page. It contains no data.
[[nodiscard]] std::string_view plot_script();

}  // namespace rcs::report
