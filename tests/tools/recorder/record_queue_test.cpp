// The queue between the receiver and the thread that stores.

#include "tools/recorder/record_queue.h"

#include <gtest/gtest.h>

#include <string>

#include "rcs/node/log/log_file.h"
#include "tests/support/fresh_folder.h"
#include "tests/tools/recorder/recorder_fixture.h"
#include "tools/recorder/recorder_thread.h"

namespace rcs::recorder {
namespace {

void push(RecordQueue* queue, std::string_view channel, std::size_t size) {
  const std::vector<std::uint8_t> data(size, 1);
  queue->push_message(from_utime(5), channel, data.data(), size);
}

TEST(RecordQueue, IsBoundedAndCountsWhatTheDiskIsTooSlowFor) {
  RecordQueue queue(10'000);
  for (int k = 0; k < 1000; ++k) push(&queue, "INS", 100);
  Batch messages;
  Batch audit;
  EXPECT_TRUE(queue.take(&messages, &audit));
  EXPECT_LE(messages.bytes.size(), 10'000U);
  EXPECT_GE(messages.ends.size(), 70U);
  EXPECT_EQ(queue.counts().received, 1000);
  EXPECT_EQ(queue.counts().dropped + static_cast<std::int64_t>(messages.ends.size()), 1000);
  push(&queue, "INS", 100);
  EXPECT_TRUE(queue.take(&messages, &audit));
  ASSERT_EQ(messages.ends.size(), 1U);

  // The numbers of the events show how many were dropped.
  test::FaultyFolder::Files files;
  files["rcs-1.log"].bytes = messages.bytes;
  EXPECT_EQ(test::read_back(files).numbers, std::vector<std::int64_t>{1000});
}

TEST(RecordQueue, WhatALogCannotHoldIsRejectedAndCounted) {
  RecordQueue queue(std::size_t{64} << 20);
  push(&queue, "", 1);
  push(&queue, std::string(64, 'A'), 1);
  push(&queue, "WITH SPACE", 1);
  push(&queue, "ESC\033[2J", 1);
  push(&queue, "HUGE", LogReader::kDefaultMaxDataBytes + 1);
  push(&queue, std::string(63, 'A'), 0);
  EXPECT_EQ(queue.counts().rejected, 5);
  Batch messages;
  Batch audit;
  EXPECT_TRUE(queue.take(&messages, &audit));
  EXPECT_EQ(messages.ends.size(), 1U);
}

TEST(RecordQueue, AnAuditLineEndsTheWait) {
  RecordQueue queue(1000);
  queue.push_audit_line(from_utime(5), "a line");
  queue.wait(std::chrono::hours(1));
  Batch messages;
  Batch audit;
  EXPECT_TRUE(queue.take(&messages, &audit));
  EXPECT_EQ(std::string(audit.bytes.begin(), audit.bytes.end()), "a line\n");
  push(&queue, "INS", 600);  // more than half
  queue.wait(std::chrono::hours(1));
  queue.close();
  queue.wait(std::chrono::hours(1));
  EXPECT_FALSE(queue.take(&messages, &audit));
  EXPECT_EQ(messages.ends.size(), 1U);
}

TEST(RecorderThread, StoresTheRestWhenItIsStopped) {
  test::FaultyFolder folder;
  Recorder recorder(&folder, test::small_params(100, 100));
  ASSERT_EQ(recorder.open(), 0);
  RecorderThread thread(&recorder, 1'000'000, [] { return Stamp(); });
  for (int k = 0; k < 1000; ++k) push(&thread.queue(), "INS", 100);
  thread.queue().push_audit_line(from_utime(5), "last");
  thread.stop();
  const RecorderThread::State state = thread.state();
  EXPECT_EQ(state.recorder.messages, 1000);
  EXPECT_EQ(state.recorder.audit_lines, 1);
  EXPECT_EQ(state.queue.dropped, 0);
  EXPECT_EQ(test::read_back(folder.after_power_failure(0.0)).numbers.size(), 1000U);
}

}  // namespace
}  // namespace rcs::recorder
