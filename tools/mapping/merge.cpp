#include "tools/mapping/merge.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tools/mapping/map_writer.h"
#include "tools/mapping/resample.h"

namespace rcs::mapping {
namespace {

constexpr std::int64_t kMaxTiles = 4'000'000;

/// A cell in a survey.
struct Said {
  double z_m = 0.0;
  double sigma_m = 0.0;
  double variance = 0.0;  // of the height, including the systematic error
  int count = 0;
  std::uint16_t date = 0;
  CellSource source = CellSource::kUnknown;
};

bool contradict(const Said& a, const Said& b) {
  return std::abs(a.z_m - b.z_m) > kChangedSigmas * std::sqrt(a.variance + b.variance);
}

/// Order of preference. Dates are used only if all are known, else "newer" is not an order.
const Said& believed(const std::vector<Said>& said) {
  const bool dated =
      std::all_of(said.begin(), said.end(), [](const Said& s) { return s.date > 0; });
  return *std::min_element(said.begin(), said.end(), [dated](const Said& a, const Said& b) {
    if (dated && a.date != b.date) return a.date > b.date;
    if (a.variance != b.variance) return a.variance < b.variance;
    return a.z_m < b.z_m;
  });
}

/// @param said  one survey or several that agree
Said mean_of(const std::vector<Said>& said) {
  if (said.size() == 1) return said.front();
  double weights = 0.0;
  for (const Said& s : said) weights += 1.0 / s.variance;
  Said mean;
  mean.source = said.front().source;
  double square = 0.0;
  const double reference_m = said.front().z_m;  // heights are large, differences small
  for (const Said& s : said) {
    const double w = 1.0 / (s.variance * weights);
    mean.z_m += w * (s.z_m - reference_m);
    square += w * w * s.sigma_m * s.sigma_m;
    mean.count += s.count;
    mean.date = std::max(mean.date, s.date);
    if (s.source != mean.source) mean.source = CellSource::kMixed;
  }
  mean.z_m += reference_m;
  mean.sigma_m = std::sqrt(square);
  return mean;
}

/// @param said  not empty
/// @return true if they contradict each other; `said` is then reduced to the accepted ones
bool settle(std::vector<Said>* said) {
  bool changed = false;
  for (std::size_t a = 0; a < said->size(); ++a) {
    for (std::size_t b = a + 1; b < said->size(); ++b) {
      changed = changed || contradict((*said)[a], (*said)[b]);
    }
  }
  if (!changed) return false;
  const Said leader = believed(*said);
  said->erase(std::remove_if(said->begin(), said->end(),
                             [&](const Said& s) { return contradict(s, leader); }),
              said->end());
  return true;
}

MapLevel level_of(const MapLevel& lattice, const std::vector<MapLevel>& surveys) {
  MapLevel level = lattice;
  for (const MapLevel& s : surveys) {
    level.bias_sigma_m = std::max(level.bias_sigma_m, s.bias_sigma_m);
    level.bias_correlation_m = std::max(level.bias_correlation_m, s.bias_correlation_m);
  }
  return level;
}

/// The sources of all maps as text, limited to the length that an index allows.
std::string sources_of(const std::vector<MapResampler>& maps) {
  constexpr std::size_t kMax = 1000;
  std::string text;
  std::set<std::string> named;
  for (const MapResampler& m : maps) {
    const std::string& name = m.map().index().frame.source_crs;
    if (name.empty() || !named.insert(name).second) continue;
    if (!text.empty() && text.size() + name.size() > kMax) continue;
    if (!text.empty()) text += " + ";
    text += name;
  }
  return text;
}

Result<std::set<std::pair<int, int>>> tiles_of(const std::vector<MapResampler>& maps,
                                               const MapLevel& lattice) {
  std::set<std::pair<int, int>> tiles;  // j, i
  for (const MapResampler& m : maps) {
    for (const auto& [low, high] : m.reaches(lattice)) {
      const std::int64_t n =
          (std::int64_t{high.i} - low.i + 1) * (std::int64_t{high.j} - low.j + 1);
      if (n > kMaxTiles || static_cast<std::int64_t>(tiles.size()) + n > 2 * kMaxTiles) {
        return Error{m.map().path() +
                     ": requires more than 4 million tiles with the cells of the first map"};
      }
      for (int j = low.j; j <= high.j; ++j) {
        for (int i = low.i; i <= high.i; ++i) tiles.insert({j, i});
      }
    }
  }
  return tiles;
}

}  // namespace

Fused fuse(const std::vector<Raster>& surveys) {
  RCS_CHECK(!surveys.empty());
  Fused fused;
  Raster& r = fused.raster;
  const Raster& one = surveys.front();
  std::vector<MapLevel> levels;
  for (const Raster& s : surveys) {
    RCS_CHECK(s.first == one.first && s.width == one.width && s.height == one.height &&
              s.level.cell_m == one.level.cell_m && s.level.origin_m == one.level.origin_m);
    levels.push_back(s.level);
  }
  r.level = level_of(one.level, levels);
  r.first = one.first;
  r.width = one.width;
  r.height = one.height;
  const std::size_t n = r.cells();
  r.z_m.assign(n, std::numeric_limits<float>::quiet_NaN());
  r.sigma_m.assign(n, 1.0F);
  r.count.assign(n, 0);
  r.date.assign(n, 0);
  r.source.assign(n, CellSource::kUnknown);
  std::vector<Said> said;
  for (std::size_t k = 0; k < n; ++k) {
    said.clear();
    for (const Raster& s : surveys) {
      if (std::isnan(s.z_m[k])) continue;
      const double sigma = layer_at(s.sigma_m, k);
      const double bias = s.level.bias_sigma_m;
      said.push_back({s.z_m[k], sigma, sigma * sigma + bias * bias, layer_at(s.count, k),
                      layer_at(s.date, k), layer_at(s.source, k)});
    }
    if (said.empty()) continue;
    if (said.size() > 1) ++fused.several;
    if (settle(&said)) ++fused.changed;
    const Said mean = mean_of(said);
    r.z_m[k] = static_cast<float>(mean.z_m);
    r.sigma_m[k] = static_cast<float>(mean.sigma_m);
    r.count[k] = static_cast<std::uint16_t>(std::min(mean.count, 65535));
    r.date[k] = mean.date;
    r.source[k] = mean.source;
  }
  return fused;
}

Result<Merged> merge_maps(const std::vector<std::string>& paths, const std::string& out,
                          const std::function<bool(double)>& progress) {
  RCS_CHECK(paths.size() > 1);
  const Result<MapFolder> first = MapFolder::open(paths.front());
  if (!first) return first.error();
  const MapLevel& lattice = first->index().levels.front().level;
  std::vector<MapResampler> maps;
  std::vector<MapLevel> levels;
  Merged merged;
  for (const std::string& path : paths) {
    Result<MapResampler> map = MapResampler::open(path, *first, lattice.cell_m);
    if (!map) return map.error();
    for (const MapResampler& other : maps) {
      std::error_code error;
      if (!std::filesystem::equivalent(path, other.map().path(), error)) continue;
      return Error{path + ": is given twice; surveys must be independent"};
    }
    for (const MapTileEntry& e : map->map().index().levels.front().tiles) {
      merged.points_lost += e.points;
    }
    levels.push_back(map->level());
    maps.push_back(std::move(map).value());
  }
  const Result<std::set<std::pair<int, int>>> tiles = tiles_of(maps, lattice);
  if (!tiles) return tiles.error();
  merged.frame = first->index().frame;
  merged.frame.source_crs = sources_of(maps);
  merged.cell_m = lattice.cell_m;
  Result<MapWriter> writer = MapWriter::create(out, merged.frame, {level_of(lattice, levels)});
  if (!writer) return writer.error();
  std::size_t done = 0;
  for (const auto& [j, i] : *tiles) {
    std::vector<Raster> surveys;
    for (MapResampler& map : maps) {
      Result<Raster> raster = map.read(lattice, first_cell({i, j}), kTileSide, kTileSide);
      if (!raster) return raster.error();
      surveys.push_back(std::move(raster).value());
    }
    const Fused fused = fuse(surveys);
    merged.several += fused.several;
    merged.changed += fused.changed;
    merged.cells += std::count_if(fused.raster.z_m.begin(), fused.raster.z_m.end(),
                                  [](float z) { return !std::isnan(z); });
    if (Outcome put = writer->put(0, fused.raster); !put) return put.error();
    ++done;
    if (!progress(static_cast<double>(done) / static_cast<double>(tiles->size()))) {
      return Error{"interrupted"};
    }
  }
  if (merged.cells == 0) return Error{paths.front() + ": no known heights in any of the maps"};
  Outcome written = writer->add_coarser_levels();
  if (written) written = writer->finish();
  if (!written) return written.error();
  return merged;
}

Result<Filled> fill_map(const std::string& map, const std::string& prior, const std::string& out,
                        const std::function<bool(double)>& progress) {
  const Result<MapFolder> own = MapFolder::open(map);
  if (!own) return own.error();
  const MapLevelIndex& finest = own->index().levels.front();
  Result<MapResampler> other = MapResampler::open(prior, *own, finest.level.cell_m);
  if (!other) return other.error();
  MapFrame frame = own->index().frame;
  const std::string& from = other->map().index().frame.source_crs;
  if (!from.empty()) frame.source_crs += " + " + from;
  Result<MapWriter> writer = MapWriter::create(out, frame, {finest.level});
  if (!writer) return writer.error();
  Filled filled;
  std::vector<std::uint8_t> buffer;
  std::size_t done = 0;
  for (const MapTileEntry& e : finest.tiles) {
    const Result<Raster> tile = own->read(0, e.tile, &buffer);
    if (!tile) return tile.error();
    const Result<Raster> below =
        other->read(finest.level, first_cell(e.tile), kTileSide, kTileSide);
    if (!below) return below.error();
    Raster r = *tile;
    r.sigma_m.resize(kTileCells);
    r.count.resize(kTileCells);
    r.date.resize(kTileCells);
    r.source.resize(kTileCells);
    for (std::size_t k = 0; k < kTileCells; ++k) {
      const bool ours = !std::isnan(tile->z_m[k]);
      const Raster& s = ours ? *tile : *below;
      const double bias = ours ? 0.0 : below->level.bias_sigma_m;
      r.z_m[k] = s.z_m[k];
      r.sigma_m[k] = static_cast<float>(std::hypot(double{layer_at(s.sigma_m, k)}, bias));
      r.count[k] = layer_at(s.count, k);
      r.date[k] = layer_at(s.date, k);
      r.source[k] = layer_at(s.source, k);
      if (std::isnan(r.z_m[k])) continue;
      ++filled.cells;
      if (!ours) ++filled.filled;
    }
    if (Outcome put = writer->put(0, r); !put) return put.error();
    ++done;
    if (!progress(static_cast<double>(done) / static_cast<double>(finest.tiles.size()))) {
      return Error{"interrupted"};
    }
  }
  Outcome written = writer->add_coarser_levels();
  if (written) written = writer->finish();
  if (!written) return written.error();
  return filled;
}

}  // namespace rcs::mapping
