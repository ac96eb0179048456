#include "tools/survey/raster_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "rcs/base/geodesy.h"
#include "rcs/terrain/elevation_map.h"
#include "rcs/terrain/map_folder.h"
#include "tests/support/files_next_to.h"
#include "tools/survey/map_export.h"

namespace rcs::survey {
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
    map_ = folder_ + "/map";
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
  /// The grid in a format with a coordinate reference system (.flt), its cells at `affine`.
  /// @param band  metadata of the band in XML
  void write_with_crs(const std::string& crs, const std::string& affine,
                      const std::string& band = "") {
    std::ifstream grid(folder_ + "/dem.asc");
    std::string line;
    for (int k = 0; k < 6; ++k) std::getline(grid, line);
    std::ofstream cells(folder_ + "/dem.flt", std::ios::binary);
    for (float z = 0.0F; grid >> z;) cells.write(reinterpret_cast<const char*>(&z), sizeof z);
    std::ofstream(folder_ + "/dem.hdr")
        << "NROWS 60\nNCOLS 80\nNBANDS 1\nNBITS 32\nPIXELTYPE FLOAT\nBYTEORDER I\nLAYOUT BIL\n";
    std::ofstream(folder_ + "/dem.flt.aux.xml")
        << "<PAMDataset><SRS>" << crs << "</SRS><GeoTransform>" << affine << "</GeoTransform>"
        << R"(<PAMRasterBand band="1">)" << band << "</PAMRasterBand></PAMDataset>";
    wanted_.path = folder_ + "/dem.flt";
    wanted_.crs.clear();
  }
  Result<RasterImported> import() {
    return import_raster(wanted_, map_, [](double) { return true; });
  }
  std::string why_not() {
    const Result<RasterImported> done = import();
    EXPECT_TRUE(test::files_next_to(map_).empty());
    return done ? std::string() : done.error().message;
  }
  double z_at_datum() {
    Elevation e;
    EXPECT_TRUE(loaded().sample(0.0, 0.0, &e));
    return e.z_m;
  }
  ElevationMap loaded() {
    Result<ElevationMap> map = ElevationMap::load(map_, 1e9);
    EXPECT_TRUE(map) << map.error().message;
    return std::move(map).value();
  }

  std::string folder_;
  std::string map_;
  RasterImport wanted_;
};

/// Transform of the grid of write(47, 8), in degrees.
constexpr const char* kInDegrees =
    "8, 0.0002777777777778, 0, 47.0166666666667, 0, -0.0002777777777778";

double flat(double /*lat_deg*/, double /*lon_deg*/) { return 300.0; }

double hill(double lat_deg, double lon_deg) {
  return 900.0 + 4e3 * (lat_deg - 47.0) - 2.5e3 * (lon_deg - 8.0);
}

TEST_F(RasterImportTest, CellsHaveTheirPositionOnTheEarth) {
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
      EXPECT_NEAR(e.z_m, p.z(),
                  0.01);  // a plane in degrees is a plane in metres except for curvature
      EXPECT_NEAR(e.sigma_m, 0.5, 0.01);
    }
  }
}

TEST_F(RasterImportTest, HeightsAboveTheGeoidAreConvertedToTheEllipsoid) {
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

TEST_F(RasterImportTest, ACompoundSystemDefinesTheHeightReference) {
  write(47.0, 8.0, hill);
  const auto z_m = [this](const std::string& heights) {
    wanted_.heights = heights;
    const Result<RasterImported> done = import();
    EXPECT_TRUE(done) << done.error().message;
    return done ? whole_level(*MapFolder::open(map_), 0)->z_m : std::vector<float>();
  };
  const std::string in_metres = "424000, 30, 0, 5207000, 0, -30";  // zone 32, thereabouts
  for (const auto& [flat, affine] :
       {std::pair<const char*, std::string>{"EPSG:4326", kInDegrees}, {"EPSG:32632", in_metres}}) {
    write_with_crs(flat, affine);
    const std::vector<float> said = z_m("EGM96");
    const std::string compound = std::string(flat) + "+5773";
    write_with_crs(compound, affine);
    EXPECT_THAT(z_m(""), Pointwise(NanSensitiveFloatEq(), said)) << compound;
    wanted_.crs = compound;
    EXPECT_THAT(z_m(""), Pointwise(NanSensitiveFloatEq(), said)) << "--crs " << compound;
  }
}

TEST_F(RasterImportTest, UnitsHolesAndRoughGroundAreHandled) {
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

TEST_F(RasterImportTest, MissingMetadataIsRequested) {
  write(47.0, 8.0, hill);
  wanted_.crs.clear();
  EXPECT_THAT(why_not(), HasSubstr("--crs"));
  wanted_.crs = "EPSG:nonsense";
  EXPECT_THAT(why_not(), HasSubstr("not a coordinate reference system"));
  wanted_.crs = "EPSG:4326";
  wanted_.heights.clear();
  EXPECT_THAT(why_not(), HasSubstr("--heights"));
  wanted_.heights = "EPSG:4326";
  EXPECT_THAT(why_not(), HasSubstr("not a vertical datum"));
  wanted_.heights = "EPSG:4326+5773";
  EXPECT_THAT(why_not(), HasSubstr("not a vertical datum"));
  wanted_.heights = "ellipsoid";
  wanted_.band = 2;
  EXPECT_THAT(why_not(), HasSubstr("the file has 1"));
  wanted_.band = 1;
  wanted_.cell_m = 500.0;
  EXPECT_THAT(why_not(), HasSubstr("--cell"));
  wanted_.cell_m = 0.0;
  wanted_.height_unit_m = 1000.0;
  EXPECT_THAT(why_not(), HasSubstr("use --nodata"));
  wanted_.height_unit_m = 1.0;
  wanted_.crs = "EPSG:32632";  // metres: a corner of some centimetres at 47 m north
  EXPECT_THAT(why_not(), HasSubstr("pixels are"));
  std::ofstream(wanted_.path) << "not a raster";
  EXPECT_THAT(why_not(), HasSubstr("dem.asc"));
}

TEST_F(RasterImportTest, TheVerticalUnitAppliesToABandWithoutAUnit) {
  constexpr double kSurveyFoot_m = 1200.0 / 3937.0;
  write(47.0, 8.0, flat);
  wanted_.heights.clear();
  wanted_.undulation_m = 0.0;  // no grid for NAVD88 is available
  const std::string feet = "EPSG:4269+6360";
  write_with_crs(feet, kInDegrees);
  ASSERT_TRUE(import());
  EXPECT_NEAR(z_at_datum(), 300.0 * kSurveyFoot_m, 1e-3);
  write_with_crs(feet, kInDegrees, "<UnitType>m</UnitType>");
  ASSERT_TRUE(import());
  EXPECT_NEAR(z_at_datum(), 300.0, 1e-3) << "the unit of the band takes precedence";
  write_with_crs(feet, kInDegrees);
  wanted_.height_unit_m = 0.5;
  ASSERT_TRUE(import());
  EXPECT_NEAR(z_at_datum(), 150.0, 1e-3);
  wanted_.height_unit_m = 0.0;
  wanted_.heights = "EPSG:5703";  // the same datum, in metres
  EXPECT_THAT(why_not(), HasSubstr("--height-unit"));
  wanted_.heights = "EPSG:6360";
  write_with_crs("EPSG:4269", kInDegrees);
  ASSERT_TRUE(import());
  EXPECT_NEAR(z_at_datum(), 300.0 * kSurveyFoot_m, 1e-3);
}

TEST_F(RasterImportTest, ScaleAndOffsetOfTheBandAreApplied) {
  write(47.0, 8.0, [](double lat, double) { return lat > 47.012 ? -9999.0 : 3000.0; });
  write_with_crs("EPSG:4326", kInDegrees,
                 "<NoDataValue>-9999</NoDataValue><Offset>-50</Offset><Scale>0.1</Scale>");
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_NEAR(z_at_datum(), 250.0, 1e-3);
  Elevation e;
  EXPECT_FALSE(loaded().sample(0.0, 700.0, &e)) << "no-data values are not scaled";
  write_with_crs("EPSG:4326", kInDegrees, "<Scale>0</Scale>");
  EXPECT_THAT(why_not(), HasSubstr("scale"));
}

TEST_F(RasterImportTest, AFormatThatReadsOtherFilesAndAUrlAreRejected) {
  write(47.0, 8.0, flat);
  const std::string grid = wanted_.path;
  wanted_.path = folder_ + "/dem.vrt";
  std::ofstream(wanted_.path)
      << R"(<VRTDataset rasterXSize="80" rasterYSize="60"><SRS>EPSG:4326</SRS><GeoTransform>)"
      << kInDegrees << R"(</GeoTransform><VRTRasterBand dataType="Float32" band="1"><SimpleSource>)"
      << R"(<SourceFilename relativeToVRT="1">dem.asc</SourceFilename></SimpleSource>)"
      << "</VRTRasterBand></VRTDataset>";
  EXPECT_THAT(why_not(), HasSubstr("Formats: GeoTIFF"));
  for (const char* path : {"/vsicurl/http://127.0.0.1:1/dem.tif", "http://127.0.0.1:1/dem.tif",
                           "GTIFF_DIR:1:dem.tif", "<VRTDataset></VRTDataset>"}) {
    wanted_.path = path;
    EXPECT_THAT(why_not(), HasSubstr("cannot open")) << path;
  }
  wanted_.path = folder_;
  EXPECT_THAT(why_not(), HasSubstr("is not a regular file"));
  wanted_.path = grid;
  wanted_.crs = "http://127.0.0.1:1/crs";
  EXPECT_THAT(why_not(), HasSubstr("not a coordinate reference system"));
}

TEST_F(RasterImportTest, HeightsOfAThreeDimensionalSystemAreEllipsoidal) {
  write(47.0, 8.0, flat);
  wanted_.heights.clear();
  wanted_.crs = "EPSG:4979";
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->frame.reference, "WGS84");
  EXPECT_EQ(done->frame.heights, "ellipsoid");
  EXPECT_TRUE(std::isnan(done->frame.undulation_m));
  EXPECT_NEAR(z_at_datum(), 300.0, 1e-3);
}

TEST_F(RasterImportTest, OutsideTheGeoidGridHeightsAreUnknown) {
  write(47.0, 8.0, flat);
  // In GTX format: big endian, from the south-west; it ends 650 m east of the middle.
  std::string grid;
  const auto put = [&grid](auto v) {
    char bytes[sizeof v];
    std::memcpy(bytes, &v, sizeof v);
    grid.append(std::make_reverse_iterator(bytes + sizeof v), std::make_reverse_iterator(bytes));
  };
  for (const double v : {46.8, 7.82, 0.1, 0.1}) put(v);
  put(5);
  put(3);
  for (int k = 0; k < 15; ++k) put(50.0F);
  std::ofstream(folder_ + "/geoid.gtx", std::ios::binary) << grid;
  wanted_.crs = "+proj=longlat +datum=WGS84 +geoidgrids=" + folder_ + "/geoid.gtx +type=crs";
  wanted_.heights.clear();
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  const ElevationMap map = loaded();
  Elevation e;
  for (const double y : {-800.0, 0.0, 800.0}) {
    for (const double x : {-700.0, 0.0, 300.0}) {
      ASSERT_TRUE(map.sample(x, y, &e)) << x << ' ' << y;
      EXPECT_NEAR(e.z_m, 350.0, 0.2);
    }
    EXPECT_FALSE(map.sample(800.0, y, &e));
  }
}

TEST_F(RasterImportTest, FramesHaveTheirCommonNames) {
  write(47.0, 8.0, hill);
  for (const auto& [crs, name] : {std::pair{"EPSG:4326", "WGS84"},
                                  {"EPSG:4979", "WGS84"},
                                  {"OGC:CRS84", "WGS84"},
                                  {"+proj=longlat +datum=WGS84", "WGS84"},
                                  {"EPSG:4269", "NAD83"},
                                  {"+proj=longlat +datum=NAD83", "NAD83"},
                                  {"EPSG:4258", "ETRS89"},
                                  {"EPSG:6318", "NAD83(2011)"},
                                  {"EPSG:6319", "NAD83(2011)"},
                                  {"EPSG:9000", "ITRF2014"},
                                  {"EPSG:4152", "NAD83(HARN)"},
                                  {"EPSG:4283", "GDA94"}}) {
    wanted_.crs = crs;
    const Result<RasterImported> done = import();
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_EQ(done->frame.reference, name) << crs;
  }
}

TEST_F(RasterImportTest, AnotherFrameIsNamed) {
  write(47.0, 8.0, hill);
  wanted_.crs = "EPSG:4258";
  const Result<RasterImported> done = import();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(done->frame.reference, "ETRS89");
  EXPECT_THAT(check_frame(done->frame, "WGS84").error().message, HasSubstr("ETRS89"));
}

TEST_F(RasterImportTest, AnExportedMapIsUnchangedWhenImportedAgain) {
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
      // Orthographic positions have an error of 0.1 m for ground 900 m above the datum, on a slope
      // of 5 %.
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

TEST_F(RasterImportTest, AnExportedMapKeepsItsReference) {
  write(47.0, 8.0, hill);
  for (const std::string crs : {"EPSG:4326", "EPSG:4269", "EPSG:4258", "EPSG:6318", "EPSG:9000",
                                "+proj=longlat +ellps=GRS80"}) {
    wanted_.path = folder_ + "/dem.asc";
    wanted_.crs = crs;
    const Result<RasterImported> first = import();
    ASSERT_TRUE(first) << first.error().message;
    const Result<MapFolder> folder = MapFolder::open(map_);
    const Result<Raster> before = whole_level(*folder, 0);
    wanted_.path = folder_ + "/exported.tif";
    wanted_.crs.clear();
    testing::internal::CaptureStderr();
    ASSERT_TRUE(write_geotiff(folder->index().frame, *before, wanted_.path));
    const Result<RasterImported> second = import();
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    ASSERT_TRUE(second) << second.error().message;
    EXPECT_EQ(second->frame.reference, first->frame.reference);
    EXPECT_EQ(second->cell_m, first->cell_m);
    // The cells of its border lie half on unknown cells.
    EXPECT_GT(second->known, 0.9 * static_cast<double>(first->known)) << crs;
  }
}

}  // namespace
}  // namespace rcs::survey
