#include "modules/sp/scan/scan_repetition.h"

#include <cstring>

namespace rcs::sp {
namespace {

constexpr std::size_t kFewest = 50;  // points; less can be equal by chance
constexpr std::size_t kStride = 7;   // enough to tell scans apart, and cheap for 10^5 points

std::uint64_t bits_of(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

}  // namespace

bool ScanRepetition::repeats(const Points& points) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;  // FNV-1a, a coordinate at a time
  for (std::size_t k = 0; k < points.size(); k += kStride) {
    for (int i = 0; i < 3; ++i) hash = (hash ^ bits_of(points[k][i])) * 0x100000001B3ULL;
  }
  const bool same = points.size() >= kFewest && points.size() == points_ && hash == hash_;
  points_ = points.size();
  hash_ = hash;
  return same;
}

}  // namespace rcs::sp
