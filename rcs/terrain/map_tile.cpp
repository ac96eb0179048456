#include "rcs/terrain/map_tile.h"

#include <cstring>

#include "rcs/base/byte_codec.h"
#include "rcs/base/check.h"

namespace rcs {
namespace {

constexpr char kMagic[] = "RCSTILE\n";
constexpr std::size_t kMagicSize = 8;
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kVersionWithPoints = 2;
constexpr std::size_t kCrcOffset = 12;
constexpr std::size_t kChecked = 16;  // the checksum covers the record from here on
constexpr std::size_t kHeaderSize = 88;
constexpr std::size_t kCountSize = 4;  // of the points
constexpr std::uint32_t kSigma = 1;
constexpr std::uint32_t kCount = 2;
constexpr std::uint32_t kDate = 4;
constexpr std::uint32_t kSource = 8;

std::size_t size_of(std::uint32_t flags) {
  const std::size_t cell = 4 + ((flags & kSigma) != 0 ? 4 : 0) + ((flags & kCount) != 0 ? 2 : 0) +
                           ((flags & kDate) != 0 ? 2 : 0) + ((flags & kSource) != 0 ? 1 : 0);
  return kHeaderSize + kTileCells * cell;
}

template <class T>
std::uint8_t* put_layer(const std::vector<T>& layer, std::uint8_t* out) {
  for (const T& value : layer) {
    wire::put(value, out);
    out += sizeof(T);
  }
  return out;
}

template <class T>
const std::uint8_t* take_layer(const std::uint8_t* in, std::vector<T>* layer) {
  layer->resize(kTileCells);
  for (T& value : *layer) {
    value = wire::take<T>(in);
    in += sizeof(T);
  }
  return in;
}

void put_points(const std::vector<SurfacePoint>& points, std::uint8_t* out) {
  wire::put(static_cast<std::uint32_t>(points.size()), out);
  out += kCountSize;
  for (const SurfacePoint& p : points) {
    for (const float v :
         {p.p_m.x(), p.p_m.y(), p.p_m.z(), p.normal.x(), p.normal.y(), p.normal.z(), p.sigma_m}) {
      wire::put(v, out);
      out += sizeof(float);
    }
  }
}

void take_points(const std::uint8_t* in, std::size_t n, std::vector<SurfacePoint>* points) {
  points->resize(n);
  for (SurfacePoint& p : *points) {
    const auto at = [in](std::size_t k) { return wire::take<float>(in + sizeof(float) * k); };
    p = {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}, at(6)};
    in += kSurfacePointBytes;
  }
}

}  // namespace

std::vector<std::uint8_t> encode_tile(const Raster& t, std::uint64_t lattice) {
  RCS_CHECK(t.width == kTileSide && t.height == kTileSide);
  RCS_CHECK(t.points.size() <= kMaxSurfacePoints);
  const Cell tile = tile_of(t.first);
  RCS_CHECK(first_cell(tile) == t.first);
  const std::uint32_t flags = (t.sigma_m.size() > 1 ? kSigma : 0) |
                              (t.count.size() > 1 ? kCount : 0) | (t.date.size() > 1 ? kDate : 0) |
                              (t.source.size() > 1 ? kSource : 0);
  const std::size_t cells = size_of(flags);
  const bool points = !t.points.empty();
  std::vector<std::uint8_t> out(cells +
                                (points ? kCountSize + kSurfacePointBytes * t.points.size() : 0));
  std::uint8_t* p = out.data();
  std::memcpy(p, kMagic, kMagicSize);
  wire::put(points ? kVersionWithPoints : kVersion, p + kMagicSize);
  wire::put(lattice, p + 16);
  wire::put(static_cast<std::int32_t>(tile.i), p + 24);
  wire::put(static_cast<std::int32_t>(tile.j), p + 28);
  const double numbers[] = {t.level.cell_m, t.level.origin_m.x(), t.level.origin_m.y(),
                            t.level.bias_sigma_m, t.level.bias_correlation_m};
  for (std::size_t i = 0; i < std::size(numbers); ++i) wire::put(numbers[i], p + 32 + 8 * i);
  wire::put(flags, p + 72);
  wire::put(t.sigma_m.front(), p + 76);
  wire::put(t.count.front(), p + 80);
  wire::put(t.date.front(), p + 82);
  wire::put(t.source.front(), p + 84);
  std::uint8_t* layer = put_layer(t.z_m, p + kHeaderSize);
  if ((flags & kSigma) != 0) layer = put_layer(t.sigma_m, layer);
  if ((flags & kCount) != 0) layer = put_layer(t.count, layer);
  if ((flags & kDate) != 0) layer = put_layer(t.date, layer);
  if ((flags & kSource) != 0) put_layer(t.source, layer);
  if (points) put_points(t.points, p + cells);
  wire::put(crc32(p + kChecked, out.size() - kChecked), p + kCrcOffset);
  return out;
}

Result<Raster> decode_tile(const std::uint8_t* in, std::size_t size, std::uint64_t lattice) {
  if (size < kHeaderSize) {
    return Error{"truncated: the header of a tile has " + std::to_string(kHeaderSize) + " bytes, " +
                 std::to_string(size) + " were found"};
  }
  if (std::memcmp(in, kMagic, kMagicSize) != 0) return Error{"not a map's tile (magic)"};
  const auto version = wire::take<std::uint32_t>(in + kMagicSize);
  if (version != kVersion && version != kVersionWithPoints) {
    return Error{"version " + std::to_string(version) + ", known are 1 and 2"};
  }
  const auto flags = wire::take<std::uint32_t>(in + 72);
  if (flags > (kSigma | kCount | kDate | kSource)) return Error{"unknown flags"};
  const std::size_t cells = size_of(flags);
  std::size_t due = cells;
  std::size_t points = 0;
  if (version == kVersionWithPoints) {
    due += kCountSize;
    if (size >= due) points = wire::take<std::uint32_t>(in + cells);
    if (size >= due && (points == 0 || points > kMaxSurfacePoints)) {
      return Error{"has " + std::to_string(points) + " surface points, 1 to " +
                   std::to_string(kMaxSurfacePoints) + " are allowed"};
    }
    due += kSurfacePointBytes * points;
  }
  if (size != due) {
    return Error{(size < due ? "truncated: " : "too long: ") + std::to_string(due) +
                 " bytes expected, " + std::to_string(size) + " found"};
  }
  if (crc32(in + kChecked, size - kChecked) != wire::take<std::uint32_t>(in + kCrcOffset)) {
    return Error{"corrupt: the checksum differs"};
  }
  if (wire::take<std::uint64_t>(in + 16) != lattice) {
    return Error{"a tile of another map: its datum, heights or lattice differ"};
  }
  Raster t;
  t.level.cell_m = wire::take<double>(in + 32);
  t.level.origin_m = {wire::take<double>(in + 40), wire::take<double>(in + 48)};
  t.level.bias_sigma_m = wire::take<double>(in + 56);
  t.level.bias_correlation_m = wire::take<double>(in + 64);
  const Cell tile{wire::take<std::int32_t>(in + 24), wire::take<std::int32_t>(in + 28)};
  if (!plausible_tile(tile)) return Error{"a tile's number is beyond 2^22"};
  t.first = first_cell(tile);
  t.width = t.height = kTileSide;
  t.sigma_m = {wire::take<float>(in + 76)};
  t.count = {wire::take<std::uint16_t>(in + 80)};
  t.date = {wire::take<std::uint16_t>(in + 82)};
  t.source = {wire::take<CellSource>(in + 84)};
  const std::uint8_t* layer = take_layer(in + kHeaderSize, &t.z_m);
  if ((flags & kSigma) != 0) layer = take_layer(layer, &t.sigma_m);
  if ((flags & kCount) != 0) layer = take_layer(layer, &t.count);
  if ((flags & kDate) != 0) layer = take_layer(layer, &t.date);
  if ((flags & kSource) != 0) take_layer(layer, &t.source);
  if (points > 0) take_points(in + cells + kCountSize, points, &t.points);
  const Outcome checked = check_raster(t);
  if (!checked) return checked.error();
  return t;
}

}  // namespace rcs
