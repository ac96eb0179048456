// Poses at the stamps of scans, and what is computed from them.

#include <gmock/gmock.h>

#include <cstring>
#include <filesystem>

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "tests/support/fresh_folder.h"
#include "tools/view/source/placed_scans.h"
#include "tools/view/source/pose_history.h"
#include "tools/view/source/scan_pair.h"

namespace rcs::view {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kUtime = 1'000'000'000;

template <class T>
std::vector<std::uint8_t> encoded(const T& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  (void)message.encode(bytes.data(), 0, message.getEncodedSize());
  return bytes;
}

/// At 2 m/s to the east.
nav_state_t nav(double at_s) {
  nav_state_t m{};
  m.utime = kUtime + static_cast<std::int64_t>(at_s * 1e6);
  m.pose_valid = 1;
  m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
  m.p_world_vehicle_m[0] = 2.0 * at_s;
  return m;
}

void add(const nav_state_t& m, PoseHistory* history) {
  const std::vector<std::uint8_t> bytes = encoded(m);
  history->add_nav_state(bytes.data(), bytes.size());
}

TEST(PoseHistory, InterpolatesBetweenStampsAndHoldsOutside) {
  PoseHistory history(10'000'000);
  EXPECT_FALSE(history.at(kUtime));
  for (const double t : {1.0, 1.1, 1.2}) add(nav(t), &history);
  EXPECT_NEAR(history.at(kUtime + 1'150'000)->p.x(), 2.3, 1e-9);
  EXPECT_NEAR(history.at(kUtime + 1'100'000)->p.x(), 2.2, 1e-9);
  EXPECT_NEAR(history.at(kUtime)->p.x(), 2.0, 1e-9);
  EXPECT_NEAR(history.at(kUtime + 9'000'000)->p.x(), 2.4, 1e-9);
}

TEST(PoseHistory, IsBoundedAndIgnoresInvalidPoses) {
  PoseHistory history(500'000);
  nav_state_t invalid = nav(0.5);
  invalid.pose_valid = 0;
  add(invalid, &history);
  const std::uint8_t noise[] = {1, 2, 3};
  history.add_nav_state(noise, sizeof(noise));
  EXPECT_FALSE(history.at(kUtime));
  for (int i = 0; i < 100; ++i) add(nav(0.1 * i), &history);
  EXPECT_NEAR(history.at(kUtime)->p.x(), 2.0 * 9.4, 1e-6) << "the oldest that is kept";
  add(nav(1.0), &history);  // the clock stepped back
  EXPECT_NEAR(history.at(kUtime + 9'000'000)->p.x(), 2.0, 1e-9);
}

class Scans : public testing::Test {
 protected:
  Scans() : folder_(test::fresh_folder().string()), path_(folder_ + "/run.log") {}
  ~Scans() override { std::filesystem::remove_all(folder_); }

  /// Ten scans, 0.1 s apart, of the same corner of walls in frame world; a vehicle at 2 m/s.
  LogIndex log() {
    Result<LogWriter> writer = LogWriter::create(path_);
    for (int i = 0; i < 100; ++i) {
      const double t = 0.01 * i;
      write(&writer.value(), t, "WM_NAV_STATE", nav(t));
      if (i % 10 == 0) write(&writer.value(), t + 0.001, "SP_POINTS", scan(i / 10, t));
    }
    EXPECT_TRUE(writer->close());
    Result<LogIndex> index = LogIndex::build(path_, [](const LogEvent&, Duration) {});
    EXPECT_TRUE(index);
    return std::move(index).value();
  }
  static points_t scan(int id, double t) {
    points_t m{};
    m.utime = kUtime + static_cast<std::int64_t>(t * 1e6);
    m.scan_id = id;
    m.part_count = 1;
    m.q_rolling_vehicle[0] = 1.0;
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 20; ++j) {
        const float a = 0.2F * static_cast<float>(i);
        const float b = 0.15F * static_cast<float>(j);
        const auto x = static_cast<float>(2.0 * t);
        // The ground, a wall ahead and a wall to the left.
        for (const auto& [px, py, pz] :
             {std::tuple(4.0F + a, b - 1.5F, -1.0F), std::tuple(14.0F, a - 4.0F, b),
              std::tuple(4.0F + a, 6.0F, b)}) {
          m.x_m.push_back(px - x);
          m.y_m.push_back(py);
          m.z_m.push_back(pz);
        }
      }
    }
    m.n = static_cast<std::int32_t>(m.x_m.size());
    return m;
  }
  template <class T>
  static void write(LogWriter* writer, double at_s, const char* channel, const T& message) {
    const std::vector<std::uint8_t> bytes = encoded(message);
    EXPECT_TRUE(writer->write(from_utime(kUtime) + from_seconds(at_s), channel, bytes.data(),
                              bytes.size()));
  }

  std::string folder_;
  std::string path_;
};

TEST_F(Scans, PlacedScansAgreeInFrameWorld) {
  LogIndex index = log();
  const std::string bytes = placed_scans(&index, {}, from_seconds(0.55), from_seconds(0.32));
  int parts = 0;
  for (std::size_t at = 0; at + 16 <= bytes.size(); ++parts) {
    double stamp = 0.0;
    std::uint32_t n = 0;
    std::memcpy(&stamp, bytes.data() + at, 8);
    std::memcpy(&n, bytes.data() + at + 8, 4);
    EXPECT_NEAR(stamp, 1000.3 + 0.1 * parts, 1e-6);
    ASSERT_EQ(n, 1200U) << "every second point";
    float first[3] = {};
    std::memcpy(first, bytes.data() + at + 16, sizeof(first));
    EXPECT_NEAR(first[0], 4.0F, 1e-3F) << "the same place in each scan";
    at += 16 + std::size_t{12} * n;
  }
  EXPECT_EQ(parts, 3);
}

TEST_F(Scans, APairIsRegisteredAndItsDistancesAreThoseOfItsPoints) {
  LogIndex index = log();
  const Result<nlohmann::ordered_json> pair = scan_pair(&index, {from_seconds(0.95), 4, false});
  ASSERT_TRUE(pair) << pair.error().message;
  const nlohmann::ordered_json& json = *pair;
  EXPECT_EQ(json["data"]["scan_id"], 9);
  EXPECT_EQ(json["model"]["scan_id"], 5);
  EXPECT_NEAR(json["T_model_data"][3].get<double>(), 0.8, 0.02) << "0.4 s at 2 m/s";
  EXPECT_LT(json["after"]["mean_m"].get<double>(), 0.3 * json["before"]["mean_m"].get<double>());
  double sum = 0.0;
  for (const auto& d : json["after"]["distance_m"]) sum += d.get<double>();
  EXPECT_NEAR(sum / static_cast<double>(json["after"]["distance_m"].size()),
              json["after"]["mean_m"].get<double>(), 1e-6);
  const Result<nlohmann::ordered_json> guessed = scan_pair(&index, {from_seconds(0.95), 4, true});
  ASSERT_TRUE(guessed);
  EXPECT_NEAR((*guessed)["guess"][3].get<double>(), 0.8, 1e-6);
}

TEST_F(Scans, APairNeedsTwoScans) {
  LogIndex index = log();
  const Result<nlohmann::ordered_json> pair = scan_pair(&index, {from_seconds(0.05), 1, false});
  ASSERT_FALSE(pair);
  EXPECT_THAT(pair.error().message, HasSubstr("two are needed"));
}

}  // namespace
}  // namespace rcs::view
