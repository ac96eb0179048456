#include "tools/survey/cloud_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "rcs/terrain/elevation_map.h"
#include "rcs/terrain/map_folder.h"
#include "tests/support/files_next_to.h"
#include "tests/tools/survey/las_file.h"
#include "tools/survey/map_export.h"

namespace rcs::survey {
namespace {

using test::LasFile;
using test::LasPoint;
using testing::HasSubstr;

/// Hills of 6 m and 2.5 m, as steep as 30 %.
double hills(double x, double y) {
  return 300.0 + 6.0 * std::sin(0.035 * x + 0.3) * std::cos(0.03 * y) +
         2.5 * std::sin(0.09 * y + 0.05 * x);
}

struct Errors {
  double median_m = 0.0;   ///< absolute
  double p95_m = 0.0;      ///< likewise
  double mean_m = 0.0;     ///< above the truth
  double in_sigmas = 0.0;  ///< root mean square
  double known = 0.0;      ///< share of the cells
};

class CloudImportTest : public testing::Test {
 protected:
  static constexpr double kEast = 500000.0;
  static constexpr double kNorth = 5200000.0;
  static constexpr double kSide_m = 160.0;

  CloudImportTest() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_cloud_XXXXXX").string();
    EXPECT_NE(mkdtemp(folder_.data()), nullptr);
    map_ = folder_ + "/map";
    wanted_.paths = {folder_ + "/a.las"};
    // At the middle of a zone with scale 1 there: east and north are metres of the map.
    wanted_.crs = "+proj=tmerc +lat_0=0 +lon_0=9 +k=1 +x_0=500080 +y_0=0 +datum=WGS84";
    wanted_.heights = "ellipsoid";
    wanted_.quality.sigma_m = 0.05;
    wanted_.cell_m = 1.0;
    las_.format = 1;
  }
  ~CloudImportTest() override { std::filesystem::remove_all(folder_); }

  /// A flight over hills with trees, bushes and a house. Classes as in a careful survey.
  /// @param seed  of the random points
  static std::vector<LasPoint> flight(unsigned seed) {
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> u(0.0, 1.0);
    std::normal_distribution<double> noise(0.0, 0.05);
    std::vector<Vec3> trees;  // x, y, radius
    constexpr int kTrees = 120;
    trees.reserve(kTrees);
    for (int k = 0; k < kTrees; ++k) {
      trees.emplace_back(kSide_m * u(rng), kSide_m * u(rng), 2 + 2 * u(rng));
    }
    std::vector<LasPoint> points;
    const auto add = [&](double x, double y, double above, int klass, int number, int returns) {
      // Whole millimetres, which all formats can represent.
      const auto rounded = [](double v) { return 1e-3 * std::round(1e3 * v); };
      points.push_back({rounded(kEast + x), rounded(kNorth + y),
                        rounded(hills(x, y) + above + noise(rng)), klass, number, returns, false});
    };
    for (int k = 0; k < 100'000; ++k) {
      const double x = kSide_m * u(rng);
      const double y = kSide_m * u(rng);
      if (x > 60 && x < 72 && y > 80 && y < 100) {
        add(x, y, 6.0, 6, 1, 1);
        continue;
      }
      const bool under = std::any_of(trees.begin(), trees.end(), [&](const Vec3& t) {
        return std::hypot(x - t.x(), y - t.y()) < t.z();
      });
      if (under) {
        const bool through = u(rng) < 0.25;
        add(x, y, 4.0 + 8.0 * u(rng), 5, 1, through ? 2 : 1);
        if (through) add(x, y, 0.0, 2, 2, 2);
      } else if (u(rng) < 0.15) {
        add(x, y, 0.2 + 1.3 * u(rng), 3, 1, 1);
      } else {
        add(x, y, 0.0, 2, 1, 1);
      }
    }
    return points;
  }
  Result<CloudImported> import() {
    if (!las_.points.empty()) las_.write(folder_ + "/a.las");
    return import_cloud(wanted_, map_, [](double) { return true; });
  }
  std::string why_not() {
    const Result<CloudImported> done = import();
    EXPECT_FALSE(std::filesystem::exists(map_));
    EXPECT_TRUE(test::files_next_to(map_).empty());
    return done ? std::string() : done.error().message;
  }
  [[nodiscard]] Raster raster() const { return *whole_level(*MapFolder::open(map_), 0); }

  /// Errors against hills(); the middle of the map is that of the flight.
  [[nodiscard]] Errors errors() const {
    const Raster r = raster();
    std::vector<double> off;
    Errors e;
    double squares = 0.0;
    constexpr int kBorder = 3;
    int cells = 0;
    for (int j = kBorder; j < static_cast<int>(kSide_m) - kBorder; ++j) {
      for (int i = kBorder; i < static_cast<int>(kSide_m) - kBorder; ++i) {
        const double x = i + 0.5;
        const double y = j + 0.5;
        ++cells;
        const Cell c = r.level.cell_at(x - 0.5 * kSide_m, y - 0.5 * kSide_m);
        if (!r.contains(c) || std::isnan(r.z_m[r.at(c)])) continue;
        const double error = r.z_m[r.at(c)] - hills(x, y);
        e.mean_m += error;
        squares += std::pow(error / layer_at(r.sigma_m, r.at(c)), 2);
        off.push_back(std::abs(error));
      }
    }
    const auto n = static_cast<double>(off.size());
    std::sort(off.begin(), off.end());
    e.median_m = off[off.size() / 2];
    e.p95_m = off[off.size() * 95 / 100];
    e.mean_m /= n;
    e.in_sigmas = std::sqrt(squares / n);
    e.known = n / cells;
    return e;
  }
  static void print(const char* what, const Errors& e) {
    std::printf("%s: error median %.3f m, 95 %% %.3f m, mean %+.3f m, rms/sigma %.2f, known %.3f\n",
                what, e.median_m, e.p95_m, e.mean_m, e.in_sigmas, e.known);
  }

  std::string folder_;
  std::string map_;
  CloudImport wanted_;
  LasFile las_;
};

TEST_F(CloudImportTest, ClassesIdentifyTheGround) {
  las_.points = flight(1);
  las_.points.push_back({kEast + 80, kNorth + 80, 900.0, 18, 1, 1, false});
  las_.points.push_back({kEast + 80, kNorth + 80, 100.0, 7, 1, 1, false});
  las_.points.push_back({kEast + 9e5, kNorth + 80, 100.0, 2, 1, 1, true});
  wanted_.quality.date = 7000;
  const Result<CloudImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_TRUE(done->by_classes);
  EXPECT_EQ(done->points, static_cast<std::int64_t>(las_.points.size()));
  EXPECT_EQ(done->noise, 2);
  EXPECT_EQ(done->invalid, 1);
  EXPECT_EQ(done->ground.points + done->not_ground + 3, done->points);
  EXPECT_EQ(done->frame.reference, "WGS84");
  EXPECT_NEAR(done->ground.within_cell_median_m, 0.05, 0.01);
  const Errors e = errors();
  print("classified", e);
  EXPECT_LT(e.median_m, 0.03);
  EXPECT_LT(e.p95_m, 0.10);
  EXPECT_LT(std::abs(e.mean_m), 0.01);
  EXPECT_LT(e.in_sigmas, 1.0);
  const Raster r = raster();
  const std::size_t cell = r.at(r.level.cell_at(20.5 - 80, 20.5 - 80));
  EXPECT_EQ(layer_at(r.date, cell), 7000);
  EXPECT_EQ(layer_at(r.source, cell), CellSource::kAerial);
  EXPECT_GT(layer_at(r.count, cell), 0);
  EXPECT_TRUE(std::isnan(r.z_m[r.at(r.level.cell_at(66.5 - 80, 90.5 - 80))])) << "under the house";
}

TEST_F(CloudImportTest, WithoutClassesTheGroundIsFoundByItsShape) {
  las_.points = flight(1);
  for (LasPoint& p : las_.points) p.klass = 1;
  for (int k = 0; k < 5; ++k) {  // unclassified points below the ground
    las_.points.push_back({kEast + 30.5 + 20 * k, kNorth + 40.5, 250.0, 1, 1, 1, false});
  }
  const Result<CloudImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_FALSE(done->by_classes);
  const Errors e = errors();
  print("by its shape", e);
  EXPECT_LT(e.median_m, 0.04);
  EXPECT_LT(e.p95_m, 0.25);
  EXPECT_LT(std::abs(e.mean_m), 0.03);
  EXPECT_LT(e.in_sigmas, 1.5);
  EXPECT_GT(e.known, 0.85);
  const Raster r = raster();
  EXPECT_TRUE(std::isnan(r.z_m[r.at(r.level.cell_at(66.5 - 80, 90.5 - 80))])) << "under the house";
}

TEST_F(CloudImportTest, AnotherFormatGivesTheSameMap) {
  las_.points = flight(2);
  ASSERT_TRUE(import());
  const std::vector<float> z = raster().z_m;
  las_.minor = 4;
  las_.format = 8;
  ASSERT_TRUE(import());
  EXPECT_THAT(raster().z_m, testing::Pointwise(testing::NanSensitiveFloatEq(), z));
  std::ofstream xyz(folder_ + "/a.xyz");
  xyz.precision(12);
  for (const LasPoint& p : las_.points) {
    xyz << p.x << ' ' << p.y << ' ' << p.z << ' ' << p.klass << '\n';
  }
  xyz.close();
  wanted_.paths = {folder_ + "/a.xyz"};
  wanted_.class_column = 4;
  ASSERT_TRUE(import());
  // Points on the cells' borders, as whole millimetres may be, fall to one side or the other.
  const std::vector<float> text = raster().z_m;
  ASSERT_EQ(text.size(), z.size());
  std::size_t others = 0;
  for (std::size_t k = 0; k < z.size(); ++k) {
    const bool same = std::isnan(z[k]) ? std::isnan(text[k]) : std::abs(text[k] - z[k]) < 1e-4F;
    others += same ? 0 : 1;
  }
  EXPECT_LT(others, z.size() / 100);
}

TEST_F(CloudImportTest, SeveralFilesFormOneSurvey) {
  const std::vector<LasPoint> all = flight(3);
  las_.points = all;
  ASSERT_TRUE(import());
  const std::vector<float> z = raster().z_m;
  const auto cells = std::count_if(z.begin(), z.end(), [](float v) { return !std::isnan(v); });
  las_.points = {all.begin() + 50'000, all.end()};
  las_.write(folder_ + "/b.las");
  las_.points.assign(all.begin(), all.begin() + 50'000);
  wanted_.paths.push_back(folder_ + "/b.las");
  const Result<CloudImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->points, static_cast<std::int64_t>(all.size()));
  EXPECT_EQ(done->ground.cells, cells);
}

TEST_F(CloudImportTest, UnitsAreConvertedOrRequested) {
  constexpr double kSurveyFoot_m = 1200.0 / 3937.0;
  for (int k = 0; k < 4000; ++k) {
    las_.points.push_back({kEast + k % 60, kNorth + 0.02 * k, 1000.0, 2, 1, 1, false});
  }
  const auto z_m = [this] {
    const Result<CloudImported> done = import();
    EXPECT_TRUE(done) << done.error().message;
    std::vector<float> known;
    for (const float z : raster().z_m) {
      if (!std::isnan(z)) known.push_back(z);
    }
    std::filesystem::remove_all(map_);
    return done ? done->frame.datum.height.m + known.at(known.size() / 2) : 0.0;
  };
  EXPECT_NEAR(z_m(), 1000.0, 1e-3);
  wanted_.crs += " +vunits=us-ft";
  wanted_.heights.clear();
  wanted_.undulation_m = -30.0;
  EXPECT_NEAR(z_m(), 1000.0 * kSurveyFoot_m - 30.0, 1e-3);
  wanted_.undulation_m.reset();
  wanted_.heights = "ellipsoid";
  wanted_.crs = "EPSG:2263";  // US survey feet
  EXPECT_THAT(why_not(), HasSubstr("--height-unit [m], 1 or 0.304800"));
  wanted_.height_unit_m = kSurveyFoot_m;
  las_.offset[0] = 900000.0;
  las_.offset[1] = 200000.0;
  for (LasPoint& p : las_.points) {
    p.x += 900000.0 - kEast;
    p.y += 200000.0 - kNorth;
  }
  EXPECT_NEAR(z_m(), 1000.0 * kSurveyFoot_m, 1e-3);
}

TEST_F(CloudImportTest, CoordinatesAreInTheReferenceSystemOfTheFile) {
  for (int k = 0; k < 4000; ++k) {
    las_.points.push_back({kEast + k % 60, kNorth + 0.02 * k, 100.0, 2, 1, 1, false});
  }
  wanted_.crs.clear();
  EXPECT_THAT(why_not(), HasSubstr("a.las: has no coordinate reference system: use --crs"));
  // GeoTIFF's keys: projected, EPSG 32632 (WGS 84, UTM 32 N); heights EPSG 5773 (EGM96).
  std::string keys;
  for (const int v : {1, 1, 0, 3, 1024, 0, 1, 1, 3072, 0, 1, 32632, 4096, 0, 1, 5773}) {
    LasFile::put(keys.size(), static_cast<std::uint16_t>(v), &keys);
  }
  las_.records = {{"LASF_Projection", 34735, keys}};
  Result<CloudImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->frame.reference, "WGS84");
  EXPECT_NEAR(degrees(done->frame.datum.lon_rad), 9.0, 0.01);
  EXPECT_THAT(done->frame.source_crs, HasSubstr("UTM zone 32N"));
  wanted_.heights.clear();
  done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_NEAR(done->frame.undulation_m, 48.0, 3.0);
  std::filesystem::remove_all(map_);
  keys.resize(keys.size() - 8);
  keys[6] = 2;
  las_.records = {{"LASF_Projection", 34735, keys}};
  EXPECT_THAT(why_not(), HasSubstr("--heights"));
  las_.records = {{"LASF_Projection", 34735, std::string(200, '\x7f')}};
  EXPECT_THAT(why_not(), HasSubstr("--crs"));
  las_.records = {{"LASF_Projection", 2112, "nonsense"}};
  EXPECT_THAT(why_not(), HasSubstr("--crs"));
}

TEST_F(CloudImportTest, AFewDistantPointsDoNotUseTheMemoryOfASurvey) {
  // 40 million cells of 1 m: 1.3 GB, and a filter over all of them.
  las_.points = {{kEast, kNorth, 300.0}, {kEast + 6300.0, kNorth + 6300.0, 300.0}};
  EXPECT_THAT(why_not(), HasSubstr("2 points in 6.31 x 6.31 km: fewer than one in 10000 cells"));
  las_.points.back() = {kEast + 30.0, kNorth + 30.0, 300.0};
  EXPECT_TRUE(import());
}

TEST_F(CloudImportTest, InvalidInputIsRejectedAndLeavesNoFile) {
  las_.points = {{kEast, kNorth, 100.0, 7, 1, 1, false}};
  EXPECT_THAT(why_not(), HasSubstr("no valid point of 1"));
  las_.points = {{kEast, kNorth, 100.0, 2, 1, 1, false}, {kEast, kNorth, 2e5, 2, 1, 1, false}};
  EXPECT_THAT(why_not(), HasSubstr("use --height-unit"));
  las_.points = flight(1);
  wanted_.memory_bytes = 1e6;
  EXPECT_THAT(why_not(), HasSubstr("--memory"));
  wanted_.memory_bytes = 4e9;
  las_.write(folder_ + "/a.las");
  int asked = 0;
  const Result<CloudImported> stopped =
      import_cloud(wanted_, map_, [&asked](double) { return ++asked < 5; });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().message, "interrupted");
  EXPECT_TRUE(test::files_next_to(map_).empty());
}

class RealCloudTest : public CloudImportTest {
 protected:
  /// @return empty, and the test skipped, where the data is missing
  static std::string data(const std::string& file) {
    const char* folder = std::getenv("RCS_DATA_DIR");
    const std::string path =
        std::string(folder == nullptr ? "../shared/data" : folder) + "/terrain_lidar/" + file;
    return std::filesystem::exists(path) ? path : "";
  }
  /// Ground found by shape, compared with the ground by the classes of the survey: cells of both.
  Errors shape_against_classes() {
    Result<CloudImported> done = import();
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_TRUE(done->by_classes);
    const Raster told = raster();
    wanted_.ignore_classes = true;
    done = import();
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_FALSE(done->by_classes);
    const Raster found = raster();
    Errors e;
    std::vector<double> off;
    double squares = 0.0;
    for (int j = 0; j < told.height; ++j) {
      for (int i = 0; i < told.width; ++i) {
        const Cell c{told.first.i + i, told.first.j + j};
        const std::size_t k = told.at(c);
        if (std::isnan(told.z_m[k]) || !found.contains(c)) continue;
        e.known += 1.0;
        if (std::isnan(found.z_m[found.at(c)])) continue;
        const double d = found.z_m[found.at(c)] - told.z_m[k];
        e.mean_m += d;
        squares += std::pow(d / layer_at(found.sigma_m, found.at(c)), 2);
        off.push_back(std::abs(d));
      }
    }
    std::sort(off.begin(), off.end());
    const auto n = static_cast<double>(off.size());
    e.median_m = off.at(off.size() / 2);
    e.p95_m = off.at(off.size() * 95 / 100);
    e.mean_m /= n;
    e.in_sigmas = std::sqrt(squares / n);
    e.known = n / e.known;
    return e;
  }
};

TEST_F(RealCloudTest, TheGroundOfAForestIsFound) {
  wanted_.paths = {data("lidR/Topography.xyz")};
  if (wanted_.paths[0].empty()) GTEST_SKIP() << "DATA MISSING: lidR; set RCS_DATA_DIR";
  wanted_.class_column = 7;
  wanted_.crs = "EPSG:2949";
  wanted_.quality.sigma_m = 0.1;
  wanted_.cell_m = 2.0;
  const Errors e = shape_against_classes();
  print("forest, shape against classes", e);
  EXPECT_LT(e.median_m, 0.05);
  EXPECT_LT(e.p95_m, 0.5);
  EXPECT_GT(e.known, 0.9);
}

TEST_F(RealCloudTest, ATownInFeetIsConverted) {
  wanted_.paths = {data("pdal/autzen_trim.las")};
  if (wanted_.paths[0].empty()) GTEST_SKIP() << "DATA MISSING: autzen; set RCS_DATA_DIR";
  wanted_.crs.clear();
  wanted_.quality.sigma_m = 0.1;
  wanted_.cell_m = 2.0;
  wanted_.height_unit_m = 0.0;
  EXPECT_THAT(why_not(), HasSubstr("--height-unit"));
  wanted_.height_unit_m = 0.3048;
  const Errors e = shape_against_classes();
  print("town, shape against classes", e);
  EXPECT_LT(e.median_m, 0.05);
  EXPECT_LT(e.p95_m, 0.5);
  EXPECT_GT(e.known, 0.9);
  const Result<MapFolder> map = MapFolder::open(map_);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->index().frame.reference, "NAD83(HARN)");
  EXPECT_NEAR(degrees(map->index().frame.datum.lat_rad), 44.05, 0.05);
}

}  // namespace
}  // namespace rcs::survey
