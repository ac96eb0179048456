// `rcs map build` on the command line, on a simulated drive.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/node/log/log_file.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "sim/scenario_file.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// 14 s of a drive through grass and between rocks, made once for all tests.
class MapBuild : public RcsCommand {
 protected:
  static void SetUpTestSuite() {
    drive_ = (std::filesystem::temp_directory_path() / "rcs_map_build_XXXXXX").string();
    RCS_CHECK(mkdtemp(drive_.data()) != nullptr);
    const std::string source = variable("RCS_SOURCE_DIR");
    std::ofstream(drive_ + "/drive.toml")
        << "based_on = \"" << source << "/config/sim/meadow.toml\"\nduration_s = 14\nseed = 6\n";
    const std::string rcs = variable("RCS_BIN_DIR") + "/rcs ";
    const std::string quiet = " >/dev/null 2>&1";
    const std::string commands = rcs + "sim " + scenario() + " -o " + drive_ +
                                 "/sensors.log --prior-map " + drive_ + "/survey" + quiet + " && " +
                                 rcs + "replay " + config() + " " + drive_ + "/sensors.log -o " +
                                 run() + quiet;
    RCS_CHECK(std::system(commands.c_str()) == 0);  // NOLINT(cert-env33-c)
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(drive_); }

  static std::string scenario() { return drive_ + "/drive.toml"; }
  static std::string config() { return variable("RCS_SOURCE_DIR") + "/config/demo3.toml"; }
  static std::string run() { return drive_ + "/run.log"; }
  static std::string sensors() { return drive_ + "/sensors.log"; }
  [[nodiscard]] std::string map() const { return folder_ + "/map"; }

  /// |height - true bare ground| where at least 5 scans observed it, and the share within 2 sigma.
  void errors(std::vector<double>* e, double* within, std::size_t* filled = nullptr) const {
    const Result<sim::Scenario> scene = sim::load_scenario(scenario(), {});
    ASSERT_TRUE(scene);
    const sim::Course course(scene->course);
    const sim::World world(scene->world, scene->dem, course.points(), 80.0);
    const Result<MapFolder> folder = MapFolder::open(map());
    ASSERT_TRUE(folder);
    const Pose T = LocalFrame(scene->datum).from(LocalFrame(folder->index().frame.datum));
    const MapLevelIndex& finest = folder->index().levels.front();
    std::vector<std::uint8_t> buffer;
    std::size_t good = 0;
    for (const MapTileEntry& entry : finest.tiles) {
      const Result<Raster> r = folder->read(0, entry.tile, &buffer);
      ASSERT_TRUE(r);
      for (std::size_t k = 0; k < kTileCells; ++k) {
        if (std::isnan(r->z_m[k])) continue;
        if (layer_at(r->source, k) == CellSource::kAerial && filled != nullptr) ++*filled;
        if (layer_at(r->source, k) != CellSource::kSensed || layer_at(r->count, k) < 5) continue;
        const Vec2 p = r->level.centre({r->first.i + static_cast<int>(k) % kTileSide,
                                        r->first.j + static_cast<int>(k) / kTileSide});
        const Vec3 at = T * Vec3(p.x(), p.y(), r->z_m[k]);
        e->push_back(std::abs(at.z() - world.relief().height(at.x(), at.y())));
        const double sigma = std::hypot(layer_at(r->sigma_m, k), finest.level.bias_sigma_m);
        if (e->back() <= 2.0 * sigma) ++good;
      }
    }
    *within = static_cast<double>(good) / static_cast<double>(e->size());
    std::sort(e->begin(), e->end());
  }

  static std::string drive_;
};
std::string MapBuild::drive_;

TEST_F(MapBuild, WithTruePosesTheMapIsTheBareGroundToThreeCentimetres) {
  ASSERT_EQ(rcs("map build " + run() + " --truth --date 2024-05-04 --json -o " + map()), 0)
      << messages();
  const json j = json::parse(out());
  std::vector<double> e;
  double within = 0.0;
  errors(&e, &within);
  ASSERT_GT(e.size(), 2000U);
  EXPECT_LT(e[e.size() / 2], 0.03);
  EXPECT_GT(within, 0.9);
  EXPECT_EQ(j["cells"], j["runs"][0]["cells"]);
  EXPECT_EQ(j["runs"][0]["cells_observed_5_times"], e.size());
  EXPECT_GT(j["runs"][0]["returns"]["above_ground"], 1000) << "grass";
  ASSERT_EQ(rcs("map info " + map() + " --check"), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("sensed"));
  EXPECT_THAT(out(), HasSubstr("2024-05-04"));
}

TEST_F(MapBuild, WithPosesOfWmTheSigmasAreConsistent) {
  const std::string call = "map build " + run() + " --config " + config() + " --sensors " +
                           sensors() + " --json -o " + map();
  ASSERT_EQ(rcs(call), 0) << messages();
  const json j = json::parse(out());
  std::vector<double> e;
  double within = 0.0;
  errors(&e, &within);
  ASSERT_GT(e.size(), 1000U);
  EXPECT_GT(within, 0.9);
  EXPECT_GT(j["runs"][0]["bias_sigma_m"], 0.05) << "GPS, float";
  const std::string first = text_of(map() + "/map.index");
  ASSERT_EQ(rcs(call), 0);
  EXPECT_EQ(text_of(map() + "/map.index"), first) << "the same input, the same bytes";
}

TEST_F(MapBuild, APriorMapFillsUnseenCells) {
  ASSERT_EQ(rcs("map build " + run() + " --truth --prior " + drive_ + "/survey -o " + map()), 0)
      << messages();
  EXPECT_THAT(out(), HasSubstr("/survey"));
  std::vector<double> e;
  double within = 0.0;
  std::size_t filled = 0;
  errors(&e, &within, &filled);
  EXPECT_LT(e[e.size() / 2], 0.03);
  EXPECT_GT(filled, 10000U);
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    EXPECT_THAT(entry.path().string(), testing::Not(HasSubstr("part")))
        << "a temporary file is left";
  }
}

TEST_F(MapBuild, SurfacePointsAreAnOption) {
  ASSERT_EQ(rcs("map build " + run() + " --truth --points --json -o " + map()), 0) << messages();
  const json j = json::parse(out());
  const auto points = j["runs"][0]["surface_points"].get<std::int64_t>();
  ASSERT_EQ(rcs("map info " + map() + " --check --json"), 0) << messages();
  const json levels = json::parse(out())["levels"];
  EXPECT_EQ(levels[0]["surface_points"], points);
  EXPECT_EQ(levels[1]["surface_points"], 0) << "surface points exist on the finest level only";
  const std::string index = text_of(map() + "/map.index");
  ASSERT_EQ(rcs("map build " + run() + " --truth --points -o " + map()), 0);
  EXPECT_THAT(out(), HasSubstr(std::to_string(points) + " surface points"));
  EXPECT_EQ(text_of(map() + "/map.index"), index) << "the same input, the same bytes";
  EXPECT_EQ(rcs("map build " + run() + " " + run() + " --truth --points -o " + map()), 2);
  EXPECT_THAT(messages(), HasSubstr("only for one RUN"));
}

TEST_F(MapBuild, TwoRunsCountAsTwoSurveys) {
  std::filesystem::copy_file(run(), folder_ + "/again.log");
  ASSERT_EQ(rcs("map build " + run() + " " + folder_ + "/again.log --truth --json -o " + map()), 0)
      << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["runs"].size(), 2U);
  EXPECT_EQ(j["cells_of_several_runs"], j["cells"]);
  EXPECT_EQ(j["cells_that_contradict"], 0);
}

TEST_F(MapBuild, PosesFromAFileAreInFrameWorld) {
  std::ofstream(folder_ + "/poses.tum") << "0 0 0 0 0 0 0 1\n1e6 0 0 0 0 0 0 1\n";
  const std::string call = "map build " + run() + " --poses " + folder_ + "/poses.tum -o " + map();
  EXPECT_EQ(rcs(call), 2) << "--pose-sigma is required";
  EXPECT_EQ(rcs(call + " --pose-sigma 0.02"), 3)
      << "a pose every million seconds is not sufficient";
  EXPECT_THAT(messages(), HasSubstr("is within the time of the poses"));
}

TEST_F(MapBuild, ADamagedLogYieldsItsReadableScans) {
  std::filesystem::copy_file(run(), folder_ + "/cut.log");
  std::filesystem::resize_file(folder_ + "/cut.log",
                               std::filesystem::file_size(run()) * 3 / 4 + 17);
  ASSERT_EQ(rcs("map build " + folder_ + "/cut.log --truth -o " + map()), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("ends inside an event"));
}

TEST_F(MapBuild, NonFinitePointsAreCountedAndOmitted) {
  Result<LogReader> reader = LogReader::open(run());
  ASSERT_TRUE(reader);
  Result<LogWriter> writer = LogWriter::create(folder_ + "/nan.log");
  ASSERT_TRUE(writer);
  LogEvent event;
  std::int64_t spoilt = 0;
  while (reader->next(&event)) {
    points_t m;
    if (event.channel == channel::kSpPoints &&
        m.decode(event.data.data(), 0, static_cast<int>(event.data.size())) > 0 && m.n > 0) {
      m.z_m[0] = std::numeric_limits<float>::quiet_NaN();
      m.encode(event.data.data(), 0, static_cast<int>(event.data.size()));
      ++spoilt;
    }
    ASSERT_TRUE(writer->write(event.stamp, event.channel, event.data.data(), event.data.size()));
  }
  ASSERT_TRUE(writer->close());
  ASSERT_EQ(rcs("map build " + folder_ + "/nan.log --truth --json -o " + map()), 0) << messages();
  EXPECT_EQ(json::parse(out())["runs"][0]["rejected_messages_or_points"], spoilt);
}

TEST_F(MapBuild, MissingInputsAreReported) {
  const std::string to = " -o " + map();
  EXPECT_EQ(rcs("map build " + sensors() + to), 3);
  EXPECT_THAT(messages(), HasSubstr("WM_NAV_STATE"));
  EXPECT_EQ(rcs("map build " + sensors() + " --truth" + to), 3);
  EXPECT_THAT(messages(), HasSubstr("SP_POINTS"));
  EXPECT_EQ(rcs("map build " + run() + " --config " + config() + to), 3);
  EXPECT_THAT(messages(), HasSubstr("LADAR_RANGES"));
  std::ofstream(folder_ + "/empty.log").flush();
  EXPECT_EQ(rcs("map build " + folder_ + "/empty.log" + to), 3);
  EXPECT_THAT(messages(), HasSubstr("empty.log"));
  EXPECT_EQ(rcs("map build " + run() + " --config " + config() + " --sensors " + sensors() +
                " --sensors " + sensors() + to),
            2);
  EXPECT_THAT(messages(), HasSubstr("one for each"));
  EXPECT_EQ(rcs("map build " + run() + " --date tomorrow" + to), 2);
  EXPECT_EQ(rcs("map build " + run() + " --memory 10 --truth" + to), 3);
  EXPECT_THAT(messages(), HasSubstr("--memory"));
  EXPECT_EQ(rcs("map build " + run() + " --truth -o " + run() + "/map"), 3);
  EXPECT_THAT(messages(), HasSubstr("run.log/map"));
  EXPECT_FALSE(std::filesystem::exists(map()));
}

}  // namespace
}  // namespace rcs::test
