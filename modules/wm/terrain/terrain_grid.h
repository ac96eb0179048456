#pragma once
// The ground around the vehicle as BG needs it: height, steps, slope, roughness and obstacles by
// cell, accumulated from registered scans in frame local.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::wm {

struct TerrainParams {
  double cell_m = 0.4;
  int size = 256;           ///< cells along each side of the grid, a power of two
  int patch = 128;          ///< cells along each side of what is published, at most size / 2
  double ahead_m = 12.0;    ///< middle of the patch, ahead of the vehicle
  double overhang_m = 2.2;  ///< what is higher above the ground is driven under
  double solid_m = 0.22;    ///< ground that stands out so far is a rock
  double obstacle_m = 0.4;  ///< and points so far above it are something in the way: more than
                            ///< grass is high
  double evidence = 3.5;    ///< scans that must have seen such points, net
  /// Nearer, the LADAR's lowest rays are above level ground: what they meet there is grass or an
  /// object, not the ground.
  double near_m = 5.0;
  /// The same while the vehicle is where it started: what lies before it then was never seen from
  /// farther, and a rock that was not is hardly there. 1.8 m above the ground, the lowest ray of
  /// Demo III's LADAR (-20 deg) reaches it 5.9 m from the vehicle's middle.
  double near_start_m = 6.5;
  double max_range_m = 35.0;  ///< farther points are not used: pitch errors lift them
};

constexpr float kUnknown_m = std::numeric_limits<float>::infinity();

/// What is known of a quarter of a cell; heights in frame local.
struct TerrainCell {
  /// Lowest that scans see in it again and again: grass lets some light through. Unknown: infinite,
  /// so that it is not below anything.
  float low_m = kUnknown_m;
  float high_m = 0.0F;  ///< of what stands on it, below the overhang
  float evidence = 0.0F;
  std::uint16_t scans = 0;   ///< that saw it, saturating; 0: unknown
  bool ground_seen = false;  ///< from farther than near_m: its low may be the ground
};

/// One cell of the patch.
struct TerrainAnswer {
  bool known = false;
  bool obstacle = false;
  float height_m = 0.0F;     ///< of the plane through the neighbourhood
  float step_m = 0.0F;       ///< of an object or a ledge, above that plane
  float slope_rad = 0.0F;    ///< of the plane
  float roughness_m = 0.0F;  ///< rms of the ground about the plane
};

/// The ground around a cell, z = a + b x + c y, with x and y in cells from its middle.
struct GroundPlane {
  double a = 0.0, b = 0.0, c = 0.0;
  double slope_rad = 0.0;  ///< where it is steepest
  double rms = 0.0;        ///< of the heights that it goes through
  double leverage = 0.0;   ///< how much of a is what was seen in the middle, [0, 1]

  [[nodiscard]] double at(double x, double y) const { return a + b * x + c * y; }
};

/// Allocates nothing after construction. Moving the window costs one write a cell that enters.
class TerrainGrid {
 public:
  explicit TerrainGrid(const TerrainParams& params);

  /// Nothing is known any more.
  void clear();

  /// Takes the points of one scan, or of a part of one.
  /// @param p_vehicle  points in the vehicle frame [m], finite
  /// @param T_local_vehicle  where the scan was registered
  void insert(const Points& p_vehicle, const Pose& T_local_vehicle);

  /// The square of cells around a point ahead of the vehicle.
  /// @return its lowest cell
  Cell begin_patch(const Pose& T_local_vehicle);

  /// Some rows of the patch that was begun, so that a patch can be spread over several cycles;
  /// nothing is inserted in between.
  /// @param begin, end  [0, params.patch]
  /// @param out  params.patch^2 answers, row by row, x fastest; those of the rows are written
  void answer_rows(int begin, int end, std::vector<TerrainAnswer>* out);

  /// All of it at once.
  /// @return its lowest cell
  Cell patch(const Pose& T_local_vehicle, std::vector<TerrainAnswer>* out);

  [[nodiscard]] const TerrainParams& params() const { return params_; }
  [[nodiscard]] bool empty() const { return scans_ == 0; }

 private:
  static constexpr int kReach = 2;  ///< the neighbourhood of a cell is 5 x 5
  /// What one scan saw in a quarter.
  struct Seen {
    Cell cell;
    float low_m;
    float high_m;
    float second_m;  // highest but one
    bool ground;     // from where rays reach down to level ground
  };
  /// Lowest of a cell's quarters, while a patch is made.
  struct Low {
    bool known = false;
    bool ground = false;  // it may be the ground
    bool sure = false;    // seen often enough
    float m = kUnknown_m;
  };
  void update(const Seen& seen);
  [[nodiscard]] bool overhangs(const Seen& seen) const;
  void collect_lows(Cell first);
  void add_columns(std::ptrdiff_t row);
  [[nodiscard]] TerrainAnswer answer(const Low* low, Cell cell, const GroundPlane& ground) const;

  TerrainParams params_;
  Grid<TerrainCell> cells_;  // quarters
  Grid<int> index_;          // of the cell in seen_ + 1; 0 outside of insert()
  std::vector<Seen> seen_;
  // Of the patch and kReach cells around it, row by row. Sums are double: heights far from zero
  // must not drown the roughness.
  std::ptrdiff_t stride_ = 0;  // from row to row
  std::vector<Low> lows_;
  std::vector<double> n_, z_, zz_;  // 1, height and its square of what may be the ground, else 0
  std::vector<double> columns_;     // sums of five rows of them
  Cell first_;                      // lowest of the patch
  std::int64_t scans_ = 0;
  Vec2 start_ = Vec2::Zero();  // frame local, of the first scan
};

}  // namespace rcs::wm
