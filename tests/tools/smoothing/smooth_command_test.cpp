// `rcs smooth` on the command line, on a simulated drive of some seconds.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

class SmoothCommand : public RcsCommand {
 protected:
  SmoothCommand() {
    const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
    config_ = "--config " + config + "demo3.toml ";
    simulate_ = "sim " + config + "sim/drill.toml --duration 12 -o " + log_;
  }

  std::string log_ = folder_ + "/drive.log";
  std::string truth_ = folder_ + "/truth.tum";
  std::string config_;
  std::string simulate_;
};

TEST_F(SmoothCommand, WritesPosesSigmasAndAReportRepeatably) {
  ASSERT_EQ(rcs(simulate_), 0) << messages();
  ASSERT_EQ(rcs("smooth " + log_ + " " + config_ + "--rounds 1 -o " + truth_), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("frame world"));
  EXPECT_THAT(out(), HasSubstr("less its mean"));
  const json j = json::parse(text_of(truth_ + ".json"));
  EXPECT_EQ(j["frame"], "world");
  EXPECT_GT(j["edges"]["consecutive"]["edges"], 5);
  EXPECT_LT(j["errors"]["position_rms_m"], 0.1);
  EXPECT_LT(j["errors"]["rotation_less_mounting_rms_deg"], 0.1);
  EXPECT_TRUE(j["errors"]["offset_within_95_percent"]);
  const auto poses = j["poses"].get<std::size_t>();
  EXPECT_GT(poses, 60U);
  EXPECT_EQ(lines(text_of(truth_ + ".kitti")), poses);
  EXPECT_EQ(lines(text_of(truth_ + ".sigma.csv")), poses + 1);
  EXPECT_GE(lines(text_of(truth_ + ".scans")), poses);
  const std::string first = text_of(truth_);
  ASSERT_EQ(rcs("smooth " + log_ + " " + config_ + "--rounds 1 --jobs 2 -o " + truth_), 0);
  EXPECT_EQ(text_of(truth_), first);
}

TEST_F(SmoothCommand, WithoutGpsTheFrameIsLocalAndReported) {
  ASSERT_EQ(rcs(simulate_ + " --gps-outage 0,100"), 0) << messages();
  ASSERT_EQ(rcs("smooth " + log_ + " " + config_ + "--rounds 1 -o " + truth_), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("no GPS: the poses are in frame local"));
  EXPECT_LT(json::parse(text_of(truth_ + ".json"))["errors"]["position_rms_m"], 0.6);
}

TEST_F(SmoothCommand, ErrorsAreReportedAndLeaveNoFile) {
  EXPECT_EQ(rcs("smooth"), 2);
  EXPECT_EQ(rcs("smooth nothing.log " + config_ + "-o " + truth_), 3);
  std::ofstream(log_) << "no log at all";
  EXPECT_EQ(rcs("smooth " + log_ + " " + config_), 2);
  EXPECT_EQ(rcs("smooth " + log_ + " " + config_ + "--rounds 0 -o " + truth_), 2);
  EXPECT_EQ(rcs("smooth " + log_ + " " + config_ + "-o " + truth_), 3);
  EXPECT_THAT(messages(), HasSubstr("no sensor data"));
  ASSERT_EQ(rcs(simulate_ + " --ladar-outage 0,100"), 0) << messages();
  EXPECT_EQ(rcs("smooth " + log_ + " " + config_ + "-o " + truth_), 3);
  EXPECT_THAT(messages(), HasSubstr("no usable scans"));
  EXPECT_FALSE(std::filesystem::exists(truth_));
  EXPECT_FALSE(std::filesystem::exists(truth_ + ".json"));
}

TEST_F(SmoothCommand, ATruncatedLogGivesTheReferenceTrajectoryOfItsBeginning) {
  ASSERT_EQ(rcs(simulate_), 0) << messages();
  std::filesystem::resize_file(log_, std::filesystem::file_size(log_) * 3 / 4);
  ASSERT_EQ(rcs("smooth " + log_ + " " + config_ + "--rounds 1 -o " + truth_), 0) << messages();
  EXPECT_GT(lines(text_of(truth_)), 20U);
}

}  // namespace
}  // namespace rcs::test
