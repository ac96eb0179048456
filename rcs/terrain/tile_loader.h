#pragma once
// Who brings tiles from disk.

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

/// One tile that is wanted, or has come.
struct TileJob {
  int level = 0;
  Cell tile;
  std::uint64_t lattice = 0;       ///< that it must be of
  std::uint32_t checksum = 0;      ///< of the file that the index knows
  double cell_m = 0.0;             ///< of the level
  TileNode* nodes = nullptr;       ///< kTileCells of them, the loader's until the job is finished
  SurfaceIndex* points = nullptr;  ///< likewise
  std::size_t most_points = 0;     ///< that there is room for
  bool replaced = false;           ///< when finished: sound, but not the file that the index knows
  std::string failure;             ///< when finished: empty, or which file and why not
};

class TileLoader {
 public:
  virtual ~TileLoader() = default;
  /// @return false: as many are under way as there may be; ask again later
  [[nodiscard]] virtual bool start(const TileJob& job) = 0;
  /// @return false: none has been finished since
  [[nodiscard]] virtual bool finished(TileJob* job) = 0;
};

/// Reads and decodes a job's tile; for loaders.
/// @param map  the map's folder
/// @param buffer  for the file's bytes, reused from call to call
void load_tile(const std::string& map, std::vector<std::uint8_t>* buffer, TileJob* job);

/// Reads when asked: for replays, which must give the same bytes each time, and for tools.
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
