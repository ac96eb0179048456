// A log as the viewer sees it: index, time, state at a moment, timeline.

#include <gmock/gmock.h>

#include <filesystem>
#include <limits>

#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "tests/support/fresh_folder.h"
#include "tools/view/run_timeline.h"
#include "tools/view/source/log_index.h"
#include "tools/view/source/play_clock.h"
#include "tools/view/value_series.h"

namespace rcs::view {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

template <class T>
std::vector<std::uint8_t> encoded(const T& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  (void)message.encode(bytes.data(), 0, message.getEncodedSize());
  return bytes;
}

/// The type is that of the channel only where a test decodes it.
std::vector<std::uint8_t> any_bytes(int value) {
  return {static_cast<std::uint8_t>(value), 1, 2, 3};
}

class LogView : public testing::Test {
 protected:
  LogView() : folder_(test::fresh_folder().string()), path_(folder_ + "/run.log") {}
  ~LogView() override { std::filesystem::remove_all(folder_); }

  struct Event {
    double at_s;
    const char* channel;
  };
  void write(const std::vector<Event>& events) {
    Result<LogWriter> writer = LogWriter::create(path_);
    int number = 0;
    for (const Event& e : events) {
      const std::vector<std::uint8_t> bytes = any_bytes(number++);
      ASSERT_TRUE(
          writer->write(kBegin + from_seconds(e.at_s), e.channel, bytes.data(), bytes.size()));
    }
    ASSERT_TRUE(writer->close());
  }
  Result<LogIndex> index() {
    return LogIndex::build(path_, [](const LogEvent&, Duration) {});
  }

  static constexpr Stamp kBegin = from_utime(1'700'000'000'000'000);
  std::string folder_;
  std::string path_;
};

TEST_F(LogView, IndexReadsEveryEventAgain) {
  write({{0.0, "INS"}, {0.5, "GPS_FIX"}, {1.0, "OTHER"}, {2.0, "INS"}});
  Result<LogIndex> index = this->index();
  ASSERT_TRUE(index) << index.error().message;
  ASSERT_EQ(index->size(), 3U);
  EXPECT_EQ(index->foreign(), 1);
  EXPECT_EQ(index->duration(), from_seconds(2.0));
  EXPECT_EQ(index->channels(), channels_of("INS, GPS_FIX"));
  LogEvent event;
  for (const auto& [i, channel, value] :
       {std::tuple(2, "INS", 3), std::tuple(0, "INS", 0), std::tuple(1, "GPS_FIX", 1)}) {
    ASSERT_TRUE(index->read(static_cast<std::size_t>(i), &event));
    EXPECT_EQ(event.channel, channel);
    EXPECT_EQ(event.data.front(), value);
  }
}

TEST_F(LogView, TimeNeitherStepsBackNorJumpsAhead) {
  write({{0.0, "INS"},
         {1.0, "INS"},
         {0.9, "INS"},
         {2.0, "INS"},
         {-500.0, "INS"},
         {-499.0, "INS"},
         {1e6, "INS"},
         {1e6 + 1.0, "INS"}});
  Result<LogIndex> index = this->index();
  ASSERT_TRUE(index);
  std::vector<double> times;
  for (std::size_t i = 0; i < index->size(); ++i) times.push_back(seconds(index->time(i)));
  EXPECT_THAT(times, ElementsAre(0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0));
}

TEST_F(LogView, StateHasTheNewestOfEachChannelAndScansInParts) {
  write({{0.0, "BG_STATUS"},
         {0.1, "SP_POINTS"},
         {1.8, "SP_POINTS"},
         {1.9, "SP_POINTS"},
         {2.0, "BG_STATUS"},
         {2.1, "BG_PLAN"},
         {3.0, "BG_STATUS"}});
  Result<LogIndex> index = this->index();
  ASSERT_TRUE(index);
  const ChannelSet all = ~ChannelSet{0};
  EXPECT_THAT(index->state_at(from_seconds(2.5), all), ElementsAre(2, 3, 4, 5));
  EXPECT_THAT(index->state_at(from_seconds(2.5), channels_of("BG_STATUS")), ElementsAre(4));
  EXPECT_THAT(index->state_at(from_seconds(0.05), all), ElementsAre(0));
  EXPECT_THAT(index->recent(from_seconds(2.5), from_seconds(0.65), all), ElementsAre(3, 4, 5));
  EXPECT_EQ(index->first_after(from_seconds(2.0)), 5U);
  EXPECT_EQ(index->first_after(from_seconds(99.0)), index->size());
}

TEST_F(LogView, DamageIsReportedAndAnEmptyLogIsAnError) {
  write({{0.0, "INS"}, {1.0, "INS"}});
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 2);
  Result<LogIndex> index = this->index();
  ASSERT_TRUE(index);
  EXPECT_EQ(index->size(), 1U);
  EXPECT_THAT(index->damage(), HasSubstr("truncated"));
  write({{0.0, "OTHER"}});
  index = this->index();
  ASSERT_FALSE(index);
  EXPECT_THAT(index.error().message, HasSubstr(path_));
}

TEST(PlayClock, PlaysAtItsSpeedAndPausesAtTheEnd) {
  PlayClock clock(from_seconds(10.0));
  clock.advance(from_seconds(1.0));
  EXPECT_EQ(clock.time(), Duration{}) << "paused";
  EXPECT_FALSE(clock.play());
  clock.set_speed(2.0);
  clock.advance(from_seconds(1.5));
  EXPECT_EQ(clock.time(), from_seconds(3.0));
  clock.advance(from_seconds(-5.0));
  EXPECT_EQ(clock.time(), from_seconds(3.0));
  clock.seek(from_seconds(9.5));
  clock.advance(from_seconds(1.0));
  EXPECT_EQ(clock.time(), from_seconds(10.0));
  EXPECT_FALSE(clock.playing());
  EXPECT_TRUE(clock.play()) << "from the begin";
  EXPECT_EQ(clock.time(), Duration{});
}

TEST(PlayClock, IsBounded) {
  PlayClock clock(from_seconds(10.0));
  clock.seek(from_seconds(-1.0));
  EXPECT_EQ(clock.time(), Duration{});
  clock.seek(kMaxDuration);
  EXPECT_EQ(clock.time(), from_seconds(10.0));
  clock.set_speed(1e9);
  EXPECT_EQ(clock.speed(), PlayClock::kMaxSpeed);
  clock.set_speed(-1.0);
  EXPECT_EQ(clock.speed(), PlayClock::kMinSpeed);
  clock.set_speed(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(clock.speed(), PlayClock::kMinSpeed);
}

TEST(ValueSeries, KeepsTheLargestValueOfEachIntervalWithBoundedMemory) {
  ValueSeries series;
  double largest = 0.0;
  for (int i = 0; i < 1'000'000; ++i) {
    const double value = std::sin(0.37 * i) + (i == 777'777 ? 100.0 : 0.0);
    largest = std::max(largest, value);
    series.add(from_seconds(0.01 * i), value);
    ASSERT_LE(series.entries().size(), ValueSeries::kMaxIntervals + 1);
  }
  EXPECT_GT(series.halvings(), 1);
  double kept = 0.0;
  double last = -1.0;
  for (const ValueSeries::Entry& e : series.entries()) {
    kept = std::max(kept, e.value);
    EXPECT_GT(e.time_s, last);
    last = e.time_s;
  }
  EXPECT_EQ(kept, largest);
  series.add(from_seconds(2e4), std::numeric_limits<double>::quiet_NaN());
  EXPECT_LT(series.entries().back().time_s, 1.1e4);
}

TEST(ValueSeries, KeepsTheSmallestValueOfWhatIsBadWhereItIsLow) {
  ValueSeries series(ValueSeries::Keep::kSmallest);
  for (int i = 0; i < 100'000; ++i) {
    series.add(from_seconds(0.1 * i), i == 54'321 ? 0.05 : 0.6 + 0.1 * std::sin(0.37 * i));
  }
  EXPECT_GT(series.halvings(), 1);
  double smallest = 1.0;
  for (const ValueSeries::Entry& e : series.entries()) smallest = std::min(smallest, e.value);
  EXPECT_EQ(smallest, 0.05);
}

class Timeline : public testing::Test {
 protected:
  template <class T>
  void add(const char* channel, const T& message, double at_s) {
    const std::vector<std::uint8_t> bytes = encoded(message);
    timeline_.add(channel, bytes.data(), bytes.size(), from_seconds(at_s));
  }
  static nav_state_t nav(double at_s, double east_m, int mode = nav_state_t::MODE_GPS_INS_LADAR) {
    nav_state_t m{};
    m.utime = static_cast<std::int64_t>(at_s * 1e6) + 1'000'000;
    m.mode = static_cast<std::int8_t>(mode);
    m.pose_valid = m.world_valid = 1;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
    m.p_world_vehicle_m[0] = east_m;
    m.cov_world_pose[0][0] = 0.04;
    m.cov_world_pose[1][1] = 0.01;
    m.datum_lat_deg = 39.0;
    m.datum_lon_deg = -77.0;
    return m;
  }
  static truth_t truth(double at_s, double east_m) {
    truth_t m{};
    m.utime = static_cast<std::int64_t>(at_s * 1e6) + 1'000'000;
    m.q_world_vehicle[0] = 1.0;
    m.p_world_vehicle_m[0] = east_m;
    m.datum_lat_deg = 39.0;
    m.datum_lon_deg = -77.0;
    return m;
  }

  RunTimeline timeline_;
};

TEST_F(Timeline, ErrorIsAgainstTheTruthAtTheStampOfTheBelief) {
  add("SIM_TRUTH", truth(0.0, 0.0), 0.0);
  add("WM_NAV_STATE", nav(0.05, 0.35), 0.05);  // the truth there is 0.05
  add("SIM_TRUTH", truth(0.1, 0.1), 0.1);
  const auto json = timeline_.json(Duration{-1});
  const auto& error = json["series"]["error_horizontal_m"];
  ASSERT_EQ(error["v"].size(), 1U);
  EXPECT_NEAR(error["v"][0].get<double>(), 0.30, 1e-3);
  EXPECT_NEAR(json["series"]["sigma3_horizontal_m"]["v"][0].get<double>(), 0.6, 1e-3);
}

TEST_F(Timeline, LanesHaveTheChangesOnly) {
  for (int i = 0; i < 10; ++i) {
    add("WM_NAV_STATE",
        nav(0.1 * i, 0.0, i < 5 ? nav_state_t::MODE_ALIGN : nav_state_t::MODE_INS_DR), 0.1 * i);
  }
  const auto json = timeline_.json(Duration{-1});
  ASSERT_EQ(json["lanes"]["mode"].size(), 2U);
  EXPECT_EQ(json["lanes"]["mode"][1][0], 0.5);
  EXPECT_EQ(json["lanes"]["mode"][1][1], "INS_DR");
}

TEST_F(Timeline, TheMissionHasItsOwnLane) {
  status_t bg{};
  bg.state = "DRIVING_NO_GPS";
  status_t mission{};
  mission.state = "DRIVING";
  for (int i = 0; i < 5; ++i) {
    add("BG_STATUS", bg, i);
    add("MISSION_STATUS", mission, i + 0.5);
  }
  const auto lanes = timeline_.json(Duration{-1})["lanes"];
  ASSERT_EQ(lanes["bg"].size(), 1U);
  EXPECT_EQ(lanes["bg"][0][1], "DRIVING_NO_GPS");
  ASSERT_EQ(lanes["mission"].size(), 1U);
  EXPECT_EQ(lanes["mission"][0][1], "DRIVING");
}

TEST_F(Timeline, TheLowestOverlapIsKept) {
  registration_t m{};
  m.target = registration_t::TARGET_ROLLING;
  for (const double overlap : {0.7, 0.1, 0.6}) {
    m.overlap = overlap;
    m.observability[0] = 0.01 * overlap;
    m.mean_distance_m = overlap;
    add("SP_REGISTRATION", m, 0.05);
  }
  const auto series = timeline_.json(Duration{-1})["series"];
  EXPECT_EQ(series["overlap"]["v"][0], 0.1);
  EXPECT_EQ(series["observability"]["v"][0], 0.001);
  EXPECT_EQ(series["mean_distance_m"]["v"][0], 0.7);
}

TEST_F(Timeline, FixesHaveTheVerdictOfWm) {
  add("WM_NAV_STATE", nav(0.0, 0.0), 0.0);
  gps_fix_t fix{};
  fix.utime = 5;
  fix.lat_deg = 39.0;
  fix.lon_deg = -77.0;
  fix.fix_type = gps_fix_t::FIX_FIXED;
  add("GPS_FIX", fix, 1.0);
  innovation_t innovation{};
  innovation.utime = 5;
  innovation.source = innovation_t::SOURCE_GPS_POSITION;
  innovation.reason = innovation_t::REASON_GATE;
  innovation.nis = 31.2;
  add("WM_INNOVATION", innovation, 1.01);
  const auto json = timeline_.json(Duration{-1});
  ASSERT_EQ(json["fixes"].size(), 1U);
  EXPECT_EQ(json["fixes"][0]["verdict"], 0);
  EXPECT_EQ(json["fixes"][0]["reason"], "gate");
  EXPECT_EQ(json["fixes"][0]["type"], "RTK_FIXED");
}

TEST_F(Timeline, GrowsBySince) {
  for (int i = 0; i < 100; ++i) add("WM_NAV_STATE", nav(0.1 * i, i), 0.1 * i);
  event_t event{};
  event.node = "wm";
  event.code = "mode";
  add("WM_EVENT", event, 9.95);
  const auto whole = timeline_.json(Duration{-1});
  const auto part = timeline_.json(from_seconds(9.5));
  EXPECT_EQ(whole["series"]["speed_mps"]["t"].size(), 100U);
  EXPECT_EQ(part["series"]["speed_mps"]["t"].size(), 4U);
  EXPECT_EQ(part["events"].size(), 1U);
  EXPECT_LT(part["track"].size(), 5U);
  EXPECT_EQ(part["generation"], whole["generation"]);
}

TEST_F(Timeline, MalformedMessagesAndForeignChannelsAreIgnored) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3};
  timeline_.add("WM_NAV_STATE", bytes.data(), bytes.size(), Duration{});
  timeline_.add("OTHER", bytes.data(), bytes.size(), Duration{});
  nav_state_t m = nav(0.0, 0.0);
  m.q_world_vehicle[0] = std::numeric_limits<double>::quiet_NaN();
  add("WM_NAV_STATE", m, 0.0);
  EXPECT_TRUE(timeline_.json(Duration{-1})["track"].empty());
}

}  // namespace
}  // namespace rcs::view
