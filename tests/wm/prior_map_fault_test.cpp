// Weight of a tile of the a priori map.
#include <gtest/gtest.h>

#include "modules/wm/alignment.h"
#include "modules/wm/filter.h"

namespace rcs::wm {
namespace {

/// A vehicle with a position sigma of a decimetre, and matches a metre apart.
class Drive {
 public:
  explicit Drive(double sigma_m) {
    state_.belief = initial_belief(WmParams{}, from_utime(1'000'000));
    state_.belief.P.diagonal().segment<3>(kPosition).setConstant(sigma_m * sigma_m);
    state_.belief.P.diagonal().segment<3>(kAttitude).setConstant(1e-6);
    state_.bookkeeping.georeferenced = true;
  }

  /// @return the reason of the newest of several matches with this position difference
  Reason match(int matches, const Vec3& off, std::int64_t tile_id, const MapBias& bias) {
    Reason reason = Reason::kInvalid;
    for (int i = 0; i < matches; ++i) {
      state_.bookkeeping.distance_m += 1.0;
      state_.belief.P.diagonal().segment<3>(kPosition).array() +=
          1e-4;  // the belief drifts a little
      PriorMatch z;
      z.T_world_vehicle = state_.belief.x.T_world_vehicle;
      z.T_world_vehicle.p = off;
      z.information = 1e4 * Mat6::Identity();
      z.tile_id = tile_id;
      z.bias = bias;
      Innovations records;
      apply(model_, {state_.belief.x.stamp, z}, &state_, &records);
      reason = records.records[0].reason;
    }
    return reason;
  }
  [[nodiscard]] const FilterState& state() const { return state_; }

 private:
  Model model_{WmParams{}};
  FilterState state_;
};

constexpr MapBias kSurvey{0.1, 500.0};
const Vec3 kWrong(4.0, 0.0, 0.0);

TEST(PriorMapFault, AWrongTileIsDetectedNeverFollowedAndRegainsWeightByAgreement) {
  Drive drive(0.1);
  EXPECT_EQ(drive.match(30, Vec3::Zero(), 1, kSurvey), Reason::kAccepted);
  EXPECT_NE(drive.match(1, kWrong, 1, kSurvey), Reason::kAccepted);
  EXPECT_EQ(drive.match(30, kWrong, 1, kSurvey), Reason::kQuarantine);
  EXPECT_TRUE(drive.state().bookkeeping.newest_tile.suspected);
  EXPECT_EQ(drive.state().bookkeeping.newest_tile.tile_id, 1);
  EXPECT_GT(drive.state().bookkeeping.newest_tile.excess, TileStatus::kReadmittedBelow);
  EXPECT_LT(drive.state().belief.x.T_world_vehicle.p.norm(), 0.05);
  // The next tile of a wrong survey does not start with full weight.
  EXPECT_EQ(drive.match(1, kWrong, 2, kSurvey), Reason::kQuarantine);
  EXPECT_EQ(drive.match(400, Vec3::Zero(), 2, kSurvey), Reason::kAccepted);
  EXPECT_FALSE(drive.state().bookkeeping.newest_tile.suspected);
  // The first tile has not yet agreed again.
  EXPECT_EQ(drive.match(1, Vec3::Zero(), 1, kSurvey), Reason::kQuarantine);
}

TEST(PriorMapFault, AnUncertainPositionDoesNotChangeTheWeightOfATile) {
  Drive drive(20.0);
  EXPECT_EQ(drive.match(1, kWrong, 1, kSurvey), Reason::kAccepted);
  for (const TileStatus& tile : drive.state().bookkeeping.tiles) EXPECT_NEAR(tile.excess, 1.0, 0.1);
}

TEST(PriorMapFault, TheErrorOfTheSurveyIsAccepted) {
  Drive drive(20.0);
  const auto offset_variance = [&] { return drive.state().belief.P(kMapBias, kMapBias); };
  drive.match(1, Vec3::Zero(), 1, {});
  EXPECT_NEAR(offset_variance(), 1.0, 0.1);  // the map does not state its error
  const double margin = WmParams{}.prior.bias_margin;
  drive.match(1, Vec3::Zero(), 2, kSurvey);
  EXPECT_NEAR(offset_variance(), std::pow(margin * kSurvey.sigma_m, 2.0), 0.02);
  EXPECT_LT(drive.state().belief.P(kPosition, kPosition), 0.15);
}

}  // namespace
}  // namespace rcs::wm
