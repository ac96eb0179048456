#pragma once
// The start without GPS, as SP's shell does it: a search on the a priori map, until WM knows the
// world.

#include <optional>

#include "modules/registration/registration.h"
#include "modules/sp/scan/column_sampler.h"
#include "modules/sp/sp_config.h"
#include "modules/sp/start/initial_localization.h"
#include "rcs/node/report.h"
#include "rcs/prior/prior_terrain.h"

namespace rcs::sp {

class StartSearch {
 public:
  /// Off without [start] or without a map.
  StartSearch(const SpConfig& config, const PriorTerrain& prior);

  [[nodiscard]] bool on() const { return relocator_.has_value(); }
  /// Of a search that is on.
  [[nodiscard]] const RelocateStatus& status() const { return relocator_->status(); }

  /// The world is known.
  void stop() { relocator_.reset(); }

  /// While it is on: takes in a scan's points and goes on with the search.
  /// @param T_level_vehicle  upright and smooth
  /// @return once it is found, with each scan: where the vehicle is, in frame world
  [[nodiscard]] std::optional<registration::Registration> step(const Points& points_vehicle,
                                                               const Pose& T_level_vehicle,
                                                               WorkUnits granted, Stamp now,
                                                               PriorTerrain* prior, Report* report);

 private:
  void tell(Stamp now, Report* report);

  RelocateParams params_;
  StartRegion region_;
  std::optional<Relocator> relocator_;
  ColumnSampler sampler_;
  Points lowest_;
  bool begun_ = false;
  Pose T_level_start_;
  RelocateState told_state_ = RelocateState::kCollecting;
  RelocateDoubt told_doubt_ = RelocateDoubt::kTooEarly;
};

/// The answer as a registration to the a priori map: all directions told, none of a prediction.
/// @param covariance  of (x, y, z [m], yaw [rad]), map axes
[[nodiscard]] registration::Registration as_registration(const Pose& T_map_vehicle,
                                                         const Mat<4>& covariance,
                                                         double tilt_sigma_rad);

}  // namespace rcs::sp
