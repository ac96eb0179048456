#pragma once
// Where on the a priori map a vehicle is that starts without GPS: searched for in a region, by the
// ground that it sees on its way, and said only when further ground has borne it out.

#include <cstdint>
#include <vector>

#include "modules/sp/prior/ground_fit.h"
#include "modules/sp/prior/ground_patch.h"
#include "rcs/base/work_units.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

/// Where the vehicle began, in the map's frame.
struct StartRegion {
  Vec2 middle_m = Vec2::Zero();
  double radius_m = 100.0;   ///< [1, 1000]
  double yaw_rad = 0.0;      ///< of the vehicle, counter-clockwise from east
  double within_rad = 0.35;  ///< to either side, (0, pi]
};

struct RelocateParams {
  GroundPatchParams patch;
  GroundFitParams fit;
  double least_way_m = 40.0;  ///< before the first search
  double every_m = 15.0;      ///< between one search and the next
  double window_m = 150.0;    ///< of the way, whose ground is looked at
  double grid_m = 4.0;        ///< between hypotheses
  int hypotheses = 200'000;   ///< at most
  int rough_samples = 160;    ///< of the ground, for each hypothesis
  int samples = 1200;         ///< for those that are followed
  int followed = 24;          ///< best of the hypotheses
  int rounds = 14;            ///< of refinement
  double apart_m = 3.0;       ///< hypotheses nearer than this,
  double apart_rad = 0.05;    ///< and turned by less, are one
  double most_cost = 0.8;     ///< a block, of a place that is right; 0.5 by the sigmas
  /// Log likelihood by which the map must do better than planes, and the best place better than
  /// the next.
  double evidence = 15.0;
  double evidence_again = 5.0;   ///< the same of the ground that bears it out
  double again_m = 25.0;         ///< of way that bears it out, at least
  double again_blocks = 8.0;     ///< of ground likewise
  double most_sigma_m = 1.0;     ///< of the place along any direction
  double most_sigma_rad = 0.02;  ///< of the heading
  WorkUnits units = 200'000;     ///< a scan, at most
  double drift = 0.02;           ///< of the way: the start may look so far outside
};

enum class RelocateState : std::uint8_t {
  kOff,         ///< no region was given
  kCollecting,  ///< too little new ground for a search
  kSearching,
  kConfirming,  ///< one place is left: further ground must bear it out
  kFound
};

/// Why it does not say where it is.
enum class RelocateDoubt : std::uint8_t {
  kNone,
  kTooEarly,     ///< no search is over yet
  kNoMap,        ///< the map does not know the region
  kNothingFits,  ///< no place in the region looks like the ground: another place, another map
  kFeatureless,  ///< planes would look the same: the ground does not tell the place
  kAmbiguous,    ///< several places look like it
  kRefuted       ///< further ground did not bear it out
};

struct RelocateStatus {
  RelocateState state = RelocateState::kOff;
  RelocateDoubt doubt = RelocateDoubt::kNone;  ///< by the newest search that is over
  int hypotheses = 0;     ///< followed ones that can't be told apart by it, at most `followed`
  double spread_m = 0.0;  ///< root mean square of their distances from the best
  double way_m = 0.0;     ///< since the start
  double done = 0.0;      ///< share of the search under way
  int searches = 0;       ///< that are over
  int refuted = 0;        ///< places that further ground did not bear out
  // Of the best place; an answer when kFound alone.
  Pose T_map_level;
  Vec3 centre_level = Vec3::Zero();  ///< about which is the
  Mat6 covariance = Mat6::Zero();    ///< of (x, y, z [m], yaw, tilt [rad]), map axes
  double cost = 0.0;                 ///< a block
  double evidence = 0.0;             ///< against planes
  double margin = 0.0;               ///< against the next best place
};

/// Whether a region takes no more hypotheses than there may be.
[[nodiscard]] bool fits(const StartRegion& region, const RelocateParams& params);

/// Deterministic, in pieces of what work it is granted, with the same answer whatever the pieces:
/// a search is about the ground that was known when it began. Allocates nothing after the start.
class Relocator {
 public:
  explicit Relocator(const RelocateParams& params);

  /// The vehicle is in the region now, or at its next scan.
  /// @return false, and it is off, when the region takes more hypotheses than there may be
  [[nodiscard]] bool begin(const StartRegion& region);
  void stop();

  /// @param lowest_vehicle  the lowest points of columns of a scan
  /// @param T_level_vehicle  frame level: upright, and smooth over hundreds of metres
  void add(const Points& lowest_vehicle, const Pose& T_level_vehicle);

  /// @return the work used; at most what is granted
  WorkUnits work(const ElevationMap& map, WorkUnits granted);

  [[nodiscard]] const RelocateStatus& status() const { return status_; }

  /// Covariance of T_map_vehicle's place [m, map axes] and yaw, when kFound.
  [[nodiscard]] Mat<4> covariance_at(const Pose& T_level_vehicle) const;

 private:
  enum class Phase : std::uint8_t { kIdle, kSweep, kFollow, kAgain };
  struct Followed {
    GroundPlace place;
    GroundVerdict verdict;
    double spread_m = 0.0;
    int rounds = 0;
    bool lost = false;
  };

  void prepare();
  [[nodiscard]] GroundPlace on_grid(std::size_t k) const;
  void sweep(const ElevationMap& map, WorkUnits granted, WorkUnits* used);
  void pick();
  void follow(const ElevationMap& map, WorkUnits granted, WorkUnits* used);
  void conclude();
  void confirm(const ElevationMap& map, WorkUnits granted, WorkUnits* used);
  [[nodiscard]] bool in_region(const Pose& T_map_level) const;
  [[nodiscard]] bool same(const GroundPlace& a, const GroundPlace& b) const;
  void give_up(RelocateDoubt doubt);
  void tell(const GroundSubmap& submap, const Followed& best);

  RelocateParams params_;
  StartRegion region_;
  RelocateStatus status_;
  GroundPatch patch_;
  GroundSubmapWorkspace workspace_;
  std::vector<GroundCell> cells_;
  std::vector<double> residuals_;

  bool started_ = false;
  Pose T_level_start_;
  Vec3 last_p_level_ = Vec3::Zero();
  double searched_way_m_ = 0.0;

  // The search under way.
  Phase phase_ = Phase::kIdle;
  GroundSubmap submap_;
  double spread_m_ = 0.0;
  int side_ = 0;      // of the grid
  int headings_ = 0;  // of the grid
  std::size_t next_ = 0;
  std::vector<float> costs_;  // of the grid; infinite: not looked at, or nothing known there
  std::vector<Followed> followed_;
  std::size_t best_ = 0;
  GroundSubmap again_;
  double looked_way_m_ = 0.0;  // at which further ground was looked at
};

}  // namespace rcs::sp
