#include "tools/driving/drive_campaign.h"

#include <gtest/gtest.h>

namespace rcs::driving {
namespace {

TEST(DriveCampaign, ADriveHasPassedOnlyIfItReachedAllWaypoints) {
  ClosedLoopRun run;
  run.waypoints_world = {{10.0, 0.0}, {20.0, 0.0}};
  run.done = true;
  run.reached = 2;
  EXPECT_TRUE(passed(run));
  run.reached = 1;
  EXPECT_FALSE(passed(run)) << "a task that was reported as done too early";
  run.reached = 2;
  run.alerts.late = 1;
  EXPECT_FALSE(passed(run));
}

}  // namespace
}  // namespace rcs::driving
