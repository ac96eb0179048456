// Predicted uncertainty of WM along a path if GPS were lost now.
#include "modules/wm/path_uncertainty_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/local_bus.h"
#include "tests/support/heap_guard.h"
#include "tests/terrain/map_scene.h"
#include "tools/mapping/map_writer.h"

namespace rcs::wm {
namespace {

constexpr int kMaxCycles = 2000;

// 2 km along x, 400 m along y, hills everywhere, surveyed so well that their slopes are no errors.
Raster ground() {
  Raster r = test::hills({2.0, Vec2::Zero(), 0.3, 500.0}, {-100, -100}, 1000, 200);
  for (float& sigma_m : r.sigma_m) sigma_m *= 0.2F;
  return r;
}

PriorTerrain in_memory() {
  Result<ElevationMap> map = ElevationMap::from_rasters(test::frame(), {ground()});
  EXPECT_TRUE(map) << map.error().message;
  return {std::move(map).value(), nullptr};
}

class PathUncertaintyServerTest : public ::testing::Test {
 protected:
  PathUncertaintyServerTest()
      : queries_(&bus_, channel::kWmPathQuery), answers_(&bus_, channel::kWmPathUncertainty, 4) {
    state_.belief.x.T_world_vehicle.p = Vec3(10.0, -20.0, 5.0);
    state_.belief.P.diagonal().setConstant(1e-6);
    state_.belief.P.diagonal().segment<2>(kPosition).setConstant(0.25);
  }

  void ask(std::int64_t serial, const std::vector<Vec2>& places,
           const std::string& issuer = "test") {
    path_query_t query{};
    query.issuer = issuer;
    query.serial = serial;
    query.n = static_cast<std::int32_t>(places.size());
    for (const Vec2& p : places) {
      query.x_m.push_back(p.x());
      query.y_m.push_back(p.y());
    }
    queries_.publish(&query);
    deliver();
  }
  void step(PathUncertaintyServer* server, const FilterState* state) {
    server->step(state, &frame_, now_, &report_);
    deliver();
    now_ += from_milliseconds(20.0);
  }
  /// Cycles until a result is published.
  int answer(PathUncertaintyServer* server) {
    for (int cycles = 1; cycles <= kMaxCycles; ++cycles) {
      step(server, &state_);
      if (!answers_.empty()) return cycles;
    }
    ADD_FAILURE() << "no result";
    return 0;
  }
  void deliver() {
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now_);
  }

  LocalBus bus_;
  Report report_{&bus_, "wm", from_seconds(5.0)};
  LocalFrame frame_{test::frame().datum};
  FilterState state_;
  Stamp now_ = from_utime(1'000'000);
  Outbox<path_query_t> queries_;
  Inbox<path_uncertainty_t> answers_;
};

TEST_F(PathUncertaintyServerTest, ReportsTheWholePathOnePositionPerCycle) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  ask(7, {{500.0, -20.0}, {500.0, 80.0}});
  const int cycles = answer(&server);
  const path_uncertainty_t& m = *answers_.front();
  EXPECT_EQ(m.issuer, "test");
  EXPECT_EQ(m.serial, 7);
  EXPECT_EQ(m.state, int{path_uncertainty_t::STATE_ANSWERED});
  EXPECT_EQ(m.has_map, 1);
  EXPECT_EQ(m.map_bias_sigma_m, 0.3);
  ASSERT_EQ(m.n, 1 + 590 / 25);
  EXPECT_EQ(cycles, m.n);
  EXPECT_EQ(m.travelled_m[4], 100.0F);
  EXPECT_EQ(m.x_m[4], 110.0F);
  EXPECT_EQ(m.y_m[4], -20.0F);
  EXPECT_EQ(m.sigma_dead_reckoning_m[0], 0.5F);
  EXPECT_NEAR(m.sigma_dead_reckoning_m.back(), std::hypot(0.5, 575.0 * std::hypot(0.002, 0.001)),
              1e-3);
  // The same result as without cycles and messages.
  const PriorTerrain prior = in_memory();
  const auto whole =
      path_uncertainty_along(prior.map(), {{10.0, -20.0}, {500.0, -20.0}, {500.0, 80.0}},
                             {0.5, std::hypot(0.002, 0.001)}, {});
  ASSERT_EQ(whole.size(), m.sigma_with_map_m.size());
  for (std::size_t k = 0; k < whole.size(); ++k) {
    EXPECT_NEAR(m.sigma_with_map_m[k], whole[k].sigma_with_map_m, 1e-4) << k;
  }
  EXPECT_LT(m.sigma_with_map_m.back(), 0.9F * m.sigma_dead_reckoning_m.back());
}

TEST_F(PathUncertaintyServerTest, APositionInAnotherDatumIsTheSamePosition) {
  // WM's frame world begins 300 m east of the map's; the vehicle and its path are unchanged.
  PathUncertaintyServer here({}, in_memory(), &bus_);
  ask(1, {{510.0, -20.0}});
  answer(&here);
  const path_uncertainty_t in_map = *answers_.latest();
  answers_.pop();
  const LocalFrame map_frame{test::frame().datum};
  frame_ = LocalFrame(map_frame.to_geodetic(Vec3(300.0, 0.0, 0.0)));
  state_.belief.x.T_world_vehicle.p.x() -= 300.0;
  PathUncertaintyServer there({}, in_memory(), &bus_);
  ask(1, {{210.0, -20.0}});
  answer(&there);
  const path_uncertainty_t in_world = *answers_.latest();
  ASSERT_EQ(in_map.n, in_world.n);
  for (std::size_t k = 0; k < in_map.travelled_m.size(); ++k) {
    EXPECT_NEAR(in_map.sigma_with_map_m[k], in_world.sigma_with_map_m[k], 2e-3) << k;
  }
}

TEST_F(PathUncertaintyServerTest, AVeryLongPathHasAThousandPositions) {
  PathUncertaintyServer server({}, PriorTerrain(), &bus_);
  ask(1, {{100'000.0, 0.0}});
  answer(&server);
  const path_uncertainty_t& m = *answers_.front();
  EXPECT_NEAR(m.n, 1000, 2);
  EXPECT_NEAR(m.travelled_m.back(), 1e5, 110.0);
}

TEST_F(PathUncertaintyServerTest, WithAnExcludedMapOrLadarBothPredictionsUseMotionOnly) {
  state_.bookkeeping.excluded.prior_map = true;
  PathUncertaintyServer server({}, in_memory(), &bus_);
  ask(1, {{500.0, -20.0}});
  answer(&server);
  EXPECT_EQ(answers_.front()->has_map, 0);
  EXPECT_EQ(answers_.front()->map_bias_sigma_m, 0.0);
  EXPECT_EQ(answers_.front()->sigma_with_map_m, answers_.front()->sigma_dead_reckoning_m);
  answers_.pop();
  state_.bookkeeping.excluded = {};
  state_.bookkeeping.excluded.ladar = true;
  ask(2, {{500.0, -20.0}});
  answer(&server);
  EXPECT_EQ(answers_.front()->has_map, 0);
  answers_.pop();
  state_.bookkeeping.excluded = {};
  ask(3, {{500.0, -20.0}});
  answer(&server);
  EXPECT_EQ(answers_.front()->has_map, 1) << "readmitted";
  EXPECT_LT(answers_.front()->sigma_with_map_m.back(),
            answers_.front()->sigma_dead_reckoning_m.back());
}

TEST_F(PathUncertaintyServerTest, WithoutAMapBothPredictionsUseMotionOnly) {
  PathUncertaintyServer server({}, PriorTerrain(), &bus_);
  ask(1, {{500.0, 0.0}});
  answer(&server);
  const path_uncertainty_t& m = *answers_.front();
  EXPECT_EQ(m.has_map, 0);
  EXPECT_EQ(m.sigma_with_map_m, m.sigma_dead_reckoning_m);
}

TEST_F(PathUncertaintyServerTest, AnInvalidQueryIsRejectedAtOnce) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  ask(1, {{500.0, 0.0}});
  step(&server, nullptr);
  ASSERT_NE(answers_.front(), nullptr);
  EXPECT_EQ(answers_.latest()->state, int{path_uncertainty_t::STATE_NO_WORLD});
  answers_.pop();
  std::int64_t serial = 1;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::vector<Vec2>& bad :
       {std::vector<Vec2>{}, std::vector<Vec2>(1001, Vec2::Zero()), std::vector<Vec2>{{nan, 0.0}},
        std::vector<Vec2>{{0.0, 1e12}}}) {
    ask(++serial, bad);
    step(&server, &state_);
    ASSERT_NE(answers_.front(), nullptr);
    EXPECT_EQ(answers_.front()->state, int{path_uncertainty_t::STATE_BAD_PATH});
    EXPECT_EQ(answers_.front()->n, 0);
    answers_.pop();
  }
}

TEST_F(PathUncertaintyServerTest, ARepeatedQueryIsNotRestartedAndIsReportedAgain) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  const std::vector<Vec2> path{{500.0, -20.0}};
  ask(3, path);
  for (int k = 0; k < 10; ++k) step(&server, &state_);
  ask(3, path);
  EXPECT_EQ(answer(&server), 20 - 10);
  const path_uncertainty_t first = *answers_.latest();
  answers_.pop();
  ask(3, path);
  EXPECT_EQ(answer(&server), 1);
  EXPECT_EQ(answers_.latest()->sigma_with_map_m, first.sigma_with_map_m);
}

TEST_F(PathUncertaintyServerTest, ANewerQueryOfAnIssuerReplacesItsOlder) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  ask(1, {{1500.0, -20.0}});
  for (int k = 0; k < 10; ++k) step(&server, &state_);
  ask(2, {{60.0, -20.0}});
  ask(1, {{1500.0, -20.0}});  // late
  answer(&server);
  EXPECT_EQ(answers_.latest()->serial, 2);
  EXPECT_EQ(answers_.latest()->n, 3);
}

// If repeated queries of two issuers cancelled each other, neither would get a result.
TEST_F(PathUncertaintyServerTest, QueriesOfTwoIssuersAreProcessedInTurn) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  const std::vector<Vec2> path{{1500.0, -20.0}};
  std::vector<std::string> answered;
  for (int cycles = 0; cycles < 300; ++cycles) {
    if (cycles % 25 == 0) ask(1, path, "one");
    if (cycles % 25 == 12) ask(2, path, "two");
    step(&server, &state_);
    for (; !answers_.empty(); answers_.pop()) answered.push_back(answers_.front()->issuer);
  }
  ASSERT_GE(answered.size(), 2U);
  EXPECT_EQ(answered[0], "one");
  EXPECT_GT(std::count(answered.begin(), answered.end(), "two"), 0);
}

TEST_F(PathUncertaintyServerTest, ATooLongIssuerNameIsIgnored) {
  PathUncertaintyServer server({}, in_memory(), &bus_);
  ask(1, {{60.0, -20.0}}, std::string(65, 'x'));
  for (int k = 0; k < 20; ++k) step(&server, &state_);
  EXPECT_TRUE(answers_.empty());
}

TEST_F(PathUncertaintyServerTest, TilesAreLoadedAlongThePathAndReleased) {
  const std::string folder =
      (std::filesystem::path(::testing::TempDir()) / "path_uncertainty_server_map").string();
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(mapping::write_map(folder, test::frame(), ground()));
  PriorTerrainParams params;
  params.map = folder;
  params.window = {50.0, 20e6};
  Result<PriorTerrain> prior = open_prior_terrain(params, false);
  ASSERT_TRUE(prior) << prior.error().message;
  PathUncertaintyServer server({}, std::move(prior).value(), &bus_);
  PathUncertaintyServer whole({}, in_memory(), &bus_);
  ask(1, {{1700.0, -20.0}});
  step(&server, &state_);
  step(&whole, &state_);
  answer(&server);
  const path_uncertainty_t by_tiles = *answers_.latest();
  answers_.pop();
  answer(&whole);
  EXPECT_EQ(by_tiles.sigma_with_map_m, answers_.latest()->sigma_with_map_m);
  std::filesystem::remove_all(folder);
}

TEST_F(PathUncertaintyServerTest, AResultAfterWarmUpDoesNotAllocate) {
  if (!test::HeapGuard::available()) GTEST_SKIP() << "a sanitizer owns malloc";
  PathUncertaintyServer server({}, in_memory(), &bus_);
  constexpr std::int64_t kWarm = 6;  // each slot of the inbox here has held a message
  for (std::int64_t serial = 1; serial <= kWarm; ++serial) {
    ask(serial, {{500.0, -20.0}, {900.0, 50.0}});
    const test::HeapGuard guard;
    answer(&server);
    const std::int64_t allocations = guard.allocations();
    if (serial == kWarm) {
      EXPECT_EQ(allocations, 0);
    }
    answers_.pop();
  }
}

}  // namespace
}  // namespace rcs::wm
