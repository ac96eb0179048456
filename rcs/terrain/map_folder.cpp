#include "rcs/terrain/map_folder.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "rcs/base/byte_codec.h"
#include "rcs/base/regular_file.h"
#include "rcs/terrain/map_tile.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxIndexBytes = std::size_t{1} << 28;

}  // namespace

std::string index_file(const std::string& map) { return map + "/map.index"; }

std::string tile_file(const std::string& map, double cell_m, Cell tile) {
  std::array<char, 80> name{};
  std::snprintf(name.data(), name.size(), "/%gm/%d_%d.tile", cell_m, tile.i, tile.j);
  return map + name.data();
}

Outcome read_file(const std::string& path, std::size_t most, std::vector<std::uint8_t>* bytes) {
  if (Outcome checked = check_regular_file(path); !checked) return checked;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file ? static_cast<std::streamoff>(file.tellg()) : -1;
  if (size < 0) return Error{path + ": cannot be opened"};
  if (static_cast<std::size_t>(size) > most) {
    return Error{path + ": larger than " + std::to_string(most) + " bytes"};
  }
  bytes->resize(static_cast<std::size_t>(size));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes->data()), size);
  if (!file) return Error{path + ": read failed"};
  return Done{};
}

Result<Raster> read_tile(const std::string& file, Cell tile, std::uint64_t lattice,
                         std::vector<std::uint8_t>* buffer) {
  if (Outcome bytes = read_file(file, kMaxTileBytes, buffer); !bytes) return bytes.error();
  Result<Raster> raster = decode_tile(buffer->data(), buffer->size(), lattice);
  if (!raster) return Error{file + ": " + raster.error().message};
  if (!(tile_of(raster->first) == tile)) {
    return Error{file + ": contains tile " + std::to_string(tile_of(raster->first).i) + ", " +
                 std::to_string(tile_of(raster->first).j)};
  }
  return raster;
}

MapFolder::MapFolder(std::string path, MapIndex index)
    : path_(std::move(path)), index_(std::move(index)) {
  for (const MapLevelIndex& level : index_.levels) {
    lattices_.push_back(lattice_id(index_.frame, level.level));
  }
}

Result<MapFolder> MapFolder::open(const std::string& path) {
  const std::string file = index_file(path);
  std::error_code error;
  if (!fs::exists(file, error)) {
    return Error{path + ": not a map: a folder with map.index is expected"};
  }
  std::vector<std::uint8_t> bytes;
  if (Outcome read = read_file(file, kMaxIndexBytes, &bytes); !read) return read.error();
  Result<MapIndex> index = decode_index(bytes);
  if (!index) return Error{file + ": " + index.error().message};
  return MapFolder(path, std::move(index).value());
}

std::string MapFolder::file_of(int level, Cell tile) const {
  return tile_file(path_, index_.levels[static_cast<std::size_t>(level)].level.cell_m, tile);
}

Result<Raster> MapFolder::read(int level, Cell tile, std::vector<std::uint8_t>* buffer) const {
  const std::string file = file_of(level, tile);
  Result<Raster> raster = read_tile(file, tile, lattices_[static_cast<std::size_t>(level)], buffer);
  const MapTileEntry* const entry = index_.levels[static_cast<std::size_t>(level)].find(tile);
  // A tile that somebody has changed may be sound and wrong.
  if (raster && (entry == nullptr || crc32(buffer->data(), buffer->size()) != entry->checksum)) {
    return Error{file + ": is not the file of the map's index (its checksum differs)"};
  }
  return raster;
}

}  // namespace rcs
