#pragma once
// Initial localization on the a priori map without GPS: a search in a region, with the ground
// observed along the path. The result is valid only after newly observed ground has confirmed it.

#include <cstdint>
#include <vector>

#include "modules/sp/prior/ground_fit.h"
#include "modules/sp/prior/ground_patch.h"
#include "rcs/base/work_units.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

/// Region of the vehicle's start, in the map's frame.
struct StartRegion {
  Vec2 middle_m = Vec2::Zero();
  double radius_m = 100.0;   ///< [1, 1000]
  double yaw_rad = 0.0;      ///< of the vehicle, counter-clockwise from east
  double within_rad = 0.35;  ///< to either side, (0, pi]
};

struct InitialLocalizationParams {
  GroundPatchParams patch;
  GroundFitParams fit;
  double min_travelled_m = 40.0;  ///< before the first search
  double every_m = 15.0;          ///< between one search and the next
  double window_m = 150.0;        ///< length of the path whose ground is matched
  double grid_m = 4.0;            ///< spacing of the hypotheses
  int hypotheses = 200'000;       ///< at most
  int rough_samples = 160;        ///< ground samples for each hypothesis
  int samples = 1200;             ///< and for each refined one
  int refined = 24;               ///< best hypotheses that are refined
  int rounds = 14;                ///< of refinement, at most
  double apart_m = 3.0;           ///< hypotheses nearer than this,
  double apart_rad = 0.05;        ///< and turned by less, count as one
  double max_cost = 0.8;          ///< of a block, at an accepted pose; 0.5 by the sigmas
  /// Log-likelihood ratio by which the map must be better than planes, and the best candidate
  /// better than the next.
  double evidence = 15.0;
  double confirm_evidence = 5.0;  ///< the same, for the ground that confirms it
  double confirm_m = 25.0;        ///< distance driven for the confirmation, at least
  double confirm_blocks = 8.0;    ///< blocks of ground likewise
  double max_sigma_m = 1.0;       ///< of the position along any direction
  double max_sigma_rad = 0.02;    ///< of the heading
  WorkUnits units = 200'000;      ///< for each scan, at most
  double drift = 0.02;            ///< per metre driven: tolerance of the start region
};

enum class InitialLocalizationState : std::uint8_t {
  kOff,         ///< no region was given
  kCollecting,  ///< too little new ground for a search
  kSearching,
  kConfirming,  ///< one candidate is left: newly observed ground must confirm it
  kFound
};

/// Why the start is unresolved.
enum class InitialLocalizationReason : std::uint8_t {
  kNone,
  kTooEarly,     ///< no search has finished yet
  kNoMap,        ///< the map has no data in the region
  kNothingFits,  ///< no pose in the region fits the ground: wrong region, or wrong map
  kFeatureless,  ///< planes fit as well: the ground does not determine the position
  kAmbiguous,    ///< several poses fit
  kRefuted       ///< newly observed ground refuted the candidate
};

struct InitialLocalizationStatus {
  InitialLocalizationState state = InitialLocalizationState::kOff;
  InitialLocalizationReason reason =
      InitialLocalizationReason::kNone;  ///< of the newest finished search
  int hypotheses = 0;        ///< refined ones that it cannot distinguish, at most `refined`
  double scatter_m = 0.0;    ///< root mean square of their distances from the best
  double travelled_m = 0.0;  ///< distance driven since the start
  double done = 0.0;         ///< share of the current search
  int searches = 0;          ///< finished
  int refuted = 0;           ///< candidates refuted by newly observed ground
  // Of the best candidate; a result only in state kFound.
  Pose T_map_level;
  Vec3 centre_level = Vec3::Zero();  ///< reference point of the covariance
  Mat6 covariance = Mat6::Zero();    ///< of (x, y, z [m], yaw, tilt [rad]), map axes
  double cost = 0.0;                 ///< of a block
  double evidence = 0.0;             ///< compared with planes
  double margin = 0.0;               ///< compared with the next best candidate
};

/// True if a region requires no more hypotheses than allowed.
[[nodiscard]] bool fits(const StartRegion& region, const InitialLocalizationParams& params);

/// Deterministic; works in pieces of the granted work, with a result independent of the pieces: a
/// search uses the ground known at its beginning. Allocates nothing after the start.
class InitialLocalizer {
 public:
  explicit InitialLocalizer(const InitialLocalizationParams& params);

  /// The vehicle is in the region now, or at its next scan.
  /// @return false, and the search is off, if the region requires more hypotheses than allowed
  [[nodiscard]] bool begin(const StartRegion& region);
  void stop();

  /// @param lowest_vehicle  the lowest points of columns of a scan
  /// @param T_level_vehicle  frame level: upright, and smooth over hundreds of metres
  void add(const Points& lowest_vehicle, const Pose& T_level_vehicle);

  /// @return the work used; at most what is granted
  WorkUnits work(const ElevationMap& map, WorkUnits granted);

  [[nodiscard]] const InitialLocalizationStatus& status() const { return status_; }

  /// Covariance of the position of T_map_vehicle [m, map axes] and of its yaw, if kFound.
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
  void give_up(InitialLocalizationReason reason);
  void tell(const GroundSubmap& submap, const Followed& best);

  InitialLocalizationParams params_;
  StartRegion region_;
  InitialLocalizationStatus status_;
  GroundPatch patch_;
  GroundSubmapWorkspace workspace_;
  std::vector<GroundCell> cells_;
  std::vector<double> residuals_;

  bool started_ = false;
  Pose T_level_start_;
  Vec3 last_p_level_ = Vec3::Zero();
  double searched_at_m_ = 0.0;

  // The current search.
  Phase phase_ = Phase::kIdle;
  GroundSubmap submap_;
  double spread_m_ = 0.0;
  int side_ = 0;      // of the grid
  int headings_ = 0;  // of the grid
  std::size_t next_ = 0;
  std::vector<float> costs_;  // of the grid; infinite: not evaluated, or no map data
  std::vector<Followed> followed_;
  std::size_t best_ = 0;
  GroundSubmap again_;
  double compared_at_m_ = 0.0;  // at the last evaluation of new ground
};

}  // namespace rcs::sp
