// `rcs map localizability` on the command line.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"
#include "tools/base/files.h"
#include "tools/mapping/map_writer.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class MapLocalizability : public RcsCommand {
 protected:
  /// A plane west of 0 and hills east of it, with different localizability.
  std::string map() const {
    Raster r;
    r.level.cell_m = 2.0;
    r.first = {-150, -50};
    r.width = 300;
    r.height = 100;
    for (int j = -50; j < 50; ++j) {
      for (int i = -150; i < 150; ++i) {
        const double x = 2.0 * i + 1.0;
        const double y = 2.0 * j + 1.0;
        const double hills = x > 0.0 ? 6.0 * std::sin(0.06 * x) * std::cos(0.05 * y) : 0.0;
        r.z_m.push_back(static_cast<float>(100.0 + 0.02 * x + hills));
      }
    }
    r.sigma_m = {0.1F};
    r.count = {1};
    r.source = {CellSource::kAerial};
    MapFrame frame;
    frame.datum = {0.7, -1.3, {100.0}};
    EXPECT_TRUE(mapping::write_map(folder_ + "/map", frame, r));
    return folder_ + "/map";
  }
};

TEST_F(MapLocalizability, APlaneGivesNoInformationAndHillsGivePosition) {
  const std::string way = folder_ + "/way.csv";
  ASSERT_TRUE(tools::write_text(way, "x_m,y_m\n-250,0\n250,0\n"));
  const std::string out_folder = folder_ + "/where";
  ASSERT_EQ(rcs("map localizability " + map() + " --step 10 --path " + way +
                " --start-sigma 0.5 --drift 0.01 --json -o " + out_folder),
            0)
      << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["step_m"], 10.0);
  EXPECT_NEAR(j["places"].get<double>(), 60.0 * 20.0, 81.0);  // without the outermost ones
  // The half with hills.
  EXPECT_NEAR(j["share_within"][2]["share"].get<double>(), 0.5, 0.1);
  const json& path = j["path"];
  ASSERT_EQ(path.size(), 21U);  // each 25 m
  EXPECT_EQ(path[0]["sigma_dead_reckoning_m"], 0.5);
  // On the plane the map gives no information: sqrt(0.5^2 + (0.01 * 200)^2) where the hills are out
  // of range.
  EXPECT_EQ(path[8]["travelled_m"], 200.0);
  EXPECT_NEAR(path[8]["sigma_with_map_m"].get<double>(), std::hypot(0.5, 2.0), 0.05);
  EXPECT_NEAR(path[20]["sigma_dead_reckoning_m"].get<double>(), std::hypot(0.5, 5.0), 0.01);
  EXPECT_LT(path[20]["sigma_with_map_m"].get<double>(), 0.3);
  for (const char* file : {"localizability.json", "localizability.svg", "path.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(out_folder + "/" + file)) << file;
  }
}

TEST_F(MapLocalizability, ErrorsAreNamed) {
  const std::string maps = map();
  EXPECT_EQ(rcs("map localizability " + folder_ + "/none"), 3);
  EXPECT_THAT(messages(), HasSubstr("none"));
  EXPECT_EQ(rcs("map localizability " + maps + " --step 0.1"), 2);
  EXPECT_EQ(rcs("map localizability " + maps + " --drift 0.1"), 2);  // without a path
  const std::string way = folder_ + "/way.csv";
  ASSERT_TRUE(tools::write_text(way, "x_m,y_m\n0,0\n"));
  EXPECT_EQ(rcs("map localizability " + maps + " --path " + way), 3);
  EXPECT_THAT(messages(), HasSubstr("two or more places"));
  ASSERT_TRUE(tools::write_text(way, "x_m,y_m\n0,0\n5,\n"));
  EXPECT_EQ(rcs("map localizability " + maps + " --path " + way), 3);
  EXPECT_THAT(messages(), HasSubstr("way.csv:3"));
  ASSERT_TRUE(tools::write_text(way, "x_m,north\n0,0\n5,1\n"));
  EXPECT_EQ(rcs("map localizability " + maps + " --path " + way), 3);
  EXPECT_THAT(messages(), HasSubstr("y_m"));
}

}  // namespace
}  // namespace rcs::test
