// The estimated pose of a vehicle at rest must not move: 14 real scans (norlab_static_lidar).

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/executor.h"
#include "tests/replay/point_scans.h"
#include "tests/replay/real_data.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

std::vector<Points> scans_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".bin") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Points> scans;
  for (const fs::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    Points points;
    std::array<float, 3> p{};
    while (in.read(reinterpret_cast<char*>(p.data()), sizeof p)) {
      points.push_back(Vec3f(p[0], p[1], p[2]));
    }
    scans.push_back(std::move(points));
  }
  return scans;
}

/// Largest extent along an axis.
class Extent {
 public:
  void add(const Vec3& p) {
    low_ = low_.cwiseMin(p);
    high_ = high_.cwiseMax(p);
    ++n_;
  }
  [[nodiscard]] int n() const { return n_; }
  [[nodiscard]] Vec3 peak_to_peak() const { return high_ - low_; }

 private:
  Vec3 low_ = Vec3::Constant(1e9);
  Vec3 high_ = Vec3::Constant(-1e9);
  int n_ = 0;
};

class Poses final : public Receiver {
 public:
  Poses(Bus* bus, std::string_view channel) { bus->subscribe(channel, this); }
  void receive(const std::uint8_t* data, std::size_t size, Stamp /*arrival*/) noexcept override {
    Pose T;
    registration_t r{};
    nav_state_t s{};
    if (r.decode(data, 0, static_cast<int>(size)) > 0) {
      RCS_CHECK(from_message(r.q_target_vehicle, r.p_target_vehicle_m, &T));
    } else {
      RCS_CHECK(s.decode(data, 0, static_cast<int>(size)) > 0);
      RCS_CHECK(from_message(s.q_local_vehicle, s.p_local_vehicle_m, &T));
    }
    extent.add(T.p);
  }
  Extent extent;
};

TEST(Static, AVehicleAtRestStaysWithin1cm) {
  const std::string folder = unpacked("norlab_static_lidar/scans_xyz_bin.tar.xz");
  if (folder.empty()) GTEST_SKIP() << kNoData;
  std::vector<Points> scans = scans_in(folder);
  ASSERT_EQ(scans.size(), 14U);
  const ParamFile file = parsed(R"([ladar]
max_range_m = 80.0
[sp]
source_voxel_m = 0.3
map_voxel_m = 0.1
)");
  const Result<sp::SpConfig> sp_config = sp::load_sp_config(file);
  const Result<wm::WmConfig> wm_config = wm::load_wm_config(file);
  ASSERT_TRUE(sp_config.ok()) << sp_config.error().message;
  ASSERT_TRUE(wm_config.ok()) << wm_config.error().message;
  LocalBus bus;
  sp::SpNode sp_node(*sp_config, PriorTerrain(), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  const Poses registrations(&bus, channel::kSpRegistration);
  const Poses beliefs(&bus, channel::kWmNavState);
  PointScans source(std::move(scans), from_milliseconds(100.0), 16);
  LockstepTimeline timeline(&bus, &source, from_milliseconds(100.0));
  run({&sp_node, &wm_node}, timeline, nullptr);

  const Vec3 sp_cm = 100.0 * registrations.extent.peak_to_peak();
  const Vec3 wm_cm = 100.0 * beliefs.extent.peak_to_peak();
  std::printf("peak to peak: sp %.2f %.2f %.2f cm, wm (local) %.2f %.2f %.2f cm\n", sp_cm.x(),
              sp_cm.y(), sp_cm.z(), wm_cm.x(), wm_cm.y(), wm_cm.z());
  EXPECT_EQ(registrations.extent.n(), 14);
  EXPECT_LT(sp_cm.maxCoeff(), 1.0);
  EXPECT_LT(wm_cm.maxCoeff(), 1.0);
}

}  // namespace
}  // namespace rcs::test
