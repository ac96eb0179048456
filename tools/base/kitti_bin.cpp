#include "tools/base/kitti_bin.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::tools {
namespace {

/// Floats of coordinates are not printable over this length.
constexpr std::size_t kLook = 512;

bool is_text(const std::vector<std::uint8_t>& bytes) {
  const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(std::min(kLook, bytes.size()));
  return std::all_of(bytes.begin(), end, [](std::uint8_t c) {
    return (c >= 0x20 && c < 0x7f) || c == '\n' || c == '\r' || c == '\t';
  });
}

}  // namespace

Outcome check_kitti_bin(const std::vector<std::uint8_t>& bytes, std::string_view name) {
  constexpr std::string_view kExpected =
      "expected the binary records of KITTI, 16 bytes each (x, y, z, intensity as float32)";
  if (bytes.empty()) return Error{fmt::format("{}: the file is empty; {}", name, kExpected)};
  if (is_text(bytes)) {
    return Error{fmt::format("{}: the file is text; {}; the name of a text file ends in .xyz", name,
                             kExpected)};
  }
  if (const std::size_t rest = bytes.size() % kKittiRecordBytes; rest != 0) {
    return Error{fmt::format("{}: {} bytes are {} records and {} bytes; {}", name, bytes.size(),
                             bytes.size() / kKittiRecordBytes, rest, kExpected)};
  }
  return Done{};
}

}  // namespace rcs::tools
