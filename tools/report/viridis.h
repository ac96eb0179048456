#pragma once

#include <array>
#include <string_view>

namespace rcs::report {

/// Viridis (van der Walt and Smith 2015) at eight equal steps: perceptually uniform, also in grey.
inline constexpr std::array<std::string_view, 8> kViridis = {
    "#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"};

}  // namespace rcs::report
