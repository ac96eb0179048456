// libFuzzer: the first byte selects the file format of the other bytes. Each file is read or
// rejected; no value is used before it is checked.

#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>

#include "rcs/terrain/map_index.h"
#include "rcs/terrain/map_tile.h"
#include "rcs/zones/zone_file.h"
#include "rcs/zones/zone_raster.h"
#include "sim/terrain/dem.h"
#include "tests/fuzz/seeds.h"
#include "tests/tools/survey/las_file.h"
#include "tools/base/trajectory.h"
#include "tools/clouds/cloud_file.h"
#include "tools/clouds/las_header.h"
#include "tools/importers/imu_gps_import.h"
#include "tools/importers/kitti_sweep.h"
#include "tools/survey/npy_raster.h"

namespace {

using rcs::test::Bytes;

enum Kind : std::uint8_t {
  kPcd,
  kPly,
  kXyz,
  kBin,
  kNpy,
  kLas,
  kTum,
  kKitti,
  kCsv,
  kDem,
  kIndex,
  kTile,
  kCalib,
  kZones,
  kKinds
};

Bytes seed(Kind kind, std::string_view text) {
  Bytes all = {kind};
  all.insert(all.end(), text.begin(), text.end());
  return all;
}

std::vector<Bytes> seeds() {
  rcs::test::LasFile las;
  las.points = {{500001.0, 5200001.0, 300.0}, {500002.0, 5200002.0, 301.0}};
  las.records = {{"LASF_Projection", 2112, "GEOGCS[\"WGS 84\"]"}};
  rcs::test::LasFile wide = las;
  wide.minor = 4;
  wide.format = 6;
  wide.extended = las.records;
  constexpr std::string_view kPcdHead =
      "FIELDS x y z i\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 1\nPOINTS "
      "2\nDATA ";
  const std::string ply = "property float x\nproperty double y\nproperty short z\nend_header\n";
  std::string npy("\x93NUMPY\x01\x00\x46\x00", 10);
  npy += "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }           \n";
  npy += std::string(8, '\0');
  return {seed(kPcd, std::string(kPcdHead) + "ascii\n1 2 3 0 0\nnan 2 3 0 0\n"),
          seed(kPcd, std::string(kPcdHead) + "binary\n" + std::string(28, 'a')),
          seed(kPly, "ply\nformat ascii 1.0\nelement vertex 1\n" + ply + "1 2 3\n"),
          seed(kPly,
               "ply\nformat binary_little_endian 1.0\nelement vertex 1\n" + ply + "12345678901234"),
          seed(kXyz, "1,2,3\n1e32;-inf;nan # x\n"),
          seed(kBin, std::string(32, 'a')),
          seed(kNpy, npy),
          seed(kLas, las.bytes()),
          seed(kLas, wide.bytes()),
          seed(kTum, "1e32 0 0 0 0 0 0 1\n1.5 0 0 0 0 0 0 1\n"),
          seed(kKitti, "1 0 0 0 0 1 0 0 0 0 1 0\n"),
          seed(kCsv, "t,a\n1.5,2\n1e32,NA\n235959000,+3\n"),
          seed(kDem,
               "ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3 4 5 6 7 8 9 10 11 12 "
               "13 14 15 16\n"),
          seed(kZones, R"({"type":"FeatureCollection","features":[{"type":"Feature","properties":)"
                       R"({"kind":"speed","name":"a","speed_mps":2},"geometry":{"type":"Polygon",)"
                       R"("coordinates":[[[0,0],[1e-3,0],[0,1e-3],[0,0]]]}}]})"),
          seed(kCalib, "R: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n")};
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Bytes bytes(data + 1, data + size);
  const std::string text(bytes.begin(), bytes.end());
  constexpr const char* kNames[] = {"a.pcd", "a.ply", "a.xyz", "a.bin"};
  switch (data[0] % kKinds) {
    case kPcd:
    case kPly:
    case kXyz:
    case kBin:
      (void)rcs::clouds::parse_cloud(bytes, kNames[data[0] % kKinds], {});
      (void)rcs::clouds::parse_cloud(bytes, kNames[data[0] % kKinds], {2, 3});
      (void)rcs::importers::parse_sweep(bytes, "a");
      break;
    case kNpy:
      (void)rcs::survey::parse_npy(bytes, "a");
      break;
    case kLas: {
      std::istringstream in(text);
      const rcs::Result<rcs::clouds::LasHeader> las =
          rcs::clouds::read_las_header(in, static_cast<std::int64_t>(size - 1), "a");
      if (las)
        RCS_CHECK(las->data_at + las->points * las->record_bytes <=
                  static_cast<std::int64_t>(size - 1));
      break;
    }
    case kTum:
      (void)rcs::tools::parse_tum(text, "a");
      break;
    case kKitti:
      (void)rcs::tools::parse_kitti(text, "a");
      break;
    case kCsv:
      if (const rcs::Result<rcs::tools::CsvTable> table = rcs::tools::CsvTable::parse(text, "a");
          table) {
        for (const bool time_of_day : {false, true}) {
          for (const double unit_s : {1.0, 1e-9, 1e9}) {
            (void)rcs::importers::stamps_of(*table, {"t", unit_s, time_of_day});
          }
        }
        (void)table->numbers("a");
      }
      break;
    case kDem:
      (void)rcs::sim::parse_esri_ascii(text, "a");
      break;
    case kIndex:
      (void)rcs::decode_index(bytes);
      break;
    case kTile:
      (void)rcs::decode_tile(bytes.data(), bytes.size(), 0);
      break;
    case kZones:
      if (const rcs::Result<rcs::GeodeticZones> zones = rcs::parse_zones(text, "a"); zones) {
        const rcs::Zones in_world = zones->in_world(rcs::LocalFrame({0.5, 1.0, {0.0}}));
        RCS_CHECK(!std::isnan(in_world.clearance({1.0, 2.0}).m));
        (void)in_world.conflict({1.0, 2.0}, {3.0, -4.0}, 0.5);
        (void)in_world.speed_limit_mps({1.0, 2.0}, 0.5);
        rcs::ZoneRaster raster;
        (void)raster.forbidden(in_world, {0.4, {-5, -5}, 10, 10, 0.3, {1.0, 2.0}}, 1.0);
      }
      break;
    default:
      (void)rcs::importers::parse_imu_to_velo(text, "a");
      break;
  }
  return 0;
}
