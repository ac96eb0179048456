#pragma once
// Records of a .bin of KITTI: x, y, z, intensity as float32.

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"

namespace rcs::tools {

constexpr std::size_t kKittiRecordBytes = 4 * sizeof(float);

/// @param name  errors begin with it
/// @return an error if the file is empty, text, or not a whole number of records
[[nodiscard]] Outcome check_kitti_bin(const std::vector<std::uint8_t>& bytes,
                                      std::string_view name);

}  // namespace rcs::tools
