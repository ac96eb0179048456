#pragma once
// The coarse surface of the ground, the reference of finer heights.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "rcs/base/linear.h"
#include "tools/mapping/cell_blocks.h"

namespace rcs::mapping {

struct GroundSurfaceParams {
  double cell_m = 0.5;     ///< edge of its cells, [0.2, 5]
  double layer_m = 0.05;   ///< thickness of the layers in which the returns of a cell are counted
  double support = 0.1;    ///< minimum share of the returns of a cell for ground, (0, 1)
  double stands_m = 0.25;  ///< maximum height of ground above the plane through its neighbours
};

/// Height and gradient of the surface.
struct GroundHere {
  double z_m = 0.0;
  Vec2 gradient = Vec2::Zero();
};

/// Counts returns by cell and layer of height. The ground is the lowest layer that is observed
/// repeatedly and agrees with its neighbours (planes through the lowest layers within 3.5 m to 5.5
/// m, in which points above the plane have little weight). Objects without visible ground are not
/// ground.
class GroundSurface {
 public:
  explicit GroundSurface(const GroundSurfaceParams& params) : params_(params) {}

  /// Adds a return in the frame of the map.
  void add(const Vec3& p);
  /// Computes the surface; call it after the last return.
  /// @param going  false ends it early
  /// @return false if it was ended early: the surface is not valid
  [[nodiscard]] bool finish(const std::function<bool()>& going);

  /// Adds a ray. Ground that at least two scans have seen through (rays that continue below it) is
  /// invalid. Rays that end where no ground is known, or below it, are ignored.
  /// @param from, to  of the ray
  /// @param scan  number of the scan
  void see_through(const Vec3& from, const Vec3& to, std::uint32_t scan);
  /// Removes ground that was seen through. @return number of cells
  std::int64_t close();

  /// nullopt where no ground was observed. Continuous except at the borders of the observed area.
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
    float z_m = 0.0F;  // of the plane, at the centre of the cell
    float slope_x = 0.0F;
    float slope_y = 0.0F;
    bool closed = false;  // seen through: no ground, but the surface continues
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
