#include "tools/mapping/merge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "rcs/base/geodesy.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tests/support/files_next_to.h"
#include "tests/terrain/map_scene.h"
#include "tools/mapping/map_writer.h"
#include "tools/mapping/resample.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// 200 m of relief within a few kilometres, smooth: 4 m cells interpolate it to 1 mm.
double ground(double x, double y) {
  return 300.0 + 60.0 * std::sin(0.002 * x + 0.4) * std::cos(0.0017 * y) + 0.05 * x;
}

struct Survey {
  double sigma_m = 0.2;
  double bias_sigma_m = 0.0;
  double off_m = 0.0;  ///< its systematic error
  unsigned seed = 0;   ///< 0: no noise
};

Raster survey(const Survey& how, Cell first, int width, int height, double cell_m = 2.0) {
  Raster r;
  r.level = {cell_m, Vec2::Zero(), how.bias_sigma_m, 1000.0};
  r.first = first;
  r.width = width;
  r.height = height;
  std::mt19937 rng(how.seed);
  std::normal_distribution<double> noise(0.0, how.sigma_m);
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const Vec2 p = r.level.centre({first.i + i, first.j + j});
      const double e = how.off_m + (how.seed == 0 ? 0.0 : noise(rng));
      r.z_m.push_back(static_cast<float>(ground(p.x(), p.y()) + e));
    }
  }
  r.sigma_m = {static_cast<float>(how.sigma_m)};
  r.count = {1};
  r.date = {7000};
  r.source = {CellSource::kAerial};
  return r;
}

/// One cell with one height.
Raster cell(float z_m, float sigma_m, std::uint16_t date, double bias_sigma_m = 0.0) {
  Raster r;
  r.level = {1.0, Vec2::Zero(), bias_sigma_m, 1000.0};
  r.width = r.height = 1;
  r.z_m = {z_m};
  r.sigma_m = {sigma_m};
  r.date = {date};
  return r;
}

struct Errors {
  double rms_m = 0.0;
  double within_two = 0.0;  ///< of sigma with the level's bias
};

Errors errors_of(const Raster& r) {
  Errors e;
  double n = 0.0;
  for (std::size_t k = 0; k < r.cells(); ++k) {
    if (std::isnan(r.z_m[k])) continue;
    const auto width = static_cast<std::size_t>(r.width);
    const Vec2 p = r.level.centre(
        {r.first.i + static_cast<int>(k % width), r.first.j + static_cast<int>(k / width)});
    const double off = r.z_m[k] - ground(p.x(), p.y());
    e.rms_m += off * off;
    const double sigma = std::hypot(layer_at(r.sigma_m, k), r.level.bias_sigma_m);
    e.within_two += std::abs(off) <= 2.0 * sigma ? 1.0 : 0.0;
    n += 1.0;
  }
  EXPECT_GT(n, 0.0);
  return {std::sqrt(e.rms_m / n), e.within_two / n};
}

TEST(Fuse, TheMeanIsBetterThanEachMapAndItsSigmaIsConsistent) {
  const Raster a = survey({0.3, 0.0, 0.0, 1}, {0, 0}, 200, 200);
  const Raster b = survey({0.5, 0.0, 0.0, 2}, {0, 0}, 200, 200);
  const mapping::Fused fused = mapping::fuse({a, b});
  EXPECT_EQ(fused.several, 40000);
  // Beyond 4 sigma: 6e-5 of normal differences, 2.5 cells; 5 standard deviations of that more.
  EXPECT_LE(fused.changed, 10);
  const Errors e = errors_of(fused.raster);
  EXPECT_LT(e.rms_m, 0.95 * errors_of(a).rms_m);
  EXPECT_LT(e.rms_m, errors_of(b).rms_m);
  const double expected = 0.3 * 0.5 / std::hypot(0.3, 0.5);
  EXPECT_NEAR(e.rms_m, expected, 0.02 * expected);
  EXPECT_NEAR(layer_at(fused.raster.sigma_m, 0), expected, 1e-6);
  EXPECT_NEAR(e.within_two, 0.9545, 0.005);  // 5 standard deviations of 40000 tries
}

TEST(Fuse, SystematicErrorsAreWeightedAndCovered) {
  std::mt19937 rng(5);
  std::normal_distribution<double> normal;
  double inside = 0.0;
  constexpr int kPairs = 400;
  for (unsigned k = 0; k < kPairs; ++k) {
    // The finer map has the larger systematic error: weights by sigma alone would prefer it.
    const Survey one{0.1, 1.0, 1.0 * normal(rng), 2 * k + 1};
    const Survey other{0.4, 0.3, 0.3 * normal(rng), 2 * k + 2};
    const Raster fused =
        mapping::fuse({survey(one, {0, 0}, 10, 10), survey(other, {0, 0}, 10, 10)}).raster;
    EXPECT_EQ(fused.level.bias_sigma_m, 1.0);
    inside += errors_of(fused).within_two / kPairs;
    const double s1 = 0.01 + 1.0;
    const double s2 = 0.16 + 0.09;
    const double w = s2 / (s1 + s2);
    ASSERT_NEAR(layer_at(fused.sigma_m, 50), std::hypot(w * 0.1, (1.0 - w) * 0.4), 1e-6);
  }
  EXPECT_GT(inside, 0.95);
}

TEST(Fuse, ProvenanceCombinesAllFusedMaps) {
  Raster a = cell(10.0F, 0.5F, 7000, 0.2);
  a.level.bias_correlation_m = 500.0;
  a.count = {65000};
  a.source = {CellSource::kAerial};
  Raster b = cell(10.1F, 0.5F, 7100, 0.1);
  b.level.bias_correlation_m = 3000.0;
  b.count = {1000};
  b.source = {CellSource::kAerial};
  Raster fused = mapping::fuse({a, b}).raster;
  EXPECT_EQ(fused.count[0], 65535);
  EXPECT_EQ(fused.date[0], 7100);
  EXPECT_EQ(fused.source[0], CellSource::kAerial);
  EXPECT_EQ(fused.level.bias_sigma_m, 0.2);
  EXPECT_EQ(fused.level.bias_correlation_m, 3000.0);
  b.source = {CellSource::kSensed};
  EXPECT_EQ(mapping::fuse({a, b}).raster.source[0], CellSource::kMixed);
  b.z_m = {kNone};
  const mapping::Fused alone = mapping::fuse({a, b});
  EXPECT_EQ(alone.several, 0);
  EXPECT_EQ(alone.raster.z_m[0], 10.0F);
  EXPECT_EQ(alone.raster.sigma_m[0], 0.5F);
  EXPECT_EQ(alone.raster.count[0], 65000);
  EXPECT_EQ(alone.raster.source[0], CellSource::kAerial);
  a.z_m = {kNone};
  EXPECT_TRUE(std::isnan(mapping::fuse({a, b}).raster.z_m[0]));
}

TEST(Fuse, WhereTheGroundHasChangedTheNewestMapIsUsed) {
  const Raster old = cell(10.0F, 0.1F, 5000);
  const Raster newer = cell(15.0F, 0.5F, 7000);
  mapping::Fused fused = mapping::fuse({old, newer});
  EXPECT_EQ(fused.changed, 1);
  EXPECT_EQ(fused.raster.z_m[0], 15.0F);
  EXPECT_EQ(fused.raster.sigma_m[0], 0.5F);
  EXPECT_EQ(fused.raster.date[0], 7000);
  // Without distinguishing dates: the map with the smallest sigma.
  EXPECT_EQ(mapping::fuse({old, cell(15.0F, 0.5F, 0)}).raster.z_m[0], 10.0F);
  EXPECT_EQ(mapping::fuse({old, cell(15.0F, 0.5F, 5000)}).raster.z_m[0], 10.0F);
  EXPECT_EQ(mapping::fuse({cell(10.0F, 0.1F, 0, 2.0), cell(30.0F, 0.5F, 0)}).raster.z_m[0], 30.0F)
      << "a systematic error counts";
  // On either side of 4 sigma.
  const float four = 4.0F * std::hypot(0.1F, 0.5F);
  EXPECT_EQ(mapping::fuse({old, cell(10.0F + 0.99F * four, 0.5F, 7000)}).changed, 0);
  EXPECT_EQ(mapping::fuse({old, cell(10.0F + 1.01F * four, 0.5F, 7000)}).changed, 1);
  // Fused with those that agree with it.
  const Raster also = cell(15.2F, 0.5F, 6000);
  fused = mapping::fuse({old, newer, also});
  EXPECT_EQ(fused.changed, 1);
  EXPECT_NEAR(fused.raster.z_m[0], 15.1, 1e-5);
}

TEST(Fuse, OrderDoesNotMatter) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<float> z(10.0F, 13.0F);
  std::uniform_int_distribution<int> few(0, 3);
  for (int k = 0; k < 500; ++k) {
    std::vector<Raster> s(3);
    for (Raster& r : s) {
      const float sigma_m = 0.1F + 0.1F * static_cast<float>(few(rng));
      r = cell(z(rng), sigma_m, static_cast<std::uint16_t>(few(rng)), 0.1);
    }
    const Raster one = mapping::fuse({s[0], s[1], s[2]}).raster;
    for (const std::vector<Raster>& other :
         {std::vector<Raster>{s[1], s[2], s[0]}, std::vector<Raster>{s[2], s[1], s[0]}}) {
      const Raster two = mapping::fuse(other).raster;
      ASSERT_NEAR(one.z_m[0], two.z_m[0], 1e-5) << k;
      ASSERT_NEAR(one.sigma_m[0], two.sigma_m[0], 1e-6) << k;
      ASSERT_EQ(one.date[0], two.date[0]) << k;
    }
  }
}

TEST(Resample, TheSameLatticeIsReproducedToTheLastCell) {
  Raster r = test::random_raster(3, {-5, 250}, 12, 12);
  EXPECT_TRUE(test::same(
      cut(mapping::resample(r, Pose(), r.level, {-7, 248}, 16, 16), r.first, 12, 12), r));
  r.z_m[40] = kNone;
  const Raster same = mapping::resample(r, Pose(), r.level, r.first, 12, 12);
  for (std::size_t k = 0; k < r.cells(); ++k) EXPECT_EQ(std::isnan(same.z_m[k]), k == 40);
  // Shifted by whole cells.
  MapLevel shifted = r.level;
  shifted.origin_m += Vec2(3, -2) * r.level.cell_m;
  const Raster other = mapping::resample(r, Pose(), shifted, {-8, 252}, 12, 12);
  EXPECT_EQ(other.z_m[0], r.z_m[0]);
  EXPECT_EQ(other.z_m[12 * 12 - 1], r.z_m[12 * 12 - 1]);
}

TEST(Resample, ACoarserLatticeHasTheSigmaOfItsInterpolation) {
  const Raster rough =
      test::random_raster(4, {0, 0}, 240, 240);  // relief of 3 m, stated sigma 0.3 m
  MapLevel coarse = rough.level;
  coarse.cell_m *= 3.0;
  const Raster r = mapping::resample(rough, Pose(), coarse, {1, 1}, 78, 78);
  // A node's own 3 m, and 1.5 m / 2 of the mean of corners that are means of four nodes.
  double square = 0.0;
  for (const float s : r.sigma_m) square += s * s / static_cast<double>(r.cells());
  EXPECT_NEAR(std::sqrt(square), std::hypot(3.0, 0.75), 0.1);
  coarse.cell_m = 1.0;
  EXPECT_NEAR(mapping::resample(rough, Pose(), coarse, {10, 10}, 1, 1).sigma_m[0], 0.3, 1e-6);
}

class MergeMaps : public testing::Test {
 protected:
  MergeMaps()
      : path_(testing::TempDir() + "rcs_merge_" +
              testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~MergeMaps() override { fs::remove_all(path_); }

  [[nodiscard]] std::string at(const std::string& name) const { return path_ + "/" + name; }
  std::string write(const std::string& name, const MapFrame& frame, const Raster& r) const {
    EXPECT_TRUE(mapping::write_map(at(name), frame, r));
    return at(name);
  }
  static mapping::Merged merged(const std::vector<std::string>& maps, const std::string& out) {
    return *mapping::merge_maps(maps, out, [](double) { return true; });
  }
  static std::string why_not(const std::vector<std::string>& maps, const std::string& out) {
    const Result<mapping::Merged> done =
        mapping::merge_maps(maps, out, [](double) { return true; });
    return done ? "" : done.error().message;
  }
  /// The finest level as one raster.
  static Raster all_of(const std::string& map, Cell first, int width, int height) {
    const Result<MapFolder> folder = MapFolder::open(map);
    Result<mapping::MapResampler> all = mapping::MapResampler::open(map, *folder, 0.01);
    Result<Raster> r = all->read(folder->index().levels.front().level, first, width, height);
    return std::move(*r);
  }
  /// Index with the checksum of each tile file.
  static std::vector<std::uint8_t> index_of(const std::string& map) {
    std::vector<std::uint8_t> bytes;
    EXPECT_TRUE(read_file(map + "/map.index", 1U << 20U, &bytes));
    return bytes;
  }

  std::string path_;
};

TEST_F(MergeMaps, TheUnionDoesNotDependOnTheOrderAndIsRepeatableToTheByte) {
  const MapFrame frame = test::frame();
  Raster a = survey({0.3, 0.2, 0.0, 1}, {-100, -100}, 400, 300);
  Raster b = survey({0.4, 0.5, 0.1, 2}, {150, -20}, 400, 300);
  a.z_m[a.at({200, 100})] = kNone;
  for (int i = 180; i < 190; ++i) b.z_m[b.at({i, 50})] += 8.0F;  // a wall was built
  b.date = {7500};
  write("a", frame, a);
  write("b", frame, b);
  const mapping::Merged ab = merged({at("a"), at("b")}, at("ab"));
  merged({at("b"), at("a")}, at("ba"));
  EXPECT_EQ(ab.cells, 2 * 400 * 300 - 150 * 220);
  EXPECT_EQ(ab.several, 150 * 220 - 1);
  EXPECT_GE(ab.changed, 10);
  EXPECT_LE(ab.changed, 16);  // by chance: 2
  const Raster one = all_of(at("ab"), {-100, -100}, 650, 380);
  const Raster two = all_of(at("ba"), {-100, -100}, 650, 380);
  EXPECT_EQ(one.level.bias_sigma_m, 0.5);
  for (std::size_t k = 0; k < one.cells(); ++k) {
    ASSERT_EQ(std::isnan(one.z_m[k]), std::isnan(two.z_m[k]));
    if (std::isnan(one.z_m[k])) continue;
    ASSERT_NEAR(one.z_m[k], two.z_m[k], 1e-4);
    ASSERT_NEAR(one.sigma_m[k], two.sigma_m[k], 1e-6);
  }
  EXPECT_EQ(one.z_m[one.at({185, 50})], b.z_m[b.at({185, 50})]);
  EXPECT_EQ(one.z_m[one.at({-100, -100})], a.z_m[0]) << "copied, to the outermost cell";
  EXPECT_EQ(one.z_m[one.at({549, 279})], b.z_m.back());
  EXPECT_EQ(one.z_m[one.at({200, 100})], b.z_m[b.at({200, 100})]) << "a hole is filled";
  EXPECT_EQ(one.count[one.at({200, 10})], 2);
  EXPECT_EQ(one.date[one.at({200, 10})], 7500);
  EXPECT_EQ(one.date[one.at({0, 0})], 7000);
  merged({at("a"), at("b")}, at("again"));
  EXPECT_EQ(index_of(at("ab")), index_of(at("again")));
  merged({at("a"), at("b")}, at("a"));
  EXPECT_EQ(index_of(at("ab")), index_of(at("a"))) << "output into one of the input maps";
  EXPECT_GT(MapFolder::open(at("ab"))->index().levels.size(), 1U);
}

/// The same ground seen from another datum.
Raster survey_from(const MapFrame& here, const MapFrame& there, double cell_m, Cell first,
                   int side) {
  const Pose T_here_there = LocalFrame(here.datum).from(LocalFrame(there.datum));
  Raster r;
  r.level = {cell_m, Vec2(0.7, -0.4), 0.0, 1000.0};
  r.first = first;
  r.width = r.height = side;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const Vec2 p = r.level.centre({first.i + i, first.j + j});
      double z = 0.0;
      for (int round = 0; round < 30; ++round) {
        const Vec3 at = T_here_there * Vec3(p.x(), p.y(), z);
        z += ground(at.x(), at.y()) - at.z();
      }
      r.z_m.push_back(static_cast<float>(z));
    }
  }
  r.sigma_m = {0.2F};
  r.count = {3};
  r.source = {CellSource::kSurvey};
  return r;
}

TEST_F(MergeMaps, OtherDatumsAndCellsAreTheSameGround) {
  const MapFrame here = test::frame();
  for (const double km : {1.0, 60.0}) {
    MapFrame there = here;
    there.datum = LocalFrame(here.datum).to_geodetic({600.0 * km, -800.0 * km, 0.0});
    there.datum.height.m = here.datum.height.m + 250.0;
    const Vec3 origin = LocalFrame(there.datum).from(LocalFrame(here.datum)) * Vec3::Zero();
    const double cell_m = 3.0;
    const Cell first{static_cast<int>(origin.x() / cell_m) - 100,
                     static_cast<int>(origin.y() / cell_m) - 100};
    write("here", here, survey({0.2, 0.0, 0.0, 0}, {-30, -30}, 60, 60));
    write("there", there, survey_from(here, there, cell_m, first, 200));
    const mapping::Merged m = merged({at("here"), at("there")}, at("both"));
    EXPECT_EQ(m.changed, 0);
    EXPECT_EQ(m.several, 60 * 60);
    EXPECT_GT(m.cells, 280 * 280);  // 600 m, less where the axes are turned
    EXPECT_EQ(m.frame.datum.lat_rad, here.datum.lat_rad);
    EXPECT_EQ(m.cell_m, 2.0);
    const Raster all = all_of(at("both"), {-140, -140}, 280, 280);
    // Interpolation between 3 m cells: curvature 2.4e-4 / m times 9 m^2 / 8.
    EXPECT_LT(errors_of(all).rms_m, 0.0005) << km << " km";
    EXPECT_EQ(all.count[all.at({100, 100})], 3);
    EXPECT_EQ(all.source[all.at({0, 0})], CellSource::kMixed);
  }
}

TEST_F(MergeMaps, MuchFinerMapsAreReadAtTheResolutionOfTheLattice) {
  const MapFrame frame = test::frame();
  const std::string fine = write("fine", frame, survey({0.1, 0.0, 0.0, 1}, {0, 0}, 600, 600, 0.5));
  const std::string coarse = write("coarse", frame, survey({1.0, 0.0, 0.0, 2}, {0, 0}, 50, 50, 10));
  const Result<mapping::MapResampler> read =
      mapping::MapResampler::open(fine, *MapFolder::open(coarse), 10.0);
  EXPECT_EQ(read->level().cell_m, 2.0) << "the coarsest level of the map";
  merged({coarse, fine}, at("out"));
  EXPECT_LT(errors_of(all_of(at("out"), {2, 2}, 20, 20)).rms_m, 0.1)
      << "16 fine cells for each cell";
}

TEST_F(MergeMaps, IncompatibleMapsAreRejectedByName) {
  MapFrame frame = test::frame();
  const Raster r = survey({}, {0, 0}, 10, 10);
  const std::string a = write("a", frame, r);
  frame.reference = "NAD83(2011)";
  const std::string b = write("b", frame, r);
  const std::string why = why_not({a, b}, at("out"));
  for (const std::string& name : {a, b, std::string("WGS84"), frame.reference}) {
    EXPECT_NE(why.find(name), std::string::npos) << why;
  }
  frame = test::frame();
  frame.heights = "EGM96";
  const std::string heights = why_not({a, write("c", frame, r)}, at("out"));
  EXPECT_NE(heights.find("above EGM96"), std::string::npos) << heights;
  EXPECT_NE(heights.find("above ellipsoid"), std::string::npos);
  frame = test::frame();
  frame.datum.lat_rad = -0.3;
  EXPECT_NE(why_not({a, write("d", frame, r)}, at("out")).find("1000 km"), std::string::npos);
  EXPECT_NE(why_not({a, a + "/"}, at("out")).find("twice"), std::string::npos);
  EXPECT_NE(why_not({a, at("none")}, at("out")).find("none"), std::string::npos);
  EXPECT_FALSE(fs::exists(at("out")));
}

TEST_F(MergeMaps, LostPointsAreCounted) {
  Raster r = survey({}, {0, 0}, 10, 10);
  const std::string bare = write("bare", test::frame(), r);
  r.points = test::random_points(1, r, 30);
  const std::string wooded = write("wooded", test::frame(), r);
  EXPECT_EQ(merged({bare, wooded}, at("out")).points_lost, 30);
}

TEST_F(MergeMaps, APriorMapFillsUnknownCells) {
  Raster fine = survey({0.02, 0.01, 0.0, 1}, {0, 0}, 100, 100, 1.0);
  for (std::size_t k = 0; k < fine.cells(); k += 2) fine.z_m[k] = kNone;
  const std::string a = write("a", test::frame(), fine);
  const std::string b =
      write("b", test::frame(), survey({0.3, 0.4, 5.0}, {-100, -100}, 400, 400, 2.0));
  const Result<mapping::Filled> filled =
      mapping::fill_map(a, b, at("out"), [](double) { return true; });
  ASSERT_TRUE(filled) << filled.error().message;
  EXPECT_EQ(filled->cells, 256 * 256) << "the whole tile, and no other";
  EXPECT_EQ(filled->filled, 256 * 256 - 5000);
  const Raster r = all_of(at("out"), {0, 0}, 100, 100);
  EXPECT_EQ(r.z_m[1], fine.z_m[1]);
  EXPECT_FLOAT_EQ(layer_at(r.sigma_m, 1), 0.02F);
  EXPECT_NEAR(r.z_m[0], ground(0.5, 0.5) + 5.0, 0.02);
  EXPECT_FLOAT_EQ(layer_at(r.sigma_m, 0), 0.5F) << "0.3 m, and a systematic error of 0.4 m";
  EXPECT_EQ(mapping::fill_map(a, b, at("none"), [](double) { return false; }).error().message,
            "interrupted");
  EXPECT_FALSE(fs::exists(at("none")));
}

TEST_F(MergeMaps, AnInterruptedMergeLeavesNoFile) {
  const Raster r = survey({}, {0, 0}, 600, 10);
  const std::string a = write("a", test::frame(), r), b = write("b", test::frame(), r);
  EXPECT_EQ(mapping::merge_maps({a, b}, at("out"), [](double) { return false; }).error().message,
            "interrupted");
  EXPECT_FALSE(fs::exists(at("out")));
  EXPECT_TRUE(test::files_next_to(at("out")).empty());
  fs::resize_file(tile_file(b, 2.0, {1, 0}), 300);
  EXPECT_NE(why_not({a, b}, at("out")).find("1_0.tile"), std::string::npos);
}

}  // namespace
}  // namespace rcs
