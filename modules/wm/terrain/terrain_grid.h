#pragma once
// The ground around the vehicle for BG: height, steps, slope, roughness and obstacles by cell,
// accumulated from registered scans in frame local.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "modules/wm/terrain/hidden_gap.h"
#include "modules/wm/terrain/passing_rays.h"
#include "rcs/base/grid.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::wm {

struct TerrainParams {
  double cell_m = 0.4;
  int size = 256;         ///< cells along each side of the grid, a power of two
  int patch = 128;        ///< cells along each side of the published patch, at most size / 2
  double ahead_m = 12.0;  ///< from the vehicle to the centre of the patch
  double overhang_m =
      2.2;                ///< points higher above the ground are ignored: the vehicle passes below
  double solid_m = 0.22;  ///< ground that exceeds its plane by this is a rock
  double obstacle_m =
      0.4;  ///< points higher above the ground are evidence of an obstacle; more than the grass
  double ledge_m = 0.3;   ///< higher edges in the ground are obstacles, see ledge_height()
  double evidence = 3.5;  ///< net number of scans with such points
  /// Ground that exceeds its plane by this, next to an obstacle, is a part of it: the side of a
  /// rock. 0: disabled.
  double side_m = 0.15;
  /// At a shorter range the lowest LADAR rays are above level ground: their returns come from grass
  /// or objects.
  double near_m = 5.0;
  /// Replaces near_m while the vehicle is near its start: the terrain ahead was never seen from
  /// farther away, and a rock there is unlikely. 1.8 m above the ground, the lowest ray of the Demo
  /// III LADAR (-20 deg) reaches it 5.9 m from the centre of the vehicle.
  double near_start_m = 6.5;
  double max_range_m = 35.0;  ///< farther points are not used: pitch errors lift them
  /// The lowest points of three scans within this range replace those of scans at longer range:
  /// errors of position and attitude there assign ground to the cells of a rock. 0: they do not.
  double accurate_m = 12.0;
  /// Ground that an edge hides is looked for up to here; 0: not at all. The rows of the LADAR must
  /// meet level ground closer than about 0.6 m.
  double edge_range_m = 0.0;
  HiddenGapParams edge;
  /// What stands up to this height and lets most rays through gives way to the vehicle; 0: nothing
  /// does.
  double vegetation_m = 0.0;
  /// What stands higher than this, seen by several rays of one scan, is an obstacle at once, until
  /// rays pass where it was: people and vehicles, which move. More than vegetation that hides
  /// rocks. 0: off.
  double upright_m = 0.0;
  /// Ground that a moving person or vehicle reaches within this time counts as an obstacle.
  double motion_s = 0.0;
  Vec3 p_vehicle_ladar = Vec3::Zero();  ///< where the rays begin, vehicle frame
};

constexpr float kUnknown_m = std::numeric_limits<float>::infinity();

/// State of a quarter of a cell; heights in frame local.
struct TerrainCell {
  /// Lowest height that scans see repeatedly: some rays penetrate grass. Infinite if unknown, so
  /// that it is below nothing.
  float low_m = kUnknown_m;
  float accurate_low_m = kUnknown_m;  ///< the same of scans at short range
  float high_m = 0.0F;                ///< top of what stands on the ground, below the overhang
  float evidence = 0.0F;
  std::uint16_t scans = 0;       ///< scans that saw it, saturating; 0: unknown
  std::uint8_t ground_seen : 1;  ///< from farther than near_m: low_m may be the ground
  std::uint8_t accurate : 2;     ///< scans at short range, saturating
  std::uint8_t confirmed : 2;    ///< of these, those with a lowest point at accurate_low_m
  /// Net number of observations that an edge hides it, while it is unknown.
  std::uint8_t hidden = 0;
  // Rays that ended in what stands on the ground here, and that passed below its top.
  std::uint8_t stopped = 0;
  std::uint8_t passed = 0;
  std::uint8_t near = 0;  ///< of both, those from near enough to reach the ground between plants
  /// Scans in which rays must pass here until what stands upright here has gone; 0: nothing does.
  std::uint8_t upright : 5;
  std::uint8_t listed : 1;          ///< among those that passing rays clear
  std::uint8_t hit : 1;             ///< by a ray of the current scan, in what stands here
  std::uint8_t ground_unknown : 1;  ///< when the object was first seen here

  TerrainCell()
      : ground_seen(0),
        accurate(0),
        confirmed(0),
        upright(0),
        listed(0),
        hit(0),
        ground_unknown(0) {}
  float pass_low_m = kUnknown_m;  ///< lowest of the rays that passed
};

/// Why a cell is an obstacle; of several causes the first.
enum class ObstacleCause : std::uint8_t {
  kNone,
  kHidden,  ///< by an edge
  kRock,    ///< ground that stands out of its plane
  kTall,    ///< returns above the ground
  kLedge,
  kSide,  ///< of another one
};

/// One cell of the patch.
struct TerrainAnswer {
  bool known = false;
  bool obstacle = false;
  bool hidden = false;      ///< by an edge: an obstacle
  bool vegetation = false;  ///< that gives way stands here
  bool side = false;        ///< of an obstacle; only within join_sides()
  ObstacleCause cause = ObstacleCause::kNone;
  float height_m = 0.0F;     ///< of the plane through the neighbourhood; NAN: unknown
  float step_m = 0.0F;       ///< height of an object or a ledge above that plane
  float low_m = 0.0F;        ///< largest height of solid ground above that plane, not of grass
  float slope_rad = 0.0F;    ///< of the plane
  float roughness_m = 0.0F;  ///< rms of the ground about the plane
};

/// Points that were compared with the terrain.
struct TerrainAgreement {
  int points = 0;
  int agree = 0;
};

/// The ground around a cell, z = a + b x + c y, with x and y in cells from its centre.
struct GroundPlane {
  double a = 0.0, b = 0.0, c = 0.0;
  double slope_rad = 0.0;  ///< largest slope
  double rms = 0.0;        ///< of the residuals [m]
  double leverage = 0.0;   ///< share of the centre's own height in a, [0, 1]

  [[nodiscard]] double at(double x, double y) const { return a + b * x + c * y; }
};

/// Allocates nothing after construction, except in keep_ahead(). A shift of the window writes each
/// cell that enters once.
class TerrainGrid {
 public:
  explicit TerrainGrid(const TerrainParams& params);

  /// Discards all terrain.
  void clear();

  /// Inserts the points of a scan, or of a part of one.
  /// @param p_vehicle  points in the vehicle frame [m], finite
  /// @param T_local_vehicle  registered pose of the scan
  void insert(const Points& p_vehicle, const Pose& T_local_vehicle);

  /// Begins the square patch of cells around a point ahead of the vehicle.
  /// @return its lowest cell
  Cell begin_patch(const Pose& T_local_vehicle);

  /// Computes some rows of the patch that was begun, so that a patch can be spread over several
  /// cycles; nothing is inserted in between.
  /// @param begin, end  [0, params.patch]
  /// @param out  params.patch^2 cells, row by row, x fastest; only the given rows are written
  void answer_rows(int begin, int end, std::vector<TerrainAnswer>* out);

  /// Computes the whole patch at once.
  /// @return its lowest cell
  Cell patch(const Pose& T_local_vehicle, std::vector<TerrainAnswer>* out);

  /// The quarters of cells in which something stood upright in the points of the last insert().
  [[nodiscard]] const std::vector<Cell>& upright_now() const { return upright_now_; }
  /// Whether rays of the last insert() pass a place, frame local, between the ground and the height
  /// of a person.
  [[nodiscard]] bool passed(const Vec2& p_local) const;
  /// Whether something stands upright in a quarter of a cell, as far as is known.
  [[nodiscard]] bool stands(Cell quarter) const {
    const TerrainCell* const cell = cells_.find(quarter);
    return cell == nullptr || cell->upright > 0;
  }

  /// How many of the points within accurate_m lie on known ground or on what stands there.
  /// @param p_vehicle, T_local_vehicle  as for insert()
  [[nodiscard]] TerrainAgreement agreement(const Points& p_vehicle,
                                           const Pose& T_local_vehicle) const;
  /// Discards all terrain but that ahead of the vehicle within accurate_m, and moves it to another
  /// frame.
  /// @param T_old_new  a rotation about z and a translation: frame of the grid <- new frame
  /// @param T_new_vehicle  in the new frame
  void keep_ahead(const Pose& T_old_new, const Pose& T_new_vehicle);

  [[nodiscard]] const TerrainParams& params() const { return params_; }
  [[nodiscard]] bool empty() const { return scans_ == 0; }

  // The terrain as rows of bytes, with which another grid of the same parameters continues.
  [[nodiscard]] std::size_t rows() const { return static_cast<std::size_t>(cells_.size()); }
  [[nodiscard]] std::size_t row_bytes() const {
    return sizeof(RowHead) + rows() * sizeof(TerrainCell);
  }
  /// @param k  [0, rows())
  /// @param out  row_bytes()
  void save_row(std::size_t k, std::byte* out) const;
  /// Where the first scan was made, frame local.
  [[nodiscard]] const Vec2& start() const { return start_; }
  /// Discards all terrain and centres the window; restore_row() follows for each row that was
  /// saved.
  void begin_restore(const Vec2& centre_local, const Vec2& start_local);
  void restore_row(const std::byte* row);

 private:
  static constexpr int kReach = 2;  ///< the neighbourhood of a cell is 5 x 5
  /// Returns of one scan in a quarter.
  struct Seen {
    Cell cell;
    float low_m;
    float high_m;
    float second_m;  // second highest
    bool ground;     // from a range at which rays reach level ground
    bool accurate;   // and within accurate_m
    int points;
  };
  /// Lowest of the quarters of a cell, while a patch is computed.
  struct Low {
    bool known = false;
    bool ground = false;  // it may be the ground
    bool sure = false;    // seen often enough
    bool hidden = false;  // a quarter is, by an edge
    float m = kUnknown_m;
  };
  /// Lowest cell of a row that was saved.
  struct RowHead {
    int i = 0;
    int j = 0;
  };
  void restore(Cell at, const TerrainCell& cell);
  /// Height of the scan in seen_ above the same ground in the grid; 0: they agree, or too little of
  /// the scan is ground that the grid knows well.
  [[nodiscard]] float offset();
  /// Moves all terrain up.
  void shift(float up_m);
  void update(const Seen& seen);
  void update_low(const Seen& seen, TerrainCell* cell) const;
  [[nodiscard]] bool overhangs(const Seen& seen) const;
  void look_before(const Seen& seen, const Vec2& ladar);
  void look_through(const Vec3& hit, const Vec3& ladar);
  [[nodiscard]] float lowest_around(Cell quarter) const;
  void note_upright(const Seen& seen);
  void clear_passed(const Vec3& ladar);
  [[nodiscard]] bool gives_way(Cell quarter) const;
  [[nodiscard]] bool soft(Cell cell) const;
  void collect_lows(Cell first);
  void add_columns(std::ptrdiff_t row);
  [[nodiscard]] TerrainAnswer answer(const Low* low, Cell cell, const GroundPlane& ground) const;

  TerrainParams params_;
  Grid<TerrainCell> cells_;  // quarters
  Grid<int> index_;          // index of the cell in seen_, + 1; 0 outside insert()
  std::vector<Seen> seen_;
  std::vector<float> offsets_;  // of its parts, in offset()
  std::vector<Cell> tall_;      // quarters that passing rays clear, each once
  std::vector<Cell> upright_now_;
  PassingRays rays_;           // of the last insert()
  Vec3 ladar_ = Vec3::Zero();  // frame local, where they began
  // Of the patch and kReach cells around it, row by row. Sums are double, so that heights far from
  // zero do not hide the roughness.
  std::ptrdiff_t stride_ = 0;  // from row to row
  std::vector<Low> lows_;
  std::vector<double> n_, z_, zz_;  // 1, height and squared height of possible ground, else 0
  std::vector<double> columns_;     // sums over five of these rows
  Cell first_;                      // lowest cell of the patch
  std::int64_t scans_ = 0;
  Vec2 start_ = Vec2::Zero();  // frame local, of the first scan
};

}  // namespace rcs::wm
