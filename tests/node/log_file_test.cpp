#include "rcs/node/log/log_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <set>

namespace rcs {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kHeader = 28;

std::string temp_path(const std::string& name) {
  // One file for each test: the tests run in parallel.
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  return testing::TempDir() + info->name() + "_" + name;
}

Bytes read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write_file(const std::string& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

Bytes payload(int i) { return Bytes(static_cast<std::size_t>(10 + i % 50), std::uint8_t(i)); }

/// Events 0 .. n-1 on channel CH<i % 3>, at 1000 * i us.
std::string good_log(int n) {
  std::string path = temp_path("good.lcm");
  auto writer = LogWriter::create(path);
  for (int i = 0; i < n; ++i) {
    const Bytes data = payload(i);
    EXPECT_TRUE(writer
                    ->write(from_utime(std::int64_t{1000} * i), "CH" + std::to_string(i % 3),
                            data.data(), data.size())
                    .ok());
  }
  EXPECT_TRUE(writer->close().ok());
  return path;
}

struct Read {
  std::vector<LogEvent> events;
  LogHealth health;
};

Read read_log(const Bytes& bytes) {
  const std::string path = temp_path("read.lcm");
  write_file(path, bytes);
  auto reader = LogReader::open(path);
  Read read;
  LogEvent event;
  while (reader->next(&event)) read.events.push_back(event);
  read.health = reader->health();
  return read;
}

std::size_t event_offset(int i) {
  std::size_t offset = 0;
  for (int k = 0; k < i; ++k) offset += kHeader + 3 + payload(k).size();
  return offset;
}

TEST(LogFile, WrittenEventsAreRead) {
  const Read read = read_log(read_file(good_log(1000)));
  ASSERT_EQ(read.events.size(), 1000U);
  for (int i = 0; i < 1000; ++i) {
    const LogEvent& e = read.events[static_cast<std::size_t>(i)];
    EXPECT_EQ(e.number, i);
    EXPECT_EQ(to_utime(e.stamp), 1000 * i);
    EXPECT_EQ(e.channel, "CH" + std::to_string(i % 3));
    EXPECT_EQ(e.data, payload(i));
  }
  EXPECT_TRUE(read.health.good());
  EXPECT_EQ(read.health.summary(), "1000 events");
}

TEST(LogFile, AnEventThatIsRecordableIsRead) {
  const Bytes data(50, 3);
  const std::string longest(LogReader::kMaxChannelBytes, 'A');
  Bytes bytes;
  int expected = 0;
  for (const std::string& channel :
       {std::string("INS"), longest, longest + "A", std::string(), std::string("A B"),
        std::string("A\x01"), std::string("\xC3\xA4")}) {
    const bool recordable = is_recordable(channel, data.size());
    EXPECT_EQ(recordable, channel == "INS" || channel == longest) << channel;
    if (!recordable) continue;
    append_event(++expected, from_utime(7), channel, data.data(), data.size(), &bytes);
    append_event(++expected, from_utime(8), channel, nullptr, 0, &bytes);
  }
  EXPECT_FALSE(is_recordable("INS", LogReader::kDefaultMaxDataBytes + 1));
  const Read read = read_log(bytes);
  EXPECT_TRUE(read.health.good());
  ASSERT_EQ(read.events.size(), static_cast<std::size_t>(expected));
  EXPECT_EQ(read.events[2].channel, longest);
  EXPECT_EQ(read.events[3].number, 4);
}

TEST(LogFile, ALogOfAnEarlierMessageRevisionIsRejected) {
  const std::string path = temp_path("former.lcm");
  Result<LogWriter> writer = LogWriter::create(path);
  ASSERT_TRUE(writer);
  const std::uint8_t other[16] = {1, 2, 3};
  // The fingerprint of ins_t without run and publisher ids.
  const std::uint8_t ins[16] = {0x71, 0x75, 0x4f, 0x31, 0xa5, 0xa8, 0xfd, 0xb7};
  ASSERT_TRUE(writer->write(from_utime(1), "OTHER", other, sizeof(other)));
  ASSERT_TRUE(writer->write(from_utime(2), "INS", ins, sizeof(ins)));
  ASSERT_TRUE(writer->close());
  const Result<LogReader> reader = LogReader::open(path);
  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().message.find("former revision of the messages (INS)"), std::string::npos)
      << reader.error().message;
}

TEST(LogFile, TheBytesAreThoseOfLcm) {
  const Bytes expected{0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0,  0,   0,
                       0,    0,    0,    0,    0, 0, 0, 0, 2, 0, 0, 0, 10, 'C', 'H'};
  Bytes head = read_file(good_log(1));
  ASSERT_EQ(head.size(), kHeader + 3 + 10);
  head.resize(30);
  Bytes with_length = expected;
  with_length[23] = 3;  // "CH0"
  EXPECT_EQ(head, with_length);
}

TEST(LogFile, TheSameEventsGiveTheSameBytes) {
  const Bytes once = read_file(good_log(100));
  EXPECT_EQ(once, read_file(good_log(100)));
}

TEST(LogFile, RewindReadsTheSameAgain) {
  auto reader = LogReader::open(good_log(10));
  ASSERT_TRUE(reader.ok());
  LogEvent event;
  while (reader->next(&event)) {
  }
  EXPECT_EQ(reader->position_bytes(), reader->size_bytes());
  reader->rewind();
  ASSERT_TRUE(reader->next(&event));
  EXPECT_EQ(event.number, 0);
  EXPECT_EQ(reader->health().events, 1);
}

TEST(LogFile, AnEventLargerThanTheWindowIsRead) {
  const std::string path = temp_path("large.lcm");
  auto writer = LogWriter::create(path);
  const Bytes large(3'000'000, 7);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(writer->write(from_utime(i), "BIG", large.data(), large.size()).ok());
  }
  ASSERT_TRUE(writer->close().ok());
  const Read read = read_log(read_file(path));
  ASSERT_EQ(read.events.size(), 3U);
  EXPECT_EQ(read.events[2].data, large);
}

TEST(LogFile, ATruncatedLogYieldsItsWholeEventsAndIsReported) {
  const Bytes good = read_file(good_log(20));
  for (std::size_t cut = event_offset(19) + 1; cut < good.size(); ++cut) {
    const Read read = read_log(Bytes(good.begin(), good.begin() + static_cast<long>(cut)));
    ASSERT_EQ(read.events.size(), 19U) << cut;
    EXPECT_TRUE(read.health.truncated) << cut;
    EXPECT_EQ(read.health.skipped_bytes, static_cast<std::int64_t>(cut - event_offset(19)));
    EXPECT_NE(read.health.summary().find("truncated"), std::string::npos);
  }
}

TEST(LogFile, DamageLosesTheDamagedEventOnly) {
  // GIVEN a valid log  WHEN one byte of a header is damaged  THEN all other events are read
  const Bytes good = read_file(good_log(40));
  for (std::size_t byte = 0; byte < kHeader; ++byte) {
    if (byte >= 4 && byte < 20) continue;  // number and time: not detected, nothing is lost
    Bytes bad = good;
    bad[event_offset(17) + byte] ^= 0x15;
    const Read read = read_log(bad);
    std::set<std::int64_t> numbers;
    for (const LogEvent& e : read.events) numbers.insert(e.number);
    for (int i = 0; i < 40; ++i) {
      if (i == 17) continue;
      EXPECT_EQ(numbers.count(i), 1U) << "event " << i << ", byte " << byte;
    }
    EXPECT_FALSE(read.health.good()) << byte;
    EXPECT_FALSE(read.health.truncated) << byte;
  }
}

TEST(LogFile, ForeignBytesBetweenEventsAreSkippedAndCounted) {
  Bytes bytes = read_file(good_log(10));
  const Bytes junk(1000, 0xED);
  bytes.insert(bytes.begin() + static_cast<long>(event_offset(5)), junk.begin(), junk.end());
  const Read read = read_log(bytes);
  EXPECT_EQ(read.events.size(), 10U);
  EXPECT_EQ(read.health.skipped_bytes, 1000);
  EXPECT_EQ(read.health.skips, 1);
  EXPECT_EQ(read.health.summary(), "10 events; skipped 1000 unreadable bytes in 1 place");
}

TEST(LogFile, ASyncWordInsideDataIsData) {
  const std::string path = temp_path("nested.lcm");
  const Bytes inner = read_file(good_log(3));
  auto writer = LogWriter::create(path);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(writer->write(from_utime(i), "LOG", inner.data(), inner.size()).ok());
  }
  ASSERT_TRUE(writer->close().ok());
  const Read read = read_log(read_file(path));
  ASSERT_EQ(read.events.size(), 3U);
  EXPECT_EQ(read.events[1].data, inner);
  EXPECT_TRUE(read.health.good());
}

TEST(LogFile, HostileHeadersAreRejected) {
  const Bytes good = read_file(good_log(3));
  struct Field {
    std::size_t at;
    Bytes bytes;
  };
  const std::vector<Field> fields{
      {12, {0x7f, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff}},  // the maximum time
      {12, {0x80, 0, 0, 0, 0, 0, 0, 0}},                       // the minimum time
      {20, {0x80, 0, 0, 0}},                                   // channel of INT_MIN
      {20, {0, 0, 0, 0}},                                      // no channel
      {20, {0, 0, 0, 64}},                                     // longer than LCM allows
      {24, {0xff, 0xff, 0xff, 0xff}},                          // data of -1
      {24, {0x7f, 0xff, 0xff, 0xff}},                          // 2 GB
      {28, {0x1b, '[', 'A'}},  // a terminal escape sequence as channel
  };
  for (const Field& f : fields) {
    Bytes bad = good;
    std::copy(f.bytes.begin(), f.bytes.end(),
              bad.begin() + static_cast<long>(event_offset(1) + f.at));
    const Read read = read_log(bad);
    ASSERT_EQ(read.events.size(), 2U) << f.at;
    EXPECT_EQ(read.events[1].number, 2);
  }
}

TEST(LogFile, RandomDamageIsHandled) {
  const Bytes good = read_file(good_log(60));
  std::mt19937 rng(5);
  for (int round = 0; round < 3000; ++round) {
    Bytes bad = good;
    std::uniform_int_distribution<std::size_t> place(0, bad.size() - 1);
    std::uniform_int_distribution<int> byte(0, 255);
    for (int k = 0; k <= round % 20; ++k) bad[place(rng)] = static_cast<std::uint8_t>(byte(rng));
    if (round % 3 == 0) bad.resize(place(rng));
    if (round % 7 == 0) {
      const auto cut = static_cast<long>(std::min(place(rng), bad.size()));
      bad.erase(bad.begin(), bad.begin() + cut);
    }
    const Read read = read_log(bad);
    std::int64_t bytes = read.health.skipped_bytes;
    for (const LogEvent& e : read.events) {
      bytes += static_cast<std::int64_t>(kHeader + e.channel.size() + e.data.size());
    }
    ASSERT_EQ(bytes, static_cast<std::int64_t>(bad.size())) << "every byte is read or counted";
  }
}

TEST(LogFile, NoiseIsNotALog) {
  std::mt19937 rng(6);
  std::uniform_int_distribution<int> byte(0, 255);
  Bytes noise(200'000);
  for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(byte(rng));
  const Read read = read_log(noise);
  EXPECT_TRUE(read.events.empty());
  EXPECT_EQ(read.health.skipped_bytes, 200'000);
  EXPECT_TRUE(read_log({}).health.good()) << "an empty file is an empty log";
}

TEST(LogFile, AFileThatCannotBeOpenedIsReportedWithTheReason) {
  EXPECT_EQ(LogReader::open("/nonexistent/a.lcm").error().message,
            "/nonexistent/a.lcm: cannot open the log: No such file or directory");
  EXPECT_NE(LogReader::open("/tmp").error().message.find("not a regular file"), std::string::npos);
  const std::string fifo = testing::TempDir() + "log_file_test.fifo";
  (void)std::remove(fifo.c_str());
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_NE(LogReader::open(fifo).error().message.find("not a regular file"), std::string::npos);
  (void)std::remove(fifo.c_str());
  EXPECT_NE(LogWriter::create("/nonexistent/a.lcm").error().message.find("cannot create"),
            std::string::npos);
}

TEST(LogFile, AFullDiskIsAnErrorAndStaysOne) {
  auto small = LogWriter::create("/dev/full");
  ASSERT_TRUE(small.ok());
  const Bytes data(100);
  EXPECT_TRUE(small->write(Stamp(), "A", data.data(), data.size()).ok()) << "buffered";
  const Outcome closed = small->close();
  ASSERT_FALSE(closed.ok());
  EXPECT_EQ(closed.error().message, "/dev/full: cannot write the log: No space left on device");

  auto large = LogWriter::create("/dev/full");
  const Bytes block(1'000'000);
  EXPECT_FALSE(large->write(Stamp(), "A", block.data(), block.size()).ok());
  EXPECT_FALSE(large->write(Stamp(), "A", data.data(), data.size()).ok());
  EXPECT_FALSE(large->close().ok());
}

}  // namespace
}  // namespace rcs
