#include "rcs/terrain/elevation_tile.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>

#include "rcs/base/check.h"

namespace rcs {
namespace {

constexpr char kMagic[] = "RCSELEV\n";
constexpr std::size_t kMagicSize = 8;
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kCrcOffset = 12;
constexpr std::size_t kChecked = 16;  // the checksum covers the record from here on
constexpr std::size_t kHeaderSize = 116;
constexpr std::uint32_t kFlagCellSigma = 1;

std::array<std::uint32_t, 256> crc_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t c = i;
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
    table[i] = c;
  }
  return table;
}

std::uint32_t crc32(const std::uint8_t* data, std::size_t size) {
  static const std::array<std::uint32_t, 256> kTable = crc_table();
  std::uint32_t c = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < size; ++i) c = kTable[(c ^ data[i]) & 0xFFU] ^ (c >> 8U);
  return ~c;
}

template <std::size_t N>
struct UnsignedOf;
template <>
struct UnsignedOf<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOf<8> {
  using Type = std::uint64_t;
};

// Little-endian whatever the host.
template <class T>
void put(T value, std::uint8_t* out) {
  typename UnsignedOf<sizeof(T)>::Type bits = 0;
  std::memcpy(&bits, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out[i] = static_cast<std::uint8_t>(bits >> (8 * i));
  }
}

template <class T>
T take(const std::uint8_t* in) {
  using Bits = typename UnsignedOf<sizeof(T)>::Type;
  Bits bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) bits |= static_cast<Bits>(in[i]) << (8 * i);
  T value;
  std::memcpy(&value, &bits, sizeof(T));
  return value;
}

std::size_t cells(const ElevationTile& t) {
  return static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height);
}

std::vector<float> take_floats(const std::uint8_t* in, std::size_t n) {
  std::vector<float> values(n);
  for (std::size_t i = 0; i < n; ++i) values[i] = take<float>(in + 4 * i);
  return values;
}

bool side_ok(std::int64_t cells) { return cells >= 1 && cells <= kMaxTileSide; }

// One record at `in`, of which `left` bytes are there; sets *used.
Result<ElevationTile> decode_record(const std::uint8_t* in, std::size_t left, std::size_t* used) {
  if (left < kHeaderSize) return Error{"truncated: the header takes 116 bytes"};
  if (std::memcmp(in, kMagic, kMagicSize) != 0) return Error{"not an elevation tile (magic)"};
  const std::uint32_t version = take<std::uint32_t>(in + kMagicSize);
  if (version != kVersion) return Error{"version " + std::to_string(version) + ", known is 1"};

  ElevationTile t;
  t.id = take<std::int64_t>(in + 16);
  t.datum = {take<double>(in + 24), take<double>(in + 32), {take<double>(in + 40)}};
  t.undulation_m = take<double>(in + 48);
  t.origin_world_m = {take<double>(in + 56), take<double>(in + 64)};
  t.cell_m = take<double>(in + 72);
  t.sigma_m = take<double>(in + 80);
  t.bias_sigma_m = take<double>(in + 88);
  t.bias_correlation_m = take<double>(in + 96);
  const std::uint32_t width = take<std::uint32_t>(in + 104);
  const std::uint32_t height = take<std::uint32_t>(in + 108);
  const std::uint32_t flags = take<std::uint32_t>(in + 112);
  if (!side_ok(width) || !side_ok(height)) {
    return Error{"size " + std::to_string(width) + " x " + std::to_string(height) +
                 ", allowed 1 to " + std::to_string(kMaxTileSide)};
  }
  if ((flags & ~kFlagCellSigma) != 0) return Error{"unknown flags"};
  t.width = static_cast<int>(width);
  t.height = static_cast<int>(height);

  const bool has_cell_sigma = (flags & kFlagCellSigma) != 0;
  const std::size_t n = cells(t);
  const std::size_t size = kHeaderSize + n * 4 * (has_cell_sigma ? 2 : 1);
  if (left < size) {
    return Error{"truncated: " + std::to_string(width) + " x " + std::to_string(height) +
                 " cells take " + std::to_string(size) + " bytes, " + std::to_string(left) +
                 " are left"};
  }
  if (crc32(in + kChecked, size - kChecked) != take<std::uint32_t>(in + kCrcOffset)) {
    return Error{"corrupt: the checksum differs"};
  }
  t.z_world_m = take_floats(in + kHeaderSize, n);
  if (has_cell_sigma) t.cell_sigma_m = take_floats(in + kHeaderSize + 4 * n, n);
  const Outcome checked = check_tile(t);
  if (!checked) return checked.error();
  *used = size;
  return t;
}

}  // namespace

Outcome check_tile(const ElevationTile& t) {
  if (!side_ok(t.width) || !side_ok(t.height)) {
    return Error{"width and height must be 1 to " + std::to_string(kMaxTileSide)};
  }
  if (t.z_world_m.size() != cells(t)) return Error{"heights must be width x height"};
  if (!t.cell_sigma_m.empty() && t.cell_sigma_m.size() != cells(t)) {
    return Error{"sigmas of the cells must be width x height, or none"};
  }
  if (!plausible(t.datum)) return Error{"the datum is not a place on the earth"};
  if (std::isinf(t.undulation_m) || std::abs(t.undulation_m) > 120.0) {
    return Error{"undulation must be within 120 m"};
  }
  if (!(t.origin_world_m.cwiseAbs().maxCoeff() <= 1e6)) {
    return Error{"origin must be within 1000 km of the datum"};
  }
  if (!(t.cell_m >= 0.01 && t.cell_m <= 10000.0)) return Error{"cell must be 0.01 to 10000 m"};
  if (!(t.sigma_m > 0.0 && t.sigma_m <= 1000.0)) return Error{"sigma must be in (0, 1000] m"};
  if (!(t.bias_sigma_m >= 0.0 && t.bias_sigma_m <= 1000.0)) {
    return Error{"bias sigma must be in [0, 1000] m"};
  }
  if (!(t.bias_correlation_m > 0.0 && t.bias_correlation_m <= 1e7)) {
    return Error{"bias correlation must be in (0, 1e7] m"};
  }
  for (const float z : t.z_world_m) {
    if (std::abs(z) > 20000.0F) return Error{"a height is beyond 20 km"};  // NaN passes: unknown
  }
  for (const float s : t.cell_sigma_m) {
    if (!(s > 0.0F && s <= 1000.0F)) return Error{"a cell's sigma is not in (0, 1000] m"};
  }
  return Done{};
}

std::vector<std::uint8_t> encode_tile(const ElevationTile& t) {
  RCS_CHECK(check_tile(t).ok());
  const std::size_t n = cells(t);
  std::vector<std::uint8_t> out(kHeaderSize + 4 * (n + t.cell_sigma_m.size()));
  std::uint8_t* p = out.data();
  std::memcpy(p, kMagic, kMagicSize);
  put(kVersion, p + kMagicSize);
  put(t.id, p + 16);
  const double numbers[] = {
      t.datum.lat_rad,      t.datum.lon_rad,      t.datum.height.m, t.undulation_m,
      t.origin_world_m.x(), t.origin_world_m.y(), t.cell_m,         t.sigma_m,
      t.bias_sigma_m,       t.bias_correlation_m};
  for (std::size_t i = 0; i < std::size(numbers); ++i) put(numbers[i], p + 24 + 8 * i);
  put(static_cast<std::uint32_t>(t.width), p + 104);
  put(static_cast<std::uint32_t>(t.height), p + 108);
  put(t.cell_sigma_m.empty() ? 0U : kFlagCellSigma, p + 112);
  for (std::size_t i = 0; i < n; ++i) put(t.z_world_m[i], p + kHeaderSize + 4 * i);
  for (std::size_t i = 0; i < t.cell_sigma_m.size(); ++i) {
    put(t.cell_sigma_m[i], p + kHeaderSize + 4 * (n + i));
  }
  put(crc32(p + kChecked, out.size() - kChecked), p + kCrcOffset);
  return out;
}

Result<std::vector<ElevationTile>> decode_tiles(const std::vector<std::uint8_t>& bytes,
                                                const std::string& name) {
  std::vector<ElevationTile> tiles;
  std::size_t at = 0;
  do {
    std::size_t used = 0;
    Result<ElevationTile> tile = decode_record(bytes.data() + at, bytes.size() - at, &used);
    if (!tile) {
      return Error{name + ", tile " + std::to_string(tiles.size() + 1) + " at byte " +
                   std::to_string(at) + ": " + tile.error().message};
    }
    tiles.push_back(std::move(*tile));
    at += used;
  } while (at < bytes.size());
  return tiles;
}

Outcome write_tiles(const std::vector<ElevationTile>& tiles, const std::string& path) {
  for (const ElevationTile& tile : tiles) {
    const Outcome checked = check_tile(tile);
    if (!checked) return Error{path + ": not written: " + checked.error().message};
  }
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) return Error{path + ": cannot be opened for writing"};
  for (const ElevationTile& tile : tiles) {
    const std::vector<std::uint8_t> bytes = encode_tile(tile);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  file.flush();
  if (!file) return Error{path + ": write failed"};
  return Done{};
}

Outcome write_tile(const ElevationTile& tile, const std::string& path) {
  return write_tiles({tile}, path);
}

Result<std::vector<ElevationTile>> read_tiles(const std::string& path) {
  constexpr std::streamoff kMaxFile = std::streamoff{4} << 30;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
  if (size < 0) return Error{path + ": cannot be opened"};
  if (size > kMaxFile) return Error{path + ": larger than 4 GiB"};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(size));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!file) return Error{path + ": read failed"};
  return decode_tiles(bytes, path);
}

}  // namespace rcs
