// The estimated pose of a vehicle at rest must not move: 14 real scans (norlab_static_lidar).

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tests/replay/real_data.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

/// One facet of 1/16 of a scan's points after the other, scan after scan.
class Scans final : public EventSource {
 public:
  explicit Scans(const fs::path& folder) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (entry.path().extension() == ".bin") files_.push_back(entry.path());
    }
    std::sort(files_.begin(), files_.end());
  }
  [[nodiscard]] std::size_t size() const { return files_.size(); }

  Stamp peek() override {
    if (scan_ == files_.size()) return Stamp::max();
    return Stamp() + static_cast<int>(scan_) * from_milliseconds(100.0) +
           (facet_ + 1) * from_milliseconds(6.0);
  }

  void take(SourceEvent* event) override {
    if (facet_ == 0) load();
    const std::size_t begin = points_.size() / 3 * static_cast<std::size_t>(facet_) / kFacets;
    const std::size_t end = points_.size() / 3 * static_cast<std::size_t>(facet_ + 1) / kFacets;
    ladar_points_t m{};
    m.utime = to_utime(Stamp() + static_cast<int>(scan_) * from_milliseconds(100.0));
    m.reference_utime = m.utime;
    m.seq = ++seq_;
    m.scan_id = static_cast<std::int64_t>(scan_);
    m.facet = static_cast<std::int16_t>(facet_);
    m.facet_count = kFacets;
    for (std::size_t i = begin; i < end; ++i) {
      m.x_m.push_back(points_[3 * i]);
      m.y_m.push_back(points_[3 * i + 1]);
      m.z_m.push_back(points_[3 * i + 2]);
    }
    m.n = static_cast<std::int32_t>(m.x_m.size());
    event->channel = channel::kLadarPoints;
    event->data.resize(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(event->data.data(), 0, m.getEncodedSize());
    if (++facet_ == kFacets) {
      facet_ = 0;
      ++scan_;
    }
  }

 private:
  static constexpr int kFacets = 16;

  void load() {
    std::ifstream in(files_[scan_], std::ios::binary | std::ios::ate);
    points_.resize(static_cast<std::size_t>(in.tellg()) / sizeof(float));
    in.seekg(0);
    in.read(reinterpret_cast<char*>(points_.data()),
            static_cast<std::streamsize>(points_.size() * sizeof(float)));
  }

  std::vector<fs::path> files_;
  std::vector<float> points_;
  std::size_t scan_ = 0;
  int facet_ = 0;
  std::int64_t seq_ = 0;
};

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
  Scans scans(folder);
  ASSERT_EQ(scans.size(), 14U);
  const Result<ParamFile> file = ParamFile::parse(R"([ladar]
max_range_m = 80.0
[sp]
source_voxel_m = 0.3
map_voxel_m = 0.1
)",
                                                  "static");
  ASSERT_TRUE(file.ok());
  const Result<sp::SpConfig> sp_config = sp::load_sp_config(*file);
  const Result<wm::WmConfig> wm_config = wm::load_wm_config(*file);
  ASSERT_TRUE(sp_config.ok()) << sp_config.error().message;
  ASSERT_TRUE(wm_config.ok()) << wm_config.error().message;
  LocalBus bus;
  sp::SpNode sp_node(*sp_config, PriorTerrain(), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  const Poses registrations(&bus, channel::kSpRegistration);
  const Poses beliefs(&bus, channel::kWmNavState);
  LockstepTimeline timeline(&bus, &scans, from_milliseconds(100.0));
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
