// `rcs drive`: drives of half a minute.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

class DriveCommand : public RcsCommand {
 protected:
  DriveCommand() { config_ = variable("RCS_SOURCE_DIR") + "/config/"; }

  std::string drive(const std::string& options) const {
    return "drive " + config_ + "sim/closed_loop.toml --duration 20 --config " + config_ +
           "demo3.toml " + options;
  }
  std::string config_;
};

TEST_F(DriveCommand, TheSameSeedsGiveTheSameDrivesWhateverTheNumberOfJobs) {
  ASSERT_EQ(rcs(drive("--seeds 3..4 --jobs 2 --json")), 1) << messages();
  const std::string two = out();
  ASSERT_EQ(rcs(drive("--seeds 3..4 --jobs 1 --json")), 1) << messages();
  EXPECT_EQ(out(), two);
  const auto json = nlohmann::json::parse(two);
  ASSERT_EQ(json["drives"].size(), 2U);
  EXPECT_EQ(json["drives"][1]["seed"], 4);
  EXPECT_EQ(json["summary"]["arrived"], 0);
  EXPECT_GT(json["drives"][0]["distance_m"], 10.0);
  EXPECT_GT(json["drives"][0]["states_s"]["DRIVING"], 3.0);
  EXPECT_NE(json["drives"][0]["distance_m"], json["drives"][1]["distance_m"]);
}

TEST_F(DriveCommand, WritesAPictureAndALogOfEachDrive) {
  ASSERT_EQ(rcs(drive("--seeds 3 --logs -o " + folder_ + "/drives")), 1) << messages();
  EXPECT_THAT(out(), HasSubstr("arrived 0 of 1"));
  EXPECT_THAT(text_of(folder_ + "/drives/drive_3.svg"), HasSubstr("</svg>"));
  EXPECT_EQ(nlohmann::json::parse(text_of(folder_ + "/drives/drives.json"))["schema"],
            "rcs.drive/1");
  ASSERT_EQ(rcs("log info " + folder_ + "/drives/drive_3.log"), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("BG_DRIVE"));
}

TEST_F(DriveCommand, NamesWhatIsWrong) {
  EXPECT_EQ(rcs(drive("--seeds 9..3")), 2);
  EXPECT_THAT(messages(), HasSubstr("9..3"));
  EXPECT_EQ(rcs(drive("--logs")), 2);
  EXPECT_THAT(messages(), HasSubstr("--out"));
  EXPECT_EQ(rcs("drive " + config_ + "sim/drill.toml --config " + config_ + "demo3.toml"), 3);
  EXPECT_THAT(messages(), HasSubstr("drill.toml: [drive] mode = \"commanded\" is required"));
  EXPECT_EQ(rcs("drive " + folder_ + "/none.toml"), 3);
  EXPECT_THAT(messages(), HasSubstr("none.toml"));
}

}  // namespace
}  // namespace rcs::test
