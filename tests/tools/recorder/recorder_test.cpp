// A recording on a disk that loses its power, is full, or has errors.

#include "tools/recorder/recorder.h"

#include <gmock/gmock.h>

#include <optional>

#include "tests/tools/recorder/recorder_fixture.h"
#include "tools/recorder/recorder_thread.h"

namespace rcs::recorder {
namespace {

using test::batch_of;
using test::consecutive;
using test::FaultyFolder;
using test::kEventBytes;
using test::line_of;
using test::read_back;
using test::ReadBack;
using test::small_params;

constexpr Stamp kBegin = from_utime(1'000'000'000);

/// A bus with a message per millisecond, and the cycle of the recorder at its own times.
class RunOnADisk {
 public:
  RunOnADisk(Duration write_time, Duration sync_time)
      : recorder_(&folder, small_params(700, 100)), queue_(std::size_t{64} << 20) {
    folder.now = kBegin;
    folder.write_time = write_time;
    folder.sync_time = sync_time;
    folder.at_every_instant = [this] {
      receive();
      on_instant();
    };
    EXPECT_EQ(recorder_.open(), 0);
    cycle_.emplace(&queue_, &recorder_, [this] { return folder.now; });
  }

  void run(Duration time) {
    while (folder.now < kBegin + time) {
      folder.now += cycle_->pause();
      receive();
      EXPECT_TRUE(cycle_->run());
      largest_exposure = std::max(largest_exposure, cycle_->exposure());
    }
  }
  /// Messages received up to `moment`.
  static std::int64_t received_by(Stamp moment) {
    return std::max<std::int64_t>(0, (moment - kBegin) / from_milliseconds(1.0) + 1);
  }

  FaultyFolder folder;
  std::function<void()> on_instant = [] {};
  Duration largest_exposure{};

 private:
  void receive() {
    const std::vector<std::uint8_t> data(test::kPayload, 7);
    for (; received_ < received_by(folder.now); ++received_) {
      queue_.push_message(kBegin + received_ * from_milliseconds(1.0), "INS", data.data(),
                          data.size());
    }
  }

  Recorder recorder_;
  RecordQueue queue_;
  std::optional<RecorderCycle> cycle_;
  std::int64_t received_ = 0;
};

struct DiskTimes {
  double write_ms;
  double sync_ms;
};
class PowerFailure : public testing::TestWithParam<DiskTimes> {};

TEST_P(PowerFailure, AtAnyInstantCostsLessThanASecond) {
  RunOnADisk run(from_milliseconds(GetParam().write_ms), from_milliseconds(GetParam().sync_ms));
  int instants = 0;
  int torn = 0;
  run.on_instant = [&] {
    ++instants;
    for (const double share : {0.0, 0.37, 1.0}) {
      const ReadBack read = read_back(run.folder.after_power_failure(share));
      EXPECT_EQ(read.damaged, 0);
      EXPECT_TRUE(consecutive(read.numbers));
      torn += read.truncated;
      const auto kept = static_cast<std::int64_t>(read.numbers.size());
      EXPECT_GE(kept, RunOnADisk::received_by(run.folder.now - from_seconds(1.0)));
    }
  };
  run.run(from_seconds(3.0));
  EXPECT_GT(instants, 50);
  EXPECT_GT(torn, 5) << "the case of an event that is stored in part was not tested";
  EXPECT_LE(run.largest_exposure, from_seconds(1.0));
}

INSTANTIATE_TEST_SUITE_P(Disks, PowerFailure,
                         testing::Values(DiskTimes{0.1, 2.0}, DiskTimes{10.0, 50.0},
                                         DiskTimes{30.0, 100.0}),
                         [](const auto& disk) {
                           return "Sync" + std::to_string(static_cast<int>(disk.param.sync_ms)) +
                                  "ms";
                         });

TEST(Recorder, ADiskThatIsTooSlowIsMeasured) {
  RunOnADisk run(from_milliseconds(20.0), from_milliseconds(900.0));
  run.run(from_seconds(5.0));
  EXPECT_GT(run.largest_exposure, from_seconds(1.0));
}

/// A disk that is full at one write: the oldest segment makes room, and no message is lost.
TEST(Recorder, ADiskThatIsFullAtAnyWriteLosesTheOldestSegmentOnly) {
  constexpr int kWrites = 20;  // ten segments, each is created and written once
  for (int full_at = 0; full_at < kWrites; ++full_at) {
    FaultyFolder folder;
    Recorder recorder(&folder, small_params(10, 100));
    ASSERT_EQ(recorder.open(), 0);
    int writes = 0;
    folder.write_error = [&] { return writes++ == full_at ? ENOSPC : 0; };
    for (int k = 0; k < 10; ++k) recorder.store(batch_of(10 * k, 10), {});
    EXPECT_GT(writes, full_at);
    // Of a single segment with records nothing is deleted: one batch is lost instead.
    const bool early = full_at < 4;
    const RecorderStatus& status = recorder.status();
    EXPECT_EQ(status.shed_for_space, early ? 0 : 1) << full_at;
    EXPECT_EQ(status.messages_lost, early ? 10 : 0) << full_at;
    const ReadBack read = read_back(folder.files);
    EXPECT_EQ(read.damaged + read.truncated, 0) << full_at;
    EXPECT_EQ(read.numbers.size(), 90U) << full_at;
    EXPECT_EQ(read.newest(), 99) << full_at;
    EXPECT_TRUE(early || consecutive(read.numbers)) << full_at;
  }
}

TEST(Recorder, AFullDiskShedsTheOldestAndKeepsTheNewest) {
  FaultyFolder folder;
  folder.capacity = 55 * kEventBytes + 17;  // full inside an event
  Recorder recorder(&folder, small_params(10, 100));
  ASSERT_EQ(recorder.open(), 0);
  for (int k = 0; k < 40; ++k) recorder.store(batch_of(7 * k, 7), {});
  const ReadBack read = read_back(folder.files);
  EXPECT_EQ(recorder.status().messages_lost, 0);
  EXPECT_EQ(recorder.status().stopped_by, 0);
  EXPECT_GE(recorder.status().shed_for_space, 20);
  EXPECT_EQ(read.damaged + read.truncated, 0);
  EXPECT_TRUE(consecutive(read.numbers));
  EXPECT_EQ(read.newest(), 279);
  EXPECT_GE(read.numbers.size(), 40U);
}

TEST(Recorder, AFullDiskWithNothingLeftToDeleteStopsTheRecordingUntilThereIsSpace) {
  FaultyFolder folder;
  folder.capacity = 100 * kEventBytes;
  RecorderParams params = small_params(10, 100);
  Recorder recorder(&folder, params);
  ASSERT_EQ(recorder.open(), 0);
  recorder.store(batch_of(0, 5), {});
  folder.used_by_others = folder.capacity - 6 * kEventBytes - 10;
  recorder.store(batch_of(5, 3), {});  // one fits, and a part of the next
  EXPECT_EQ(recorder.status().stopped_by, ENOSPC);
  EXPECT_EQ(recorder.status().messages, 6);
  EXPECT_EQ(recorder.status().messages_lost, 2);
  recorder.store(batch_of(8, 2), {});
  EXPECT_EQ(recorder.status().messages_lost, 4);
  folder.used_by_others = 0;
  for (int k = 0; k < 20; ++k) recorder.store(batch_of(10 + k, 1), {});
  EXPECT_EQ(recorder.status().stopped_by, 0);
  const ReadBack read = read_back(folder.files);
  EXPECT_EQ(read.damaged, 0);
  EXPECT_EQ(read.truncated, 1);
  ASSERT_FALSE(read.numbers.empty());
  EXPECT_EQ(read.numbers.front(), 0);
  EXPECT_EQ(read.newest(), 29);
  EXPECT_EQ(static_cast<std::int64_t>(read.numbers.size()), recorder.status().messages);
}

TEST(Recorder, TheReserveStaysFree) {
  FaultyFolder folder;
  folder.capacity = 200 * kEventBytes;
  RecorderParams params = small_params(10, 100);
  params.reserve_bytes = 50 * kEventBytes;
  Recorder recorder(&folder, params);
  ASSERT_EQ(recorder.open(), 0);
  for (int k = 0; k < 100; ++k) recorder.store(batch_of(10 * k, 10), {});
  // Segments are deleted every eight calls.
  EXPECT_GE(folder.free_bytes(), params.reserve_bytes - 80 * kEventBytes);
  EXPECT_GT(recorder.status().shed_for_space, 50);
  EXPECT_EQ(recorder.status().messages_lost, 0);
  folder.used_by_others = 195 * kEventBytes;
  for (int k = 100; k < 130; ++k) recorder.store(batch_of(10 * k, 10), {});
  EXPECT_EQ(recorder.status().stopped_by, ENOSPC) << "the others have used the reserve";
  folder.used_by_others = 0;
  for (int k = 130; k < 150; ++k) recorder.store(batch_of(10 * k, 10), {});
  EXPECT_EQ(recorder.status().stopped_by, 0);
  EXPECT_EQ(read_back(folder.files).newest(), 1499);
}

TEST(Recorder, ADiskWithErrorsStopsTheRecordingAndANewSegmentFollows) {
  FaultyFolder folder;
  Recorder recorder(&folder, small_params(100, 100));
  ASSERT_EQ(recorder.open(), 0);
  recorder.store(batch_of(0, 10), {});
  folder.sync_error = [] { return EIO; };
  recorder.store(batch_of(10, 10), {});
  EXPECT_EQ(recorder.status().stopped_by, EIO);
  EXPECT_EQ(recorder.status().messages_lost, 10) << "unknown whether they are on the disk";
  folder.write_error = [] { return EIO; };
  for (int k = 0; k < 100; ++k) recorder.store(batch_of(20 + k, 1), {});
  EXPECT_EQ(folder.files.size(), 1U) << "empty segments remain";
  folder.write_error = folder.sync_error = [] { return 0; };
  for (int k = 0; k < 10; ++k) recorder.store(batch_of(120 + k, 1), {});
  EXPECT_EQ(recorder.status().stopped_by, 0);
  EXPECT_EQ(folder.files.size(), 2U);
  EXPECT_EQ(read_back(folder.files).newest(), 129);
}

std::string audit_text(const FaultyFolder& folder) {
  std::string text;
  for (const auto& [name, file] : folder.files) {
    if (name.rfind("audit-", 0) == 0) text.append(file.bytes.begin(), file.bytes.end());
  }
  return text;
}

TEST(Recorder, MessagesNeverDisplaceTheAuditLog) {
  FaultyFolder folder;
  folder.capacity = 60 * kEventBytes;
  Recorder recorder(&folder, small_params(10, 4));
  ASSERT_EQ(recorder.open(), 0);
  std::string expected;
  for (int k = 0; k < 50; ++k) {
    const std::string line = "{\"serial\": " + std::to_string(k) + "}";
    recorder.store(batch_of(10 * k, 10), line_of(line));
    expected += line + "\n";
    EXPECT_EQ(audit_text(folder), expected);
  }
  EXPECT_EQ(recorder.status().audit_lines, 50);
  EXPECT_GT(recorder.status().shed_by_limit, 40);
}

TEST(Recorder, AuditLinesWaitForAFullDisk) {
  FaultyFolder folder;
  Recorder recorder(&folder, small_params(10, 4));
  ASSERT_EQ(recorder.open(), 0);
  folder.capacity = 0;
  recorder.store(batch_of(0, 1), line_of("first"));
  recorder.store({}, line_of("second"));
  EXPECT_EQ(recorder.status().audit_lines, 0);
  EXPECT_EQ(recorder.status().audit_lines_waiting, 2);
  folder.capacity = 3;  // a part of a line
  recorder.store({}, {});
  folder.capacity = 1'000'000;
  recorder.store({}, line_of("third"));
  EXPECT_EQ(audit_text(folder), "first\nsecond\nthird\n");
  EXPECT_EQ(recorder.status().audit_lines, 3);
  EXPECT_EQ(recorder.status().audit_lines_lost, 0);
}

TEST(Recorder, TheAuditLogHasItsOwnLimit) {
  FaultyFolder folder;
  RecorderParams params = small_params(10, 4);
  params.audit.max_bytes = 1000;
  params.audit.segment_bytes = 100;
  Recorder recorder(&folder, params);
  ASSERT_EQ(recorder.open(), 0);
  for (int k = 0; k < 500; ++k) recorder.store({}, line_of("line " + std::to_string(1000 + k)));
  const std::string text = audit_text(folder);
  EXPECT_LE(text.size(), 1000U);
  EXPECT_GE(text.size(), 850U);
  EXPECT_THAT(text, testing::EndsWith("line 1499\n"));
}

}  // namespace
}  // namespace rcs::recorder
