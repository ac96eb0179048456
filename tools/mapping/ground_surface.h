#pragma once
// The ground's rough course under all that was seen: what finer heights are held against.

#include <cstdint>
#include <optional>
#include <vector>

#include "rcs/base/linear.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

struct GroundSurfaceParams {
  double cell_m = 0.5;     ///< edge of its cells, [0.2, 5]
  double layer_m = 0.05;   ///< thickness of the layers in which a cell's returns are counted
  double support = 0.1;    ///< share of a cell's returns that a ground has at least, (0, 1)
  double stands_m = 0.25;  ///< what is higher above the plane through its neighbours is no ground
};

/// The surface at a place, and how steep it is there.
struct GroundHere {
  double z_m = 0.0;
  Vec2 gradient = Vec2::Zero();
};

/// Counts returns by cell and layer of height; the ground is the lowest layer that is seen again
/// and again, where it agrees with the lowest ones around it (planes through 3.5 m to 5.5 m of
/// them, to which what is above counts little). What is only seen of things that stand on the
/// ground is no ground.
class GroundSurface {
 public:
  explicit GroundSurface(const GroundSurfaceParams& params) : params_(params) {}

  /// A return. Frame: the map's.
  void add(const Vec3& p);
  /// No more returns: makes the surface of them.
  void finish();

  /// A ray that goes on below the surface's ground: at a place seen through at least twice, by
  /// different scans, is none. Rays that end
  /// where no ground is known, or below it, tell nothing.
  /// @param from, to  of the ray
  /// @param scan  the scan's number
  void see_through(const Vec3& from, const Vec3& to, std::uint32_t scan);
  /// Forgets the ground of places that were seen through. @return how many cells
  std::int64_t close();

  /// None where the ground was not seen. Continuous but at the borders of what was seen.
  [[nodiscard]] std::optional<GroundHere> at(double x_m, double y_m) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Layer {
    std::int32_t number = 0;
    std::uint32_t returns = 0;
  };
  struct Column {
    std::vector<Layer> layers;  // ascending
  };
  struct Node {
    bool known = false;
    float low_m = 0.0F;
    float z_m = 0.0F;  // of the plane, in the middle of the cell
    float slope_x = 0.0F;
    float slope_y = 0.0F;
    bool closed = false;  // seen through: no ground, but the surface goes on
    std::uint32_t through_scan = 0;
    std::uint16_t through = 0;  // scans
  };
  struct Plane {
    double z_m = 0.0;
    Vec2 slope = Vec2::Zero();
  };
  [[nodiscard]] Cell cell_at(double x_m, double y_m) const;
  [[nodiscard]] std::optional<double> lowest(const Column& column) const;
  [[nodiscard]] std::optional<Plane> plane_around(Cell c, int reach, bool lower) const;

  GroundSurfaceParams params_;
  CellBlocks<Column> columns_;
  CellBlocks<Node> nodes_;
  std::size_t layers_ = 0;
};

}  // namespace rcs::mapping
