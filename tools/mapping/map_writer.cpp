#include "tools/mapping/map_writer.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <system_error>

#include "rcs/base/byte_codec.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tools/mapping/coarser.h"

namespace rcs::mapping {
namespace {

namespace fs = std::filesystem;

constexpr double kThin_m = 0.1;  // points of a tile that has too many

Outcome write_file(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) return Error{path + ": cannot be opened for writing"};
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.flush();
  if (!file) return Error{path + ": write failed (is the disk full?)"};
  return Done{};
}

MapTileEntry entry_of(const Raster& tile, const std::vector<std::uint8_t>& bytes) {
  MapTileEntry e;
  e.tile = tile_of(tile.first);
  e.points = static_cast<std::uint32_t>(tile.points.size());
  e.checksum = crc32(bytes.data(), bytes.size());
  e.low_m = std::numeric_limits<float>::max();
  e.high_m = std::numeric_limits<float>::lowest();
  for (const float z : tile.z_m) {
    if (std::isnan(z)) continue;
    ++e.known;
    e.low_m = std::min(e.low_m, z);
    e.high_m = std::max(e.high_m, z);
  }
  return e;
}

/// True for names that tile_file() returns.
bool is_level_name(const std::string& name) {
  std::array<char, 40> made{};
  std::snprintf(made.data(), made.size(), "%gm", std::strtod(name.c_str(), nullptr));
  return name == made.data();
}

bool is_tile_name(const std::string& name) {
  char* end = nullptr;
  const auto i = std::strtol(name.c_str(), &end, 10);
  if (*end != '_') return false;
  const auto j = std::strtol(end + 1, nullptr, 10);
  return name == std::to_string(i) + "_" + std::to_string(j) + ".tile";
}

/// @param depth  below the folder of the map
bool is_part_of_map(const fs::directory_entry& entry, int depth) {
  std::error_code error;
  const fs::file_status status = entry.symlink_status(error);
  const std::string name = entry.path().filename().string();
  if (depth > 0) return fs::is_regular_file(status) && is_tile_name(name);
  if (fs::is_directory(status)) return is_level_name(name);
  return fs::is_regular_file(status) && name == "map.index";
}

/// An error if `path` exists and is not a map, or is a map's folder with other files in it: these
/// would be removed with it.
Outcome check_replaceable(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return Done{};
  if (!fs::exists(index_file(path), error)) {
    return Error{path + ": exists and is not a map: not overwritten"};
  }
  fs::recursive_directory_iterator entry(path, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (is_part_of_map(*entry, entry.depth())) continue;
    return Error{path + ": contains " + entry->path().string() +
                 ", which is not part of a map: not overwritten; move it elsewhere, or use another "
                 "folder for the map"};
  }
  return error ? Outcome(Error{path + ": " + error.message()}) : Done{};
}

/// Creates a new folder next to `path`. Only folders created by this process are ever removed; the
/// process id in their names distinguishes those left by a killed process.
Result<std::string> new_folder(const std::string& path, const std::string& ending) {
  constexpr int kMax = 1000;
  const std::string stem = path + "." + std::to_string(::getpid()) + ".";
  for (int k = 0; k < kMax; ++k) {
    std::string folder = stem;
    folder.append(std::to_string(k)).append(ending);
    std::error_code error;
    if (fs::create_directory(folder, error)) return folder;
    std::error_code ignored;
    const bool taken = fs::exists(fs::symlink_status(folder, ignored));
    if (!taken) return Error{folder + ": " + error.message()};
  }
  return Error{stem + "*" + ending + ": too many folders exist"};
}

/// Moves the map at `path` to a folder of its own.
/// @return that folder; empty: there was no map
Result<std::string> set_aside(const std::string& path) {
  if (Outcome checked = check_replaceable(path); !checked) return checked.error();
  std::error_code error;
  if (!fs::exists(path, error)) return std::string();
  Result<std::string> aside = new_folder(path, ".old");
  if (!aside) return aside;
  fs::rename(path, *aside, error);  // in place of the empty folder
  if (!error) return aside;
  std::error_code ignored;
  fs::remove(*aside, ignored);
  return Error{path + ": " + error.message()};
}

/// The single value of a uniform layer, else nullopt.
template <class T>
void fold(std::vector<T>* layer) {
  const T& first = layer->front();
  if (std::all_of(layer->begin(), layer->end(), [&](const T& v) { return v == first; })) {
    layer->resize(1);
  }
}

template <class T>
void spread(std::size_t n, std::vector<T>* layer) {
  if (layer->size() != n) layer->assign(n, layer->front());
}

/// Overwrites a layer where `over` is known.
template <class T>
void lay(const std::vector<T>& over, const std::vector<float>& z, std::vector<T>* under) {
  if (over.size() == 1 && under->size() == 1 && over.front() == under->front()) return;
  spread(z.size(), under);
  for (std::size_t k = 0; k < z.size(); ++k) {
    if (!std::isnan(z[k])) (*under)[k] = layer_at(over, k);
  }
}

}  // namespace

MapWriter::MapWriter(std::string part, MapIndex index, std::string path)
    : part_(std::move(part)), index_(std::move(index)), path_(std::move(path)) {
  for (const MapLevelIndex& level : index_.levels) {
    lattices_.push_back(lattice_id(index_.frame, level.level));
  }
}

MapWriter::MapWriter(MapWriter&& other) noexcept
    : part_(std::move(other.part_)),
      index_(std::move(other.index_)),
      lattices_(std::move(other.lattices_)),
      path_(std::move(other.path_)),
      buffer_(std::move(other.buffer_)) {
  other.path_.clear();
}

MapWriter::~MapWriter() {
  std::error_code error;
  if (!path_.empty()) fs::remove_all(part_, error);
}

Result<MapWriter> MapWriter::create(const std::string& path, const MapFrame& frame,
                                    const std::vector<MapLevel>& levels) {
  std::string name = path;
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  std::error_code ignored;
  // A link stays a link: its target is replaced.
  if (fs::is_symlink(name, ignored) && fs::exists(name, ignored)) {
    name = fs::canonical(name, ignored).string();
  }
  if (Outcome checked = check_replaceable(name); !checked) return checked.error();
  MapIndex index;
  index.frame = frame;
  for (const MapLevel& level : levels) index.levels.push_back({level, {}});
  if (Outcome checked = check_index(index); !checked) {
    return Error{name + ": " + checked.error().message};
  }
  const fs::path parent = fs::path(name).parent_path();
  std::error_code error;
  if (!parent.empty()) fs::create_directories(parent, error);
  if (error) return Error{name + ": " + error.message()};
  Result<std::string> part = new_folder(name, ".part");
  if (!part) return part.error();
  return MapWriter(std::move(part).value(), std::move(index), name);
}

std::string MapWriter::file_of(int level, Cell tile) const {
  return tile_file(part_, index_.levels[static_cast<std::size_t>(level)].level.cell_m, tile);
}

Outcome MapWriter::put(int level, const Raster& raster) {
  if (Outcome checked = check_raster(raster); !checked) return checked;
  const MapLevelIndex& index = index_.levels[static_cast<std::size_t>(level)];
  if (!(raster.level == index.level)) return Error{"a raster of another level"};
  const Cell low = tile_of(raster.first);
  const Cell high =
      tile_of({raster.first.i + raster.width - 1, raster.first.j + raster.height - 1});
  for (int j = low.j; j <= high.j; ++j) {
    for (int i = low.i; i <= high.i; ++i) {
      Raster tile = cut(raster, first_cell({i, j}), kTileSide, kTileSide);
      if (index.find({i, j}) != nullptr) {
        Result<Raster> before = read_tile(file_of(level, {i, j}), {i, j},
                                          lattices_[static_cast<std::size_t>(level)], &buffer_);
        if (!before) return before.error();
        lay(tile.sigma_m, tile.z_m, &before->sigma_m);
        lay(tile.count, tile.z_m, &before->count);
        lay(tile.date, tile.z_m, &before->date);
        lay(tile.source, tile.z_m, &before->source);
        lay(tile.z_m, tile.z_m, &before->z_m);
        before->points.insert(before->points.end(), tile.points.begin(), tile.points.end());
        tile = std::move(before).value();
      }
      if (Outcome put = put_tile(level, std::move(tile)); !put) return put;
    }
  }
  return Done{};
}

Outcome MapWriter::put_tile(int level, Raster tile) {
  const auto at = static_cast<std::size_t>(level);
  fold(&tile.sigma_m);
  fold(&tile.count);
  fold(&tile.date);
  fold(&tile.source);
  if (tile.points.size() > kMaxSurfacePoints) {
    tile.points = thinned(tile.points, kThin_m, kMaxSurfacePoints);
  }
  const std::vector<std::uint8_t> bytes = encode_tile(tile, lattices_[at]);
  const MapTileEntry entry = entry_of(tile, bytes);
  if (entry.known == 0) return Done{};
  const std::string file = file_of(level, entry.tile);
  std::error_code error;
  fs::create_directories(fs::path(file).parent_path(), error);
  if (error) return Error{file + ": " + error.message()};
  if (Outcome written = write_file(file, bytes); !written) return written;
  index_.levels[at].enter(entry);
  return Done{};
}

Outcome MapWriter::add_coarser_levels() {
  bool fewer = true;
  while (fewer) {
    if (Outcome added = add_coarser_level(&fewer); !added) return added;
  }
  return Done{};
}

Outcome MapWriter::add_coarser_level(bool* fewer) {
  const auto fine_level = static_cast<int>(index_.levels.size()) - 1;
  const MapLevelIndex fine = index_.levels.back();
  std::set<std::pair<int, int>> wanted;  // j, i
  for (const MapTileEntry& e : fine.tiles) wanted.insert({e.tile.j >> 2, e.tile.i >> 2});
  *fewer = wanted.size() < fine.tiles.size();
  if (!*fewer) return Done{};
  MapLevel level = fine.level;
  level.cell_m *= kCoarser;
  index_.levels.push_back({level, {}});
  lattices_.push_back(lattice_id(index_.frame, level));
  for (const auto& [tile_j, tile_i] : wanted) {
    Raster coarse;
    coarse.level = level;
    coarse.first = first_cell({tile_i, tile_j});
    coarse.width = coarse.height = kTileSide;
    coarse.z_m.assign(kTileCells, std::numeric_limits<float>::quiet_NaN());
    for (int k = 0; k < kCoarser * kCoarser; ++k) {
      const Cell tile{kCoarser * tile_i + k % kCoarser, kCoarser * tile_j + k / kCoarser};
      if (fine.find(tile) == nullptr) continue;
      const Result<Raster> raster =
          read_tile(file_of(fine_level, tile), tile,
                    lattices_[static_cast<std::size_t>(fine_level)], &buffer_);
      if (!raster) return raster.error();
      paste_coarser(*raster, &coarse);
    }
    if (Outcome put = put_tile(fine_level + 1, std::move(coarse)); !put) return put;
  }
  return Done{};
}

Outcome MapWriter::finish() {
  if (Outcome checked = check_index(index_); !checked) return checked;
  if (Outcome written = write_file(index_file(part_), encode_index(index_)); !written) {
    return written;
  }
  const Result<std::string> old = set_aside(path_);
  if (!old) return old.error();
  std::error_code error;
  std::error_code ignored;
  fs::rename(part_, path_, error);
  if (error) {
    if (!old->empty()) fs::rename(*old, path_, ignored);
    return Error{path_ + ": " + error.message()};
  }
  if (!old->empty()) fs::remove_all(*old, ignored);
  path_.clear();
  return Done{};
}

Outcome write_map(const std::string& path, const MapFrame& frame, const Raster& raster) {
  Result<MapWriter> writer = MapWriter::create(path, frame, {raster.level});
  if (!writer) return writer.error();
  Outcome done = writer->put(0, raster);
  if (done) done = writer->add_coarser_levels();
  if (done) done = writer->finish();
  return done;
}

}  // namespace rcs::mapping
