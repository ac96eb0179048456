#include "rcs/node/log/log_source.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "rcs/node/executor.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::encode;
using test::ms;
using test::odometry;

std::string temp_path(const std::string& name) {
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  return testing::TempDir() + info->name() + "_" + name;
}

std::string read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

struct Written {
  std::int64_t at_ms;
  const char* channel;
};

std::string log_of(const std::vector<Written>& events) {
  std::string path = temp_path("in.lcm");
  auto writer = LogWriter::create(path);
  std::int64_t seq = 0;
  for (const Written& e : events) {
    const std::vector<std::uint8_t> bytes = encode(odometry(++seq, 1000 * e.at_ms));
    EXPECT_TRUE(writer->write(at_ms(e.at_ms), e.channel, bytes.data(), bytes.size()).ok());
  }
  EXPECT_TRUE(writer->close().ok());
  return path;
}

std::vector<std::int64_t> dues_ms(LogSource* source) {
  std::vector<std::int64_t> dues;
  SourceEvent event;
  while (source->peek() != Stamp::max()) {
    dues.push_back(to_utime(source->peek()) / 1000);
    source->take(&event);
  }
  return dues;
}

TEST(LogSource, FeedsTheChosenChannelsOnly) {
  auto reader = LogReader::open(log_of({{10, "ODOMETRY"}, {11, "WM_NAV_STATE"}, {12, "INS"}}));
  LogSource source(&*reader, {"ODOMETRY", "INS"});
  EXPECT_EQ(dues_ms(&source), (std::vector<std::int64_t>{10, 12}));
  EXPECT_EQ(source.fed(), 2);
  EXPECT_EQ(source.passed_over(), 1);
}

TEST(LogSource, JumpsOfTheLogClockAreRemoved) {
  // One wild stamp (a day ahead), then a clock that was set back by 1 h; small steps are kept.
  auto reader = LogReader::open(log_of({{10'000'000, "A"},
                                        {10'000'020, "A"},
                                        {96'400'000, "A"},
                                        {10'000'040, "A"},
                                        {10'000'035, "A"},
                                        {6'400'000, "A"},
                                        {6'400'020, "A"}}));
  LogSource source(&*reader, {"A"});
  EXPECT_EQ(dues_ms(&source),
            (std::vector<std::int64_t>{10'000'000, 10'000'020, 10'000'020, 10'000'020, 10'000'015,
                                       10'000'015, 10'000'035}));
  EXPECT_EQ(source.clock_jumps(), 3);
}

/// Replays the log through two nodes, once.
std::string replay(const std::string& log, const std::string& out) {
  auto reader = LogReader::open(log);
  LogSource source(&*reader, {"ODOMETRY", "SIM_TRUTH"});
  auto writer = LogWriter::create(out);
  LogRecorder recorder(&*writer, {"ODOMETRY"});
  LocalBus bus;
  bus.set_tap(&recorder);
  test::Echo first({"first", ms(50), ms(30)}, &bus, "ODOMETRY", "MIDDLE");
  test::Echo second({"second", ms(50), ms(2)}, &bus, "MIDDLE", "END");
  LockstepTimeline timeline(&bus, &source, ms(100));
  run({&first, &second}, timeline, nullptr);
  EXPECT_TRUE(writer->close().ok());
  return read_file(out);
}

TEST(LogSource, TheSameLogGivesTheSameBytes) {
  std::vector<Written> events;
  events.reserve(200);
  for (std::int64_t i = 0; i < 200; ++i) {
    events.push_back({7 * i, i % 5 == 0 ? "SIM_TRUTH" : "ODOMETRY"});
  }
  const std::string log = log_of(events);
  const std::string once = replay(log, temp_path("a.lcm"));
  EXPECT_EQ(once, replay(log, temp_path("b.lcm")));
  EXPECT_FALSE(once.empty());
}

TEST(LogSource, AReplayLogHoldsOutputsAtTheirDueTimesInOrder) {
  const std::string out = temp_path("out.lcm");
  replay(log_of({{0, "ODOMETRY"}, {10, "SIM_TRUTH"}, {100, "ODOMETRY"}}), out);
  auto reader = LogReader::open(out);
  std::vector<std::pair<std::string, std::int64_t>> events;
  LogEvent event;
  while (reader->next(&event)) events.emplace_back(event.channel, to_utime(event.stamp) / 1000);
  const std::vector<std::pair<std::string, std::int64_t>> expected{
      {"SIM_TRUTH", 10}, {"MIDDLE", 30}, {"END", 32}, {"MIDDLE", 130}, {"END", 132}};
  EXPECT_EQ(events, expected);
}

}  // namespace
}  // namespace rcs
