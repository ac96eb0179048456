// `rcs map merge` and `rcs map diff` on the command line, and the statistics of a difference.

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/support/rcs_command.h"
#include "tools/mapping/map_writer.h"
#include "tools/survey/map_difference.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using survey::difference_color;
using testing::HasSubstr;

double ground(double x, double y) { return 50.0 + 6.0 * std::sin(0.02 * x) + 0.03 * y; }

class MapCompare : public RcsCommand {
 protected:
  /// A map of 300 x 200 m.
  std::string map(const std::string& name, double sigma_m, double off_m, unsigned seed,
                  const std::string& reference = "WGS84", double bias_sigma_m = 0.0) const {
    Raster r;
    r.level.cell_m = 1.0;
    r.level.bias_sigma_m = bias_sigma_m;
    r.first = {-150, -100};
    r.width = 300;
    r.height = 200;
    std::mt19937 rng(seed);
    std::normal_distribution<double> noise(0.0, sigma_m);
    for (int j = -100; j < 100; ++j) {
      for (int i = -150; i < 150; ++i) {
        r.z_m.push_back(static_cast<float>(ground(i + 0.5, j + 0.5) + off_m + noise(rng)));
      }
    }
    r.sigma_m = {static_cast<float>(sigma_m)};
    r.count = {1};
    r.source = {CellSource::kAerial};
    MapFrame frame;
    frame.datum = {0.7, -1.3, {100.0}};
    frame.reference = reference;
    EXPECT_TRUE(mapping::write_map(folder_ + "/" + name, frame, r));
    return folder_ + "/" + name;
  }
};

TEST_F(MapCompare, DiffReportsTheDifferenceAndTheConsistencyOfTheSigmas) {
  const std::string a = map("a", 0.3, 0.0, 1, "WGS84", 0.2);
  const std::string b = map("b", 0.4, 0.5, 2, "WGS84", 0.6);
  ASSERT_EQ(rcs("map diff " + a + " " + b + " --json"), 0) << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["cells"], 300 * 200);
  EXPECT_EQ(j["cell_m"], 1.0);
  // The combined noise is 0.5 m: means have a sigma of 0.002 m, medians of 0.0026 m.
  EXPECT_NEAR(j["mean_m"].get<double>(), 0.5, 0.01);
  EXPECT_NEAR(j["median_m"].get<double>(), 0.5, 0.013);
  EXPECT_NEAR(j["rms_m"].get<double>(), std::sqrt(0.5), 0.01);
  EXPECT_NEAR(j["nmad_m"].get<double>(), 0.5, 0.015);
  // |d| of a normal distribution of mean 0.5, sigma 0.5: P(d < -x) + P(d > x) = 0.05
  EXPECT_NEAR(j["p95_abs_m"].get<double>(), 1.323, 0.02);
  EXPECT_NEAR(j["within_sigma"]["one"].get<double>(), 0.4772, 0.01);  // -1 to 1 about 1
  EXPECT_NEAR(j["within_sigma"]["two"].get<double>(), 0.8400, 0.01);
  const double s = std::sqrt(0.25 + 0.04 + 0.36) / 0.5;  // in units of the noise
  const auto within = [](double x) {
    return 0.5 * (std::erf((x - 1.0) / std::sqrt(2.0)) + std::erf((x + 1.0) / std::sqrt(2.0)));
  };
  EXPECT_NEAR(j["within_sigma_and_bias"]["one"].get<double>(), within(s), 0.01);
  EXPECT_NEAR(j["within_sigma_and_bias"]["two"].get<double>(), within(2.0 * s), 0.01);
  ASSERT_EQ(rcs("map diff " + b + " " + a), 0);
  EXPECT_THAT(out(), HasSubstr("-0.50"));
  EXPECT_THAT(out(), HasSubstr("60000"));
}

TEST_F(MapCompare, ThePictureShowsThePartThatBothMapsCover) {
  const std::string a = map("a", 0.3, 0.0, 1);
  const std::string b = map("b", 0.4, 0.0, 2);
  const std::string png = folder_ + "/diff.png";
  ASSERT_EQ(rcs("map diff " + a + " " + b + " --picture " + png), 0) << messages();
  EXPECT_THAT(out(), testing::ContainsRegex("red 1.(49|50)"));  // 3 times 0.5 m
  const std::string bytes = text_of(png);
  ASSERT_GT(bytes.size(), 30U);
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  const auto number = [&](std::size_t at) {
    return static_cast<int>(static_cast<unsigned char>(bytes[at + 2])) * 256 +
           static_cast<int>(static_cast<unsigned char>(bytes[at + 3]));
  };
  EXPECT_EQ(number(16), 300);
  EXPECT_EQ(number(20), 200);
  EXPECT_EQ(bytes[25], 6) << "red, green, blue and opacity";
  EXPECT_FALSE(std::filesystem::exists(png + ".aux.xml"));
  EXPECT_EQ(rcs("map diff " + a + " " + b + " --picture " + a + "/map.index/diff.png"), 3);
  EXPECT_THAT(messages(), HasSubstr("map.index/diff.png"));
}

TEST_F(MapCompare, MergeIsBetterThanItsParts) {
  const std::string a = map("a", 0.3, 0.0, 1);
  const std::string b = map("b", 0.4, 0.0, 2);
  const std::string truth = map("truth", 1e-6, 0.0, 3);
  ASSERT_EQ(rcs("map merge " + a + " " + b + " -o " + folder_ + "/ab"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("60000 cells of 1 m"));
  EXPECT_THAT(messages(), HasSubstr("60000 cells in several maps"));
  ASSERT_EQ(rcs("map diff " + truth + " " + folder_ + "/ab --json"), 0) << messages();
  const json j = json::parse(out());
  EXPECT_NEAR(j["rms_m"].get<double>(), 0.24, 0.005);
  EXPECT_NEAR(j["within_sigma"]["one"].get<double>(), 0.683, 0.01);
  EXPECT_NEAR(j["within_sigma"]["two"].get<double>(), 0.954, 0.01);
  ASSERT_EQ(rcs("map merge " + a + " " + b + " " + truth + " -o " + folder_ + "/three"), 0);
  ASSERT_EQ(rcs("map info " + folder_ + "/ab --check --json"), 0) << messages();
  EXPECT_NEAR(json::parse(out())["levels"][0]["sigma_median_m"].get<double>(), 0.24, 1e-4);
}

TEST_F(MapCompare, IncomparableMapsAreReported) {
  const std::string a = map("a", 0.3, 0.0, 1);
  const std::string other = map("other", 0.3, 0.0, 1, "ETRS89");
  const std::string both = a + " " + other;
  for (const std::string& call :
       {"map diff " + both, "map merge " + both + " -o " + folder_ + "/x"}) {
    EXPECT_EQ(rcs(call), 3) << call;
    EXPECT_THAT(messages(), HasSubstr("WGS84"));
    EXPECT_THAT(messages(), HasSubstr("ETRS89"));
  }
  EXPECT_EQ(rcs("map merge " + a + " -o " + folder_ + "/x"), 2);
  EXPECT_EQ(rcs("map merge " + a + " " + folder_ + "/none -o " + folder_ + "/x"), 3);
  EXPECT_EQ(rcs("map diff " + a), 2);
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/x"));
}

TEST(MapDifference, NmadIgnoresOutliersAndIsZeroWithoutData) {
  Raster a;
  a.width = 101;
  a.height = 1;
  a.z_m.assign(101, 0.0F);
  Raster b = a;
  for (int k = 0; k < 101; ++k) b.z_m[static_cast<std::size_t>(k)] = static_cast<float>(k - 50);
  b.z_m[0] = 5000.0F;
  survey::Differences d;
  EXPECT_EQ(d.metrics().cells, 0);
  EXPECT_EQ(d.metrics().nmad_m, 0.0);
  d.add(a, b);
  EXPECT_NEAR(d.metrics().median_m, 1.0, 1e-6);
  EXPECT_NEAR(d.metrics().nmad_m, 1.4826 * 25.0, 1e-4);
  EXPECT_GT(d.metrics().rms_m, 400.0);
}

TEST(MapDifference, ColorsAreWhiteInTheMiddleAndTransparentOutside) {
  using Color = std::array<std::uint8_t, 4>;
  EXPECT_EQ(survey::difference_color(0.0F, 2.0), (Color{255, 255, 255, 255}));
  const Color high = survey::difference_color(2.0F, 2.0);
  const Color low = survey::difference_color(-2.0F, 2.0);
  EXPECT_GT(high[0], high[2] + 100) << "red";
  EXPECT_GT(low[2], low[0] + 100) << "blue";
  EXPECT_EQ(survey::difference_color(77.0F, 2.0), high);
  EXPECT_EQ(survey::difference_color(-77.0F, 2.0), low);
  EXPECT_EQ(survey::difference_color(std::numeric_limits<float>::quiet_NaN(), 2.0)[3], 0);
  EXPECT_GT(survey::difference_color(0.5F, 2.0)[1], survey::difference_color(1.0F, 2.0)[1]);
}

}  // namespace
}  // namespace rcs::test
