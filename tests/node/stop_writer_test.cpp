// The writer of a stop latch in a thread, also under the thread sanitizer.

#include "rcs/node/stop_writer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace rcs {
namespace {

/// The result, when there is one.
Outcome wait(StopWriter* writer) {
  for (;;) {
    if (const std::optional<Outcome> result = writer->finished()) return *result;
    std::this_thread::yield();
  }
}

TEST(StopWriterThread, ExecutesJobAfterJobAndReportsEachResultOnce) {
  std::string log;  // by one thread at a time
  StopWriterThread writer([&log](const StopJob& job) -> Outcome {
    log += job.text;
    if (job.only_if_missing) return Error{"refused " + job.text};
    return Done{};
  });
  EXPECT_FALSE(writer.finished()) << "no job yet";
  std::string expected;
  for (int k = 0; k < 1000; ++k) {
    const std::string text = std::to_string(k) + ",";
    expected += text;
    writer.start({"path", text, k % 2 == 1});
    const Outcome result = wait(&writer);
    ASSERT_EQ(result.ok(), k % 2 == 0);
    ASSERT_EQ(result.ok() ? "refused " + text : result.error().message, "refused " + text);
    ASSERT_FALSE(writer.finished());
    ASSERT_EQ(log, expected);
  }
}

TEST(StopWriterThread, NeverWaitsForAJob) {
  std::mutex mutex;
  std::condition_variable changed;
  bool hangs = true;
  StopWriterThread writer([&](const StopJob&) -> Outcome {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [&] { return !hangs; });
    return Done{};
  });
  writer.start({"path", "text", false});
  for (int k = 0; k < 100'000; ++k) ASSERT_FALSE(writer.finished());
  {
    const std::lock_guard<std::mutex> lock(mutex);
    hangs = false;
  }
  changed.notify_all();
  EXPECT_TRUE(wait(&writer).ok());
}

TEST(StopWriterThread, EndsWithAndWithoutAJob) {
  std::atomic<int> done{0};
  const auto io = [&done](const StopJob&) -> Outcome {
    ++done;
    return Done{};
  };
  for (int k = 0; k < 50; ++k) {
    StopWriterThread idle(io);
    auto writer = std::make_unique<StopWriterThread>(io);
    writer->start({"path", "text", false});
    (void)wait(writer.get());
  }
  EXPECT_EQ(done, 50);
  for (int k = 0; k < 500; ++k) {
    StopWriterThread writer(io);
    writer.start({"path", "text", false});
  }
  EXPECT_EQ(done, 550) << "a job that was begun is executed";
}

}  // namespace
}  // namespace rcs
