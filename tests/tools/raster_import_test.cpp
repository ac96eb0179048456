#include "tools/rcs/raster_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "rcs/base/geodesy.h"
#include "rcs/terrain/elevation_map.h"
#include "rcs/terrain/map_folder.h"
#include "tools/rcs/map_export.h"

namespace rcs::tools {
namespace {

using testing::HasSubstr;
using testing::NanSensitiveFloatEq;
using testing::Pointwise;

/// Latitude and longitude in degrees to a height.
using Ground = std::function<double(double, double)>;

class RasterImportTest : public testing::Test {
 protected:
  RasterImportTest() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_raster_XXXXXX").string();
    EXPECT_NE(mkdtemp(folder_.data()), nullptr);
    wanted_.path = folder_ + "/dem.asc";
    wanted_.crs = "EPSG:4326";
    wanted_.heights = "ellipsoid";
    wanted_.quality.sigma_m = 0.5;
  }
  ~RasterImportTest() override { std::filesystem::remove_all(folder_); }

  /// An ESRI ASCII grid of 80 x 60 cells of 1/3600 deg.
  void write(double south_deg, double west_deg, const Ground& ground) const {
    constexpr double kCell = 1.0 / 3600.0;
    std::ofstream out(wanted_.path);
    out.precision(12);
    out << "ncols 80\nnrows 60\nxllcorner " << west_deg << "\nyllcorner " << south_deg
        << "\ncellsize " << kCell << "\nNODATA_value -9999\n";
    for (int r = 59; r >= 0; --r) {
      for (int c = 0; c < 80; ++c) {
        out << ground(south_deg + (r + 0.5) * kCell, west_deg + (c + 0.5) * kCell) << ' ';
      }
      out << '\n';
    }
  }
  /// Names a coordinate reference system in the file, for which the grid's format has no place: a
  /// virtual raster of the grid, its cells laid at `affine`.
  void write_virtual(const std::string& crs, const std::string& affine) {
    std::ofstream(folder_ + "/dem.vrt")
        << R"(<VRTDataset rasterXSize="80" rasterYSize="60"><SRS>)" << crs << "</SRS><GeoTransform>"
        << affine << "</GeoTransform>"
        << R"(<VRTRasterBand dataType="Float32" band="1"><SimpleSource>)"
        << R"(<SourceFilename relativeToVRT="1">dem.asc</SourceFilename></SimpleSource>)"
        << "</VRTRasterBand></VRTDataset>";
    wanted_.path = folder_ + "/dem.vrt";
    wanted_.crs.clear();
  }
  Result<RasterImported> import() {
    return import_raster(wanted_, map_, [](double) { return true; });
  }
  ElevationMap loaded() {
    Result<ElevationMap> map = ElevationMap::load(map_, 1e9);
    EXPECT_TRUE(map) << map.error().message;
    return std::move(map).value();
  }

  std::string folder_;
  std::string map_ = folder_ + "/map";
  RasterImport wanted_;
};

double hill(double lat_deg, double lon_deg) {
  return 900.0 + 4e3 * (lat_deg - 47.0) - 2.5e3 * (lon_deg - 8.0);
}

TEST_F(RasterImportTest, ThePlacesAreTheirsOnTheEarth) {
  write(47.0, 8.0, hill);
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->frame.reference, "WGS84");
  EXPECT_EQ(done->frame.heights, "ellipsoid");
  const ElevationMap map = loaded();
  const LocalFrame local(map.datum());
  for (double lat = 47.001; lat < 47.0155; lat += 0.0019) {
    for (double lon = 8.001; lon < 8.021; lon += 0.0023) {
      const Vec3 p = local.to_world({radians(lat), radians(lon), {hill(lat, lon)}});
      Elevation e;
      ASSERT_TRUE(map.sample(p.x(), p.y(), &e));
      EXPECT_NEAR(e.z_m, p.z(), 0.01);  // a plane in degrees is one in metres but for curvature
      EXPECT_NEAR(e.sigma_m, 0.5, 0.01);
    }
  }
}

TEST_F(RasterImportTest, HeightsAboveTheGeoidBecomeThoseAboveTheEllipsoid) {
  write(0.0, 0.0, [](double, double) { return 100.0; });
  wanted_.heights = "EGM96";
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  // EGM96 at 0 N 0 E: 17.16 m.
  EXPECT_NEAR(done->frame.undulation_m, 17.16, 0.1);
  Elevation e;
  ASSERT_TRUE(loaded().sample(0.0, 0.0, &e));
  EXPECT_NEAR(e.z_m, 100.0 + done->frame.undulation_m, 0.01);
  wanted_.heights.clear();
  wanted_.undulation_m = -3.0;
  ASSERT_TRUE(import());
  ASSERT_TRUE(loaded().sample(0.0, 0.0, &e));
  EXPECT_NEAR(e.z_m, 97.0, 0.01);
}

TEST_F(RasterImportTest, ACompoundSystemSaysWhatItsHeightsAreAbove) {
  write(47.0, 8.0, hill);
  const auto z_m = [this](const std::string& heights) {
    wanted_.heights = heights;
    const Result<RasterImported> done = import();
    EXPECT_TRUE(done) << done.error().message;
    return done ? whole_level(*MapFolder::open(map_), 0)->z_m : std::vector<float>();
  };
  const std::string in_degrees =
      "8, 0.0002777777777778, 0, 47.0166666666667, 0, -0.0002777777777778";
  const std::string in_metres = "424000, 30, 0, 5207000, 0, -30";  // zone 32, thereabouts
  for (const auto& [flat, affine] :
       {std::pair{"EPSG:4326", in_degrees}, {"EPSG:32632", in_metres}}) {
    write_virtual(flat, affine);
    const std::vector<float> said = z_m("EGM96");
    const std::string compound = std::string(flat) + "+5773";
    write_virtual(compound, affine);
    EXPECT_THAT(z_m(""), Pointwise(NanSensitiveFloatEq(), said)) << compound;
    wanted_.crs = compound;
    EXPECT_THAT(z_m(""), Pointwise(NanSensitiveFloatEq(), said)) << "--crs " << compound;
  }
}

TEST_F(RasterImportTest, UnitsHolesAndRoughGround) {
  write(47.0, 8.0, [](double lat, double lon) {
    if (lat > 47.012) return -9999.0;  // a hole
    const bool rough = lon > 8.012;
    return 1000.0 + (rough ? 10.0 * std::sin(9e3 * lat) * std::sin(9e3 * lon) : 0.0);
  });
  wanted_.height_unit_m = 0.3048;
  ASSERT_TRUE(import());
  const ElevationMap map = loaded();
  const LocalFrame local(map.datum());
  const auto at = [&](double lat, double lon, Elevation* e) {
    const Vec3 p = local.to_world({radians(lat), radians(lon), {304.8}});
    return map.sample(p.x(), p.y(), e);
  };
  Elevation e;
  ASSERT_TRUE(at(47.006, 8.004, &e));
  EXPECT_NEAR(e.z_m, 304.8, 0.1);
  EXPECT_NEAR(e.sigma_m, 0.5, 0.01);
  EXPECT_FALSE(at(47.014, 8.004, &e));
  ASSERT_TRUE(at(47.006, 8.018, &e));
  // 2.5 rad a node: between every other node interpolation misses 10 (1 - cos 2.5) sin sin feet.
  EXPECT_NEAR(e.sigma_m, 0.6 * 0.3048 * 10.0 * 1.8 * 0.5, 0.4);
}

TEST_F(RasterImportTest, WhatAFileDoesNotSayIsAskedFor) {
  write(47.0, 8.0, hill);
  const auto why = [this] {
    const Result<RasterImported> done = import();
    EXPECT_FALSE(std::filesystem::exists(map_ + ".part"));
    return done ? std::string() : done.error().message;
  };
  wanted_.crs.clear();
  EXPECT_THAT(why(), HasSubstr("--crs"));
  wanted_.crs = "EPSG:nonsense";
  EXPECT_THAT(why(), HasSubstr("no coordinate reference system"));
  wanted_.crs = "EPSG:4326";
  wanted_.heights.clear();
  EXPECT_THAT(why(), HasSubstr("--heights"));
  wanted_.heights = "EPSG:4326";
  EXPECT_THAT(why(), HasSubstr("no vertical datum"));
  wanted_.heights = "ellipsoid";
  wanted_.band = 2;
  EXPECT_THAT(why(), HasSubstr("it has 1"));
  wanted_.band = 1;
  wanted_.cell_m = 500.0;
  EXPECT_THAT(why(), HasSubstr("--cell"));
  wanted_.cell_m = 0.0;
  wanted_.height_unit_m = 1000.0;
  EXPECT_THAT(why(), HasSubstr("not on the earth"));
  wanted_.height_unit_m = 1.0;
  wanted_.crs = "EPSG:32632";  // metres: a corner of some centimetres at 47 m north
  EXPECT_THAT(why(), HasSubstr("pixels are"));
  std::ofstream(wanted_.path) << "not a raster";
  EXPECT_THAT(why(), HasSubstr("dem.asc"));
}

TEST_F(RasterImportTest, AnotherFrameIsNamed) {
  write(47.0, 8.0, hill);
  wanted_.crs = "EPSG:4258";
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->frame.reference, "ETRS89");
  EXPECT_THAT(check_frame(done->frame, "WGS84").error().message, HasSubstr("ETRS89"));
}

TEST_F(RasterImportTest, AnExportedMapIsTheSameGroundWhenImportedAgain) {
  write(47.0, 8.0, hill);
  ASSERT_TRUE(import());
  const ElevationMap before = loaded();
  const Result<MapFolder> folder = MapFolder::open(map_);
  const Result<Raster> whole = whole_level(*folder, 0);
  ASSERT_TRUE(whole) << whole.error().message;
  RasterImport again;
  again.path = folder_ + "/exported.tif";
  again.heights = "ellipsoid";
  again.quality.sigma_m = 0.5;
  ASSERT_TRUE(write_geotiff(folder->index().frame, *whole, again.path));
  map_ = folder_ + "/again";
  const Result<RasterImported> done = import_raster(again, map_, [](double) { return true; });
  ASSERT_TRUE(done) << done.error().message;
  const ElevationMap after = loaded();
  const Pose T_after_before = LocalFrame(after.datum()).from(LocalFrame(before.datum()));
  for (double x = -700.0; x < 700.0; x += 130.0) {
    for (double y = -800.0; y < 800.0; y += 130.0) {
      Elevation a, b;
      ASSERT_TRUE(before.sample(x, y, &a));
      const Vec3 p = T_after_before * Vec3(x, y, a.z_m);
      ASSERT_TRUE(after.sample(p.x(), p.y(), &b));
      // Orthographic places are 0.1 m off for ground 900 m above the datum, on a slope of 5 %.
      EXPECT_NEAR(b.z_m, p.z(), 0.02);
    }
  }
  ASSERT_TRUE(write_hillshade(*whole, folder_ + "/relief.png"));
  std::ifstream png(folder_ + "/relief.png", std::ios::binary);
  std::string head(8, '\0');
  png.read(head.data(), 8);
  EXPECT_EQ(head, "\x89PNG\r\n\x1a\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/relief.png.aux.xml"));
}

}  // namespace
}  // namespace rcs::tools
