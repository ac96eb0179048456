// `rcs replay` on the command line: cases in which a replay that ran to its end is a failure.

#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "lcmtypes/channels.h"
#include "rcs/node/log/log_file.h"
#include "rcs/terrain/map_folder.h"
#include "tests/support/rcs_command.h"
#include "tools/mapping/map_writer.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A few seconds of the reference drive, made once.
class ReplayCommand : public RcsCommand {
 protected:
  static void SetUpTestSuite() {
    drive_ = (std::filesystem::temp_directory_path() / "rcs_replay_XXXXXX").string();
    RCS_CHECK(mkdtemp(drive_.data()) != nullptr);
    const std::string command = variable("RCS_BIN_DIR") + "/rcs sim " + variable("RCS_SOURCE_DIR") +
                                "/config/sim/drill.toml" + " --duration 12 -o " + drive_ +
                                "/run.log --prior-map " + drive_ + "/prior >/dev/null 2>&1";
    RCS_CHECK(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c)
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(drive_); }

  /// Replays with config/demo3.toml, `changed`, and `world` as its table [world].
  int replay(const std::string& world, const std::string& options = "",
             const std::function<void(std::string*)>& changed = {}) {
    std::string config = text_of(variable("RCS_SOURCE_DIR") + "/config/demo3.toml");
    if (changed) changed(&config);
    std::ofstream(folder_ + "/vehicle.toml") << config << "\n[world]\n" << world;
    return rcs("replay " + folder_ + "/vehicle.toml " + drive_ + "/run.log -o " + folder_ +
               "/out.log " + options);
  }

  static std::string drive_;
};
std::string ReplayCommand::drive_;

constexpr char kDatum[] =
    "datum_lat_deg = 40.4312\ndatum_lon_deg = -76.5683\ndatum_height_m = 150.0\n";

TEST_F(ReplayCommand, AReplayThatUsesAllDataSucceeds) {
  EXPECT_EQ(replay(std::string(kDatum) + "prior_map = \"" + drive_ + "/prior\"\n"), 0)
      << messages();
  EXPECT_EQ(replay("", "--without LADAR_RANGES,LADAR_POINTS"), 0)
      << "without a configured LADAR its absence is not reported: " << messages();
}

TEST_F(ReplayCommand, NoRegistrationIsAFailureWithAReason) {
  const auto other_ladar = [](std::string* config) {
    const std::size_t at = config->find("rows = ");
    RCS_CHECK(at != std::string::npos);
    config->replace(at, config->find('\n', at) - at, "rows = 64");
  };
  EXPECT_EQ(replay("", "", other_ladar), 1);
  EXPECT_THAT(messages(), HasSubstr("0 registrations"));
  EXPECT_THAT(messages(), HasSubstr("facet.rejected"));
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/out.log")) << "kept for analysis";
}

TEST_F(ReplayCommand, NoPoseIsAFailure) {
  const std::string log = folder_ + "/noise.log";
  Result<LogWriter> writer = LogWriter::create(log);
  ASSERT_TRUE(writer);
  const std::uint8_t noise[] = {1, 2, 3};
  for (int k = 0; k < 300; ++k) {
    for (const char* sensor : {channel::kIns, channel::kGpsFix, channel::kOdometry}) {
      ASSERT_TRUE(writer->write(from_utime(1'000'000'000 + 10'000 * k), sensor, noise, 3));
    }
  }
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(rcs("replay " + variable("RCS_SOURCE_DIR") + "/config/demo3.toml " + log + " -o " +
                folder_ + "/out.log"),
            1);
  EXPECT_THAT(messages(), HasSubstr("no pose: WM published none"));
}

TEST_F(ReplayCommand, TheRunIdDependsOnTheLogAndTheConfiguration) {
  const auto run_id = [this](const std::string& options) {
    EXPECT_EQ(replay("", options), 0) << messages();
    EXPECT_EQ(rcs("log csv --channel WM_NAV_STATE " + folder_ + "/out.log"), 0);
    std::istringstream table(out());
    std::string row;
    std::getline(table, row);
    EXPECT_THAT(row, HasSubstr("log_utime,utime,seq,run_id,publisher_id,"));
    std::getline(table, row);
    for (int k = 0; k < 3; ++k) row = row.substr(row.find(',') + 1);
    return row.substr(0, row.find(','));
  };
  const std::string first = run_id("");
  EXPECT_GT(std::stoll(first), 0);
  EXPECT_EQ(run_id(""), first);
  EXPECT_NE(run_id("--set odometry.constrained=false"), first);
}

TEST_F(ReplayCommand, APartWithoutSensorDataIsAFailureAndKeepsTheOldOutput) {
  std::ofstream(folder_ + "/out.log") << "precious";
  for (const char* part : {"--from 100", "--from 8 --to 4",
                           "--without LADAR_RANGES,LADAR_POINTS,INS,GPS_FIX,ODOMETRY"}) {
    EXPECT_EQ(replay("", part), 3) << part;
    EXPECT_THAT(messages(), HasSubstr("no sensor message")) << part;
    EXPECT_EQ(text_of(folder_ + "/out.log"), "precious") << part;
  }
}

TEST_F(ReplayCommand, TheEndOfTheLogIsNotASensorSilence) {
  ASSERT_EQ(replay(std::string(kDatum)), 0) << messages();
  ASSERT_EQ(rcs("log csv --channel SP_REGISTRATION " + folder_ + "/out.log"), 0);
  const std::string registrations = out();
  EXPECT_GE(std::count(registrations.begin(), registrations.end(), '\n'), 119)
      << "a head, and the results of 12 s at 10 Hz, to the last scans";
  ASSERT_EQ(rcs("log csv --channel WM_EVENT " + folder_ + "/out.log"), 0);
  EXPECT_THAT(out(), Not(HasSubstr("silent")));
  EXPECT_THAT(out(), Not(HasSubstr("lost")));
}

TEST_F(ReplayCommand, AFolderAsOutputIsRejectedBeforeTheReplay) {
  std::filesystem::create_directory(folder_ + "/out.log");
  EXPECT_EQ(replay(""), 3);
  EXPECT_THAT(messages(), HasSubstr("is a folder"));
  EXPECT_THAT(messages(), Not(HasSubstr("cycles"))) << "the work was not begun";
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/out.log.timing"));
}

TEST_F(ReplayCommand, ADatumFarFromTheFixesIsAFailure) {
  EXPECT_EQ(replay("datum_lat_deg = 49.0\ndatum_lon_deg = 8.4\ndatum_height_m = 110.0\n"), 1);
  EXPECT_THAT(messages(), HasSubstr("the configured datum (49.00000, 8.40000 deg) contradicts"));
}

TEST_F(ReplayCommand, AMapOfAnotherSiteIsAFailure) {
  const Result<MapFolder> map = MapFolder::open(drive_ + "/prior");
  ASSERT_TRUE(map);
  std::vector<std::uint8_t> buffer;
  const Result<Raster> tile = map->read(0, map->index().levels.front().tiles.front().tile, &buffer);
  ASSERT_TRUE(tile);
  MapFrame elsewhere = map->index().frame;
  elsewhere.datum.lat_rad += 0.002;  // 12 km
  ASSERT_TRUE(mapping::write_map(folder_ + "/elsewhere", elsewhere, *tile));
  EXPECT_EQ(replay(std::string(kDatum) + "prior_map = \"" + folder_ + "/elsewhere\"\n"), 1);
  EXPECT_THAT(messages(), HasSubstr("the a priori map does not overlap the drive"));
  EXPECT_THAT(messages(), Not(HasSubstr("contradicts")));
}

}  // namespace
}  // namespace rcs::test
