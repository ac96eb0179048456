#include "rcs/base/byte_codec.h"

#include <array>

namespace rcs {
namespace {

// Sliced by eight: tables[k][b] is the checksum of byte b followed by k zeros.
using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

Tables make_tables() {
  Tables t{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
    t[0][i] = c;
  }
  for (std::size_t k = 1; k < t.size(); ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      t[k][i] = (t[k - 1][i] >> 8U) ^ t[0][t[k - 1][i] & 0xFFU];
    }
  }
  return t;
}

}  // namespace

std::uint32_t crc32(const std::uint8_t* data, std::size_t size, std::uint32_t before) {
  static const Tables kTables = make_tables();
  const Tables& t = kTables;
  std::uint32_t c = ~before;
  std::size_t i = 0;
  for (; i + 8 <= size; i += 8) {
    const std::uint32_t low = c ^ wire::take<std::uint32_t>(data + i);
    const std::uint32_t high = wire::take<std::uint32_t>(data + i + 4);
    c = t[7][low & 0xFFU] ^ t[6][(low >> 8U) & 0xFFU] ^ t[5][(low >> 16U) & 0xFFU] ^
        t[4][low >> 24U] ^ t[3][high & 0xFFU] ^ t[2][(high >> 8U) & 0xFFU] ^
        t[1][(high >> 16U) & 0xFFU] ^ t[0][high >> 24U];
  }
  for (; i < size; ++i) c = t[0][(c ^ data[i]) & 0xFFU] ^ (c >> 8U);
  return ~c;
}

}  // namespace rcs
