#include "tests/support/real_sweeps.h"

#include <fmt/format.h>

#include <fstream>
#include <optional>
#include <utility>

#include "tools/base/trajectory.h"
#include "tools/clouds/cloud_file.h"
#include "tools/mapping/coarser.h"
#include "tools/survey/npy_raster.h"

namespace rcs::test {
namespace {

/// From rows "timestamp_ns,qw,qx,qy,qz,tx,ty,tz".
std::optional<Pose> city_pose(const std::string& csv, const std::string& timestamp) {
  std::ifstream in(csv);
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(timestamp + ",", 0) != 0) continue;
    const auto n = tools::parse_numbers(line.substr(timestamp.size() + 1));
    if (!n || n->size() != 7) return std::nullopt;
    return Pose{Quat((*n)[0], (*n)[1], (*n)[2], (*n)[3]).normalized(),
                Vec3((*n)[4], (*n)[5], (*n)[6])};
  }
  return std::nullopt;
}

}  // namespace

Result<RealSweeps> pittsburgh_sweeps(const std::string& data, double stated_m) {
  constexpr float kMaxRange_m = 100.0F;
  const std::string folder = data + kPittsburghLog;
  survey::SurveyQuality quality;
  quality.sigma_m = stated_m;
  Result<survey::ImportedRaster> read = survey::import_av2(folder, quality);
  if (!read) return read.error();
  RealSweeps out;
  out.frame = read->frame;
  out.raster = std::move(read->raster);
  for (const std::string timestamp : {"315966265259836000", "315966265360032000"}) {
    const Result<clouds::Cloud> cloud =
        clouds::read_cloud(fmt::format("{}/sensors/lidar/{}.bin", folder, timestamp), {});
    if (!cloud) return cloud.error();
    const std::optional<Pose> T_city_vehicle =
        city_pose(folder + "/city_SE3_egovehicle.csv", timestamp);
    if (!T_city_vehicle) return Error{fmt::format("{}: no pose at {}", folder, timestamp)};
    RasterPlace place;
    place.name = "sweep " + timestamp.substr(9, 3);
    place.T_map_vehicle = *T_city_vehicle;
    for (std::size_t k = 0; k < cloud->points.size(); ++k) {
      if (cloud->points[k].norm() <= kMaxRange_m) place.scan.push_back(cloud->points[k]);
    }
    out.places.push_back(std::move(place));
  }
  return out;
}

ElevationMap map_of(const MapFrame& frame, const Raster& raster) {
  return std::move(ElevationMap::from_rasters(frame, mapping::with_coarser_levels(raster))).value();
}

}  // namespace rcs::test
