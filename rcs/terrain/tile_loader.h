#pragma once
// Interface of the loaders of map tiles, and the synchronous loader.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/terrain/surface_points.h"

namespace rcs {

/// A cell of a map in memory.
struct TileNode {
  float z_m;      ///< NaN: unknown
  float sigma_m;  ///< > 0 where known
};

/// One tile that is requested or loaded.
struct TileJob {
  int level = 0;
  Cell tile;
  std::uint64_t lattice = 0;       ///< required of the tile
  std::uint32_t checksum = 0;      ///< of the file according to the index
  double cell_m = 0.0;             ///< of the level
  TileNode* nodes = nullptr;       ///< kTileCells; owned by the loader until finished
  SurfaceIndex* points = nullptr;  ///< owned likewise
  std::size_t max_points = 0;      ///< capacity
  std::string failure;             ///< when finished: empty, or the file and the cause
};

class TileLoader {
 public:
  virtual ~TileLoader() = default;
  /// @return false: the maximum number is in progress; try again later
  [[nodiscard]] virtual bool start(const TileJob& job) = 0;
  /// @return false: none has finished since the last call
  [[nodiscard]] virtual bool finished(TileJob* job) = 0;
};

/// Reads and decodes a job's tile; for loaders.
/// @param map  the map's folder
/// @param buffer  for the file's bytes, reused from call to call
void load_tile(const std::string& map, std::vector<std::uint8_t>* buffer, TileJob* job);

/// Reads at once: for replays, which must give the same bytes each time, and for tools.
class DirectTileLoader final : public TileLoader {
 public:
  explicit DirectTileLoader(std::string map) : map_(std::move(map)) {}
  [[nodiscard]] bool start(const TileJob& job) override;
  [[nodiscard]] bool finished(TileJob* job) override;

 private:
  std::string map_;
  std::vector<std::uint8_t> buffer_;
  TileJob job_;
  bool done_ = false;
};

}  // namespace rcs
