// `rcs map` on the command line.

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "tests/support/rcs_command.h"
#include "tools/mapping/map_writer.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

double ground(double x, double y) {
  return 4.0 * std::sin(0.05 * x + 0.3) * std::cos(0.04 * y) + 1.5 * std::sin(0.11 * y + 0.06 * x);
}

class MapCommand : public RcsCommand {
 protected:
  MapCommand() {
    Raster raster;
    raster.level.cell_m = 1.0;
    raster.first = {-120, -120};
    raster.width = raster.height = 240;
    for (int j = -120; j < 120; ++j) {
      for (int i = -120; i < 120; ++i) {
        raster.z_m.push_back(static_cast<float>(ground(i + 0.5, j + 0.5)));
      }
    }
    raster.sigma_m = {0.05F};
    raster.source = {CellSource::kAerial};
    raster.date = {7000};
    MapFrame frame;
    frame.datum = {0.7, -1.3, {100.0}};
    EXPECT_TRUE(mapping::write_map(map_, frame, raster));
  }

  /// Points around a vehicle at the origin, 1 m above the ground, some on bushes.
  std::string scan() const {
    std::mt19937 rng(3);
    std::uniform_real_distribution<double> u(-50.0, 50.0);
    std::normal_distribution<double> noise(0.0, 0.03);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::ofstream out(folder_ + "/scan.xyz");
    for (int k = 0; k < 20000; ++k) {
      const double x = u(rng);
      const double y = u(rng);
      const double bush = share(rng) < 0.2 ? 1.5 * share(rng) : 0.0;
      out << x << ' ' << y << ' ' << ground(x, y) + bush + noise(rng) - ground(0, 0) - 1.0 << '\n';
    }
    return folder_ + "/scan.xyz";
  }

  std::string map_ = folder_ + "/map";
};

TEST_F(MapCommand, InfoReportsTheContentAndTheDamageOfAMap) {
  ASSERT_EQ(rcs("map info " + map_ + " --check --json"), 0) << messages();
  json j = json::parse(out());
  EXPECT_EQ(j["reference"], "WGS84");
  EXPECT_EQ(j["levels"][0]["cell_m"], 1.0);
  EXPECT_EQ(j["levels"][0]["known_cells"], 240 * 240);
  EXPECT_NEAR(j["levels"][0]["sigma_median_m"].get<double>(), 0.05, 1e-6);
  EXPECT_EQ(j["levels"][0]["dates"][0], "2019-03-02");  // 7000 days after 2000-01-01
  EXPECT_EQ(j["broken"], 0);
  std::filesystem::resize_file(map_ + "/1m/0_0.tile", 777);
  ASSERT_EQ(rcs("map info " + map_), 0) << messages();
  ASSERT_EQ(rcs("map info " + map_ + " --check"), 1);
  EXPECT_THAT(messages(), HasSubstr("0_0.tile: truncated"));
  EXPECT_EQ(rcs("map info " + folder_), 3);
  EXPECT_THAT(messages(), HasSubstr("map.index"));
}

TEST_F(MapCommand, MatchFindsAPoseFromADistantGuessWithItsSigma) {
  std::ostringstream pose;
  pose << "\"0 0 " << ground(0, 0) + 1.0 << " 0 0 0 1\"";
  const std::string call = "map match " + map_ + " " + scan() + " --pose " + pose.str();
  ASSERT_EQ(rcs(call + " --starts 40 --json"), 0) << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["converged"], 40);
  const json& o = j["offset_from_given"];
  EXPECT_LT(std::hypot(o["east_m"].get<double>(), o["north_m"].get<double>()), 0.1);
  EXPECT_LT(std::abs(o["up_m"].get<double>()), 0.05) << "bushes do not bias the height";
  EXPECT_LT(std::abs(o["yaw_deg"].get<double>()), 0.1);
  EXPECT_GT(j["ellipse95"]["major_m"].get<double>(), 0.0);
  ASSERT_EQ(rcs(call + " --starts 40"), 0);
  EXPECT_THAT(out(), HasSubstr("40 of 40 starts"));
  EXPECT_EQ(rcs("map match " + map_ + " " + scan() + " --pose \"1 2 3\""), 2);
  EXPECT_THAT(messages(), HasSubstr("7 numbers"));
}

TEST_F(MapCommand, ImportAndExportRunOnTheCommandLine) {
  EXPECT_EQ(rcs("map"), 2);
  EXPECT_EQ(rcs("map import raster " + map_ + "/map.index --sigma 1 -o " + folder_ + "/x"), 3);
  EXPECT_THAT(messages(), HasSubstr("map.index"));
  EXPECT_EQ(rcs("map export " + map_), 2);
  ASSERT_EQ(rcs("map export " + map_ + " --hillshade " + folder_ + "/a.png --geotiff " + folder_ +
                "/a.tif"),
            0)
      << messages();
  ASSERT_EQ(rcs("map import raster " + folder_ + "/a.tif --heights ellipsoid --sigma 0.1 --date " +
                "2024-02-29 -o " + folder_ + "/again"),
            0)
      << messages();
  ASSERT_EQ(rcs("map info " + folder_ + "/again --check --json"), 0);
  EXPECT_EQ(json::parse(out())["levels"][0]["dates"][1], "2024-02-29");
  EXPECT_EQ(rcs("map import raster " + folder_ + "/a.tif --heights ellipsoid --sigma 0.1 --date " +
                "24-2-29 -o " + folder_ + "/again"),
            2);
  EXPECT_EQ(rcs("map export " + map_ + " --level 9 --hillshade " + folder_ + "/a.png"), 3);
  EXPECT_EQ(
      rcs("map import raster " + folder_ + "/a.tif --heights ellipsoid --sigma 0.1 -o " + folder_),
      3);
  EXPECT_THAT(messages(), HasSubstr("not a map"));
}

TEST_F(MapCommand, CloudsAreImportedOnTheCommandLine) {
  std::ofstream file(folder_ + "/hill.xyz");
  file.precision(12);
  for (int k = 0; k < 40'000; ++k) {
    const int i = k % 200;
    const int j = k / 200;
    file << 500000 + 0.5 * i << ' ' << 5200000 + 0.5 * j << ' ' << 300 + 0.02 * i << " 2\n";
  }
  file.close();
  const std::string call = "map import cloud " + folder_ +
                           "/hill.xyz --heights ellipsoid --sigma 0.1 --date 2024-02-29 -o " +
                           folder_ + "/hill";
  EXPECT_EQ(rcs(call), 3);
  EXPECT_THAT(messages(), HasSubstr("--crs"));
  // 40000 points on 99.5 x 99.5 m.
  ASSERT_EQ(rcs(call + " --crs EPSG:32632"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("cell 1 m (the smallest with at least 3.5 points on average)"));
  EXPECT_THAT(messages(), Not(HasSubstr("warning")));
  ASSERT_EQ(rcs(call + " --crs EPSG:32632 --cell 0.25"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("cell 0.25 m (--cell)"));
  EXPECT_THAT(messages(), HasSubstr("warning: 0.25 points per cell of 0.25 m"));
  ASSERT_EQ(rcs(call + " --crs EPSG:32632 --class-column 4 --cell 2"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("40000 ground (detected by class)"));
  ASSERT_EQ(rcs("map info " + folder_ + "/hill --check --json"), 0);
  const json j = json::parse(out());
  EXPECT_EQ(j["levels"][0]["dates"][1], "2024-02-29");
  EXPECT_NEAR(j["levels"][0]["known_km2"].get<double>(), 0.01, 0.0005);
  EXPECT_EQ(rcs(call + " --crs EPSG:32632 --cell 0.01"), 2);
  EXPECT_EQ(rcs(call + " --crs EPSG:32632 --ground 256"), 2);
  EXPECT_EQ(rcs(call + " --crs EPSG:32632 --ground 2,9 --ignore-classes"), 2);
}

/// While it exists, commands cannot write larger files.
class FileLimit {
 public:
  explicit FileLimit(std::uintmax_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit now{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &now);
  }
  ~FileLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    (void)std::signal(SIGXFSZ, former_);
  }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

 private:
  rlimit before_{};
  void (*former_)(int) = std::signal(SIGXFSZ, SIG_IGN);
};

TEST_F(MapCommand, AnExportedFileIsCompleteOrAbsent) {
  for (const std::string option : {"--geotiff", "--hillshade"}) {
    const std::string folder = folder_ + "/" + option;
    const std::string file = folder + "/file";
    std::string call = "map export " + map_;
    call.append(" ").append(option).append(" ").append(file);
    ASSERT_EQ(rcs(call), 0) << messages();
    EXPECT_EQ(messages(), "");
    const std::uintmax_t bytes = std::filesystem::file_size(file);
    for (const std::uintmax_t most : {bytes - 1, bytes - 300, bytes / 2, std::uintmax_t{1000}}) {
      std::filesystem::remove(file);
      const FileLimit limit(most);
      EXPECT_EQ(rcs(call), 3) << option << ", " << most << " of " << bytes << " bytes";
      EXPECT_EQ(messages().rfind("rcs map export: " + file, 0), 0U) << messages();
      EXPECT_EQ(messages().find('\n'), messages().size() - 1) << messages();
      EXPECT_TRUE(std::filesystem::is_empty(folder)) << option;
    }
  }
}

TEST_F(MapCommand, AStreetScanIsLocalizedOnItsSurvey) {
  const char* data = std::getenv("RCS_DATA_DIR");
  const std::string log = std::string(data == nullptr ? "../shared/data" : data) +
                          "/av2_pittsburgh/7fab2350-7eaf-3b7e-a39d-6937a4c1bede";
  if (!std::filesystem::exists(log)) {
    GTEST_SKIP() << "DATA MISSING: " << log << "; set RCS_DATA_DIR";
  }
  ASSERT_EQ(rcs("map import av2 " + log + " --sigma 0.1 -o " + folder_ + "/street"), 0)
      << messages();
  for (const std::string stamp : {"315966265259836000", "315966265360032000"}) {
    SCOPED_TRACE(stamp);
    std::ifstream poses(log + "/city_SE3_egovehicle.csv");
    std::string line;
    while (std::getline(poses, line) && line.compare(0, stamp.size(), stamp) != 0) {
    }
    double q[4];
    double t[3];
    ASSERT_EQ(std::sscanf(line.c_str() + stamp.size(), ",%lf,%lf,%lf,%lf,%lf,%lf,%lf", &q[0], &q[1],
                          &q[2], &q[3], &t[0], &t[1], &t[2]),
              7);
    std::ostringstream pose;
    pose.precision(12);
    pose << "\"" << t[0] << ' ' << t[1] << ' ' << t[2] << ' ' << q[1] << ' ' << q[2] << ' ' << q[3]
         << ' ' << q[0] << "\"";
    std::ostringstream match;
    match << "map match " << folder_ << "/street " << log << "/sensors/lidar/" << stamp
          << ".bin --pose " << pose.str() << " --starts 20 --json";
    ASSERT_EQ(rcs(match.str()), 0) << messages();
    const json j = json::parse(out());
    EXPECT_GE(j["converged"].get<int>(), 19);
    const json& o = j["offset_from_given"];
    EXPECT_LT(std::abs(o["up_m"].get<double>()), 0.05);
    EXPECT_LT(std::abs(o["roll_deg"].get<double>()), 0.2);
    EXPECT_LT(std::abs(o["pitch_deg"].get<double>()), 0.2);
    EXPECT_LT(std::hypot(o["east_m"].get<double>(), o["north_m"].get<double>()), 0.25);
    EXPECT_LT(j["ellipse95"]["major_m"].get<double>(), 0.5);
  }
}

}  // namespace
}  // namespace rcs::test
