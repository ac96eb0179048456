#pragma once
// Initial localization in node SP: a search on the a priori map until WM has a position in frame
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

  [[nodiscard]] bool on() const { return localizer_.has_value(); }
  /// Status of a search that is on.
  [[nodiscard]] const InitialLocalizationStatus& status() const { return localizer_->status(); }

  /// Frame world is known.
  void stop() { localizer_.reset(); }

  /// While it is on: adds the points of a scan and continues the search.
  /// @param T_level_vehicle  upright and smooth
  /// @return once it is found, for each scan: the pose of the vehicle in frame world
  [[nodiscard]] std::optional<registration::Registration> step(const Points& points_vehicle,
                                                               const Pose& T_level_vehicle,
                                                               WorkUnits granted, Stamp now,
                                                               PriorTerrain* prior, Report* report);

 private:
  void tell(Stamp now, Report* report);

  InitialLocalizationParams params_;
  StartRegion region_;
  std::optional<InitialLocalizer> localizer_;
  ColumnSampler sampler_;
  Points lowest_;
  bool begun_ = false;
  Pose T_level_start_;
  InitialLocalizationState reported_state_ = InitialLocalizationState::kCollecting;
  InitialLocalizationReason reported_reason_ = InitialLocalizationReason::kTooEarly;
};

/// The result as a registration to the a priori map: information in all directions, none of it from
/// a prediction.
/// @param covariance  of (x, y, z [m], yaw [rad]), map axes
[[nodiscard]] registration::Registration as_registration(const Pose& T_map_vehicle,
                                                         const Mat<4>& covariance,
                                                         double tilt_sigma_rad);

}  // namespace rcs::sp
