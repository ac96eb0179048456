// Trunks, twigs and leaves: a real scan of a forest is cut in halves of every other point, one half
// is moved, and must be registered to the other again (monoforce, Ouster, 93,000 points).

#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "modules/registration/cloud_registration.h"
#include "tests/replay/real_data.h"
#include "tests/support/point_scenes.h"

namespace rcs::sp {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> forest_clouds() {
  std::vector<fs::path> clouds;
  const std::string folder = rcs::test::data_path("monoforce_offroad_samples");
  if (folder.empty()) return clouds;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.size() > 10 && name.substr(name.size() - 10) == ".xyzit.bin") {
      clouds.push_back(entry.path());
    }
  }
  return clouds;
}

/// Splits the points alternately into two halves.
std::vector<Points> halves_of(const fs::path& path) {
  constexpr std::size_t kRecord = 20;  // x, y, z, intensity: float; time: uint32
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  std::vector<Points> halves(2);
  for (std::size_t at = 0; at + kRecord <= bytes.size(); at += kRecord) {
    Vec3f p;
    std::memcpy(p.data(), bytes.data() + at, 3 * sizeof(float));
    if (!p.allFinite() || p.norm() < 1.0F) continue;  // the robot itself
    halves[at / kRecord % 2].push_back(p);
  }
  return halves;
}

TEST(Forest, HalfOfAScanIsRegisteredToTheOtherHalf) {
  const std::vector<fs::path> clouds = forest_clouds();
  if (clouds.empty()) GTEST_SKIP() << rcs::test::kNoData;
  for (const fs::path& path : clouds) {
    const std::vector<Points> halves = halves_of(path);
    ASSERT_GT(halves[1].size(), 10'000U);
    std::mt19937 rng(1);
    std::normal_distribution<> normal;
    double worst_m = 0.0;
    double worst_rad = 0.0;
    for (int k = 0; k < 20; ++k) {
      Vec6 motion;
      for (int i = 0; i < 6; ++i) motion[i] = (i < 3 ? 0.5 : 0.05) * normal(rng);
      const Pose T_model_data = exp_se3(motion);
      const Points data = test::moved(T_model_data.inverse(), halves[1]);
      const registration::Registration r =
          registration::register_clouds(halves[0], data, Pose{}, registration::CloudParams{}).best;
      EXPECT_TRUE(registration::usable(r.stop)) << name_of(r.stop);
      const Pose off = T_model_data.inverse() * r.T_target_vehicle;
      worst_m = std::max(worst_m, off.p.norm());
      worst_rad = std::max(worst_rad, log_so3(off.q).norm());
    }
    std::printf("%s: 20 motions of 0.9 m and 5 deg, worst error %.1f mm, %.3f deg\n",
                path.filename().c_str(), 1e3 * worst_m, degrees(worst_rad));
    EXPECT_LT(worst_m, 0.02);
    EXPECT_LT(worst_rad, radians(0.1));
  }
}

}  // namespace
}  // namespace rcs::sp
