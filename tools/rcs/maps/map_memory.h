#pragma once

namespace rcs::cli {

/// A whole a priori map is read into memory up to this size.
inline constexpr double kMapMemory_bytes = 4e9;

}  // namespace rcs::cli
