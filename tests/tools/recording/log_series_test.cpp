// The segments of a recording as one log.

#include "tools/recording/log_series.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "tests/support/fresh_folder.h"

namespace rcs::recording {
namespace {

namespace fs = std::filesystem;

constexpr int kPerSegment = 10;

/// @return path of a log with events 10 k to 10 k + 9
fs::path segment(const fs::path& folder, int k) {
  fs::path path = folder / ("rcs-0000000" + std::to_string(k) + "-20261126T183404Z.log");
  Result<LogWriter> writer = LogWriter::create(path.string());
  for (int i = 0; i < kPerSegment; ++i) {
    const auto byte = static_cast<std::uint8_t>(kPerSegment * k + i);
    EXPECT_TRUE(writer->write(from_utime(byte), "INS", &byte, 1).ok());
  }
  EXPECT_TRUE(writer->close().ok());
  return path;
}

std::vector<int> payloads(const std::string& path, LogHealth* health = nullptr) {
  Result<LogSeries> log = LogSeries::open(path);
  EXPECT_TRUE(log.ok()) << log.error().message;
  std::vector<int> values;
  LogEvent event;
  while (log->next(&event)) values.push_back(event.data[0]);
  EXPECT_FALSE(log->next(&event));
  EXPECT_EQ(log->position_bytes(), log->size_bytes());
  if (health != nullptr) *health = log->health();
  return values;
}

std::vector<int> numbers(int from, int to) {
  std::vector<int> values;
  for (int k = from; k < to; ++k) values.push_back(k);
  return values;
}

TEST(LogSeries, SegmentsAreReadInTheirOrderAndOtherFilesAreNot) {
  const fs::path folder = test::fresh_folder();
  for (const int k : {3, 1, 2}) (void)segment(folder, k);
  fs::copy(folder / "rcs-00000001-20261126T183404Z.log", folder / "part.log");
  std::ofstream(folder / "audit-00000001-20261126T183404Z.jsonl") << "{}\n";
  LogHealth health;
  EXPECT_EQ(payloads(folder.string(), &health), numbers(10, 40));
  EXPECT_EQ(health.events, 30);
  EXPECT_TRUE(health.good());
  EXPECT_EQ(payloads((folder / "part.log").string()), numbers(10, 20));
}

TEST(LogSeries, ASegmentThatEndsInsideAnEventLosesThatEventOnly) {
  const fs::path folder = test::fresh_folder();
  (void)segment(folder, 1);
  const fs::path torn = segment(folder, 2);
  (void)segment(folder, 3);
  const std::uintmax_t event_bytes = fs::file_size(torn) / kPerSegment;
  for (std::uintmax_t cut = 1; cut < event_bytes; ++cut) {
    fs::resize_file(torn, event_bytes * kPerSegment - cut);
    LogHealth health;
    std::vector<int> expected = numbers(10, 29);
    for (const int k : numbers(30, 40)) expected.push_back(k);
    EXPECT_EQ(payloads(folder.string(), &health), expected) << cut;
    EXPECT_TRUE(health.truncated);
    EXPECT_EQ(health.skips, 1);
    EXPECT_TRUE(health.io_error.empty());
    (void)segment(folder, 2);
  }
}

TEST(LogSeries, ASegmentThatARunningRecorderDeletesIsPassedOver) {
  const fs::path folder = test::fresh_folder();
  (void)segment(folder, 1);
  const fs::path second = segment(folder, 2);
  (void)segment(folder, 3);
  Result<LogSeries> log = LogSeries::open(folder.string());
  ASSERT_TRUE(log.ok());
  fs::remove(second);
  int events = 0;
  LogEvent event;
  while (log->next(&event)) ++events;
  EXPECT_EQ(events, 20);
  EXPECT_TRUE(log->health().good());
}

TEST(LogSeries, AFolderWithoutSegmentsIsNamed) {
  const fs::path folder = test::fresh_folder();
  const Result<LogSeries> log = LogSeries::open(folder.string());
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().message,
            folder.string() + ": no segment of a recording (rcs-*.log) in this folder");
  std::ofstream(folder / "rcs-00000001-x.log") << "no log, but read as a damaged one";
  LogHealth health;
  EXPECT_TRUE(payloads(folder.string(), &health).empty());
  EXPECT_FALSE(health.good());
  EXPECT_FALSE(LogSeries::open("/nowhere/run.log").ok());
}

}  // namespace
}  // namespace rcs::recording
