#pragma once
// The a priori map as one surface with its uncertainty, around the vehicle or as a whole.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/grid.h"
#include "rcs/base/linear.h"
#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"
#include "rcs/terrain/tile_loader.h"

namespace rcs {

/// The ground at one position.
struct Elevation {
  double z_m = 0.0;              ///< above the datum's tangent plane: z in the map's frame
  Vec2 gradient = Vec2::Zero();  ///< (dz/dx, dz/dy)
  double sigma_m = 0.0;          ///< of z_m, without the systematic error
  std::int64_t tile_id = 0;      ///< of the tile that holds the nearest cell
  int level = 0;                 ///< of its cells; 0: the finest
  Cell cell;                     ///< of that level, which contains the position
};

/// A surface point of above-ground structure.
struct StandingHere {
  Vec3 p_m = Vec3::Zero();      ///< the map's frame
  Vec3 normal = Vec3::UnitX();  ///< unit, likewise
  double sigma_m = 0.0;         ///< along it, without the systematic error
};

/// Limits of the part of a map that is in memory.
struct MapWindow {
  double radius_m = 200.0;                ///< around the vehicle, [10, 1e5]
  double memory_bytes = 256.0 * 1048576;  ///< at most, for tiles, [1e6, 1e11]
};

/// Statistics of the loading so far.
struct MapLoading {
  std::int64_t loaded = 0;  ///< tiles
  std::int64_t failed =
      0;                ///< tiles that could not be read or differ from the index: unknown ground
  std::string failure;  ///< the newest failure: the file and the cause
};

/// Bilinear interpolation on the lattice of cell centres, across the borders of tiles, from the
/// finest level with data at the position. Sampling allocates nothing.
///
/// Each level has a window of slots for tiles, which moves with the vehicle. A tile's number
/// determines its slot, so that an entering tile replaces a leaving one, and the window bounds the
/// memory.
class ElevationMap {
 public:
  /// A map on disk, of which follow() loads the surroundings of the vehicle. Reads the index alone.
  [[nodiscard]] static Result<ElevationMap> open(const std::string& path, const MapWindow& window);

  /// A whole map from disk, for tools.
  [[nodiscard]] static Result<ElevationMap> load(const std::string& path, double memory_bytes);

  /// @param rasters  of one level or several; where those of a level overlap, the later one's known
  ///   cells win
  [[nodiscard]] static Result<ElevationMap> from_rasters(const MapFrame& frame,
                                                         const std::vector<Raster>& rasters);

  [[nodiscard]] const MapFrame& frame() const { return frame_; }
  [[nodiscard]] const Geodetic& datum() const { return frame_.datum; }
  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const MapLevel& level(int k) const {
    return levels_[static_cast<std::size_t>(k)].index.level;
  }
  [[nodiscard]] std::size_t memory_bytes() const;  ///< of the slots

  /// @param x_m, y_m  the map's frame
  /// @param finest  the level to begin with; finer ones are ignored
  /// @return false, and `out` unchanged, outside of the map, where one of the four cells is unknown
  ///   on every level, and where no tile is loaded yet
  [[nodiscard]] bool sample(double x_m, double y_m, Elevation* out, int finest = 0) const;

  /// Whether the map has surface points at all.
  [[nodiscard]] bool has_points() const;
  /// The closest surface point in memory within a distance. Allocates nothing.
  /// @param p_map  [m]
  /// @return false, and `out` unchanged, if there is none
  [[nodiscard]] bool closest_point(const Vec3& p_map, double distance_m, StandingHere* out) const;

  /// Accepts the tiles that the loader has finished, and requests missing tiles around a position,
  /// the nearest first. Allocates nothing, except for the text of a failure.
  void follow(const Vec2& place_m, TileLoader* loader);
  /// True if no tile is missing around the position of the last follow().
  [[nodiscard]] bool complete() const { return wanted_ == 0; }
  [[nodiscard]] const MapLoading& loading() const { return loading_; }

 private:
  struct Slot {
    enum class State { kEmpty, kLoading, kReady, kFailed };
    State state = State::kEmpty;
    Cell tile;
    std::vector<TileNode> nodes;  ///< kTileCells
    SurfaceIndex points;
  };
  struct Level {
    MapLevelIndex index;  ///< its tiles: on disk
    std::uint64_t lattice = 0;
    int wide = 1;                ///< slots along x
    int high = 1;                ///< slots along y
    std::size_t max_points = 0;  ///< of any tile
    std::vector<Slot> slots;

    [[nodiscard]] Slot& slot(Cell tile);
    [[nodiscard]] const Slot* ready(Cell tile) const;
    [[nodiscard]] const TileNode* node(Cell cell) const;
    [[nodiscard]] double slot_bytes() const;
  };

  ElevationMap() = default;
  void make_slots(Level* level, int wide, int high);
  [[nodiscard]] bool sample_level(int number, double x_m, double y_m, Elevation* out) const;
  void take(const TileJob& job);
  void want(std::size_t level, const Vec2& place_m, TileLoader* loader);
  [[nodiscard]] bool start(std::size_t level, const MapTileEntry& entry, TileLoader* loader);

  MapFrame frame_;
  std::string path_;
  double radius_m_ = 0.0;
  std::vector<Level> levels_;
  int wanted_ = 0;
  MapLoading loading_;
};

}  // namespace rcs
