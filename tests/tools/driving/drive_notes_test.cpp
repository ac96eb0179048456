// What a closed-loop drive records about its speed and about the predictions for its routes.

#include <gtest/gtest.h>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/outbox.h"
#include "tools/driving/prediction_notes.h"
#include "tools/driving/speed_notes.h"

namespace rcs::driving {
namespace {

class DriveNotes : public testing::Test {
 protected:
  /// The vehicle is at (x, 0), some time after the last call.
  void nav(double x_m, double speed_mps, double after_s, double sigma_m = 0.1,
           std::int64_t gps_age_us = -1) {
    utime_ += static_cast<std::int64_t>(1e6 * after_s);
    nav_state_t m{};
    m.utime = utime_;
    m.world_valid = 1;
    m.age_gps_us = gps_age_us;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
    m.p_world_vehicle_m[0] = m.p_local_vehicle_m[0] = x_m;
    m.v_world_mps[0] = speed_mps;
    m.cov_world_pose[0][0] = m.cov_world_pose[1][1] = sigma_m * sigma_m;
    nav_states_.publish(&m);
    deliver();
  }
  void deliver() {
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(Stamp(Duration(utime_)));
  }

  std::int64_t utime_ = 1'000'000;
  LocalBus bus_;
  Outbox<nav_state_t> nav_states_{&bus_, channel::kWmNavState};
};

class SpeedNotesTest : public DriveNotes {
 protected:
  /// A path of 10 m along x: turns at first, and then ends.
  void plan() {
    plan_t m{};
    m.n = 11;
    m.point.resize(11);
    for (std::size_t k = 0; k < m.point.size(); ++k) {
      m.point[k].p_m[0] = static_cast<double>(k);
      m.point[k].speed_mps = 3.0;
      m.point[k].limit = k < 5 ? plan_point_t::LIMIT_TURN : plan_point_t::LIMIT_END;
    }
    plans_.publish(&m);
    deliver();
  }
  void command(double speed_mps) {
    drive_t m{};
    m.speed_mps = speed_mps;
    drives_.publish(&m);
    deliver();
  }

  Outbox<plan_t> plans_{&bus_, channel::kBgPlan};
  Outbox<drive_t> drives_{&bus_, channel::kBgDrive};
  SpeedNotes notes_{&bus_};
};

TEST_F(SpeedNotesTest, TheTimeIsThatOfTheLimitWhereTheVehicleIs) {
  nav(0.0, 0.0, 0.1);
  nav(0.0, 0.0, 5.0);
  EXPECT_TRUE(notes_.limited_s().empty()) << "nothing is driven yet";
  plan();
  nav(0.0, 0.0, 0.5);
  command(3.0);
  nav(1.0, 1.0, 1.0);
  nav(3.0, 2.9, 2.0);
  nav(7.1, 2.9, 4.0);
  command(1.0);
  nav(8.0, 1.5, 8.0);
  command(-3.0);
  nav(8.0, -2.9, 16.0);
  const std::map<std::string, double> expected = {{"at rest", 0.5},
                                                  {"acceleration", 1.0},
                                                  {"turn", 2.0},
                                                  {"end of the path", 20.0},
                                                  {"obstacle ahead", 8.0}};
  ASSERT_EQ(notes_.limited_s().size(), expected.size());
  for (const auto& [limit, time_s] : expected) {
    EXPECT_NEAR(notes_.limited_s().at(limit), time_s, 1e-6) << limit;
  }
}

class PredictionNotesTest : public DriveNotes {
 protected:
  /// Along x at this distance from it, 0 to 100 m.
  void predict(double y_m, float sigma_m) {
    path_uncertainty_t m{};
    m.issuer = "mission";
    m.n = 5;
    for (int k = 0; k < m.n; ++k) {
      m.travelled_m.push_back(25.0F * static_cast<float>(k));
      m.x_m.push_back(25.0F * static_cast<float>(k));
      m.y_m.push_back(static_cast<float>(y_m));
      m.sigma_dead_reckoning_m.push_back(9.0F);
      m.sigma_with_map_m.push_back(sigma_m);
    }
    predictions_.publish(&m);
    deliver();
  }
  void choose(double y_m, bool gps) {
    routes_t m{};
    m.gps = gps ? 1 : 0;
    for (const double y : {y_m, 80.0}) {
      route_t r{};
      r.verdict = y == y_m ? route_t::VERDICT_CHOSEN : route_t::VERDICT_DEARER;
      r.n = 2;
      r.x_m = {0.0, 100.0};
      r.y_m = {y, y};
      m.route.push_back(r);
    }
    m.n = 2;
    routes_.publish(&m);
    deliver();
  }

  Outbox<path_uncertainty_t> predictions_{&bus_, channel::kWmPathUncertainty};
  Outbox<routes_t> routes_{&bus_, channel::kMissionRoutes};
  PredictionNotes notes_{&bus_};
};

TEST_F(PredictionNotesTest, ComparesWithThePredictionForTheChosenRoute) {
  predict(80.0, 5.0F);
  predict(0.0, 0.5F);
  predict(40.0, 7.0F);
  choose(0.0, false);
  nav(25.0, 3.0, 1.0, 0.5);
  nav(50.0, 3.0, 1.0, 0.75);
  nav(55.0, 3.0, 0.1, 50.0);  // less than a second later
  nav(75.0, 3.0, 1.0, 2.0);
  const PredictionOutcome outcome = notes_.outcome();
  ASSERT_EQ(outcome.ratios.size(), 3U);
  EXPECT_NEAR(outcome.ratios[0], 1.0, 1e-6);
  EXPECT_NEAR(outcome.ratios[1], 1.5, 1e-6);
  EXPECT_NEAR(outcome.ratios[2], 4.0, 1e-6);
  EXPECT_NEAR(outcome.predicted_max_m, 0.5, 1e-6);
  EXPECT_NEAR(outcome.stated_max_m, 2.0, 1e-6);
  EXPECT_NEAR(share_predicted(outcome.ratios), 2.0 / 3.0, 1e-9);
}

TEST_F(PredictionNotesTest, NothingIsComparedWithGpsOrOffTheRoute) {
  predict(0.0, 0.5F);
  choose(0.0, true);
  nav(25.0, 3.0, 1.0);
  choose(0.0, false);
  nav(25.0, 3.0, 1.0, 0.5, 100'000);  // a fix is received
  nav(200.0, 3.0, 1.0);
  EXPECT_TRUE(notes_.outcome().ratios.empty());
  EXPECT_EQ(share_predicted({}), 1.0);
}

}  // namespace
}  // namespace rcs::driving
