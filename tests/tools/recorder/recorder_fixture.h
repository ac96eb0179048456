#pragma once
// Batches of numbered messages, and the messages that a log reader finds in the files.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "rcs/node/log/log_file.h"
#include "tests/tools/recorder/faulty_folder.h"
#include "tools/recorder/batch.h"
#include "tools/recorder/recorder.h"

namespace rcs::test {

constexpr std::size_t kPayload = 100;
constexpr std::int64_t kEventBytes = 28 + 3 + kPayload;  // header, channel INS, data

/// `count` messages of kEventBytes with increasing numbers, 1 ms apart.
inline recorder::Batch batch_of(std::int64_t first, std::int64_t count) {
  recorder::Batch batch;
  const std::vector<std::uint8_t> data(kPayload, 7);
  batch.stamp = from_utime(1'000'000'000 + 1000 * first);
  for (std::int64_t k = first; k < first + count; ++k) {
    append_event(k, from_utime(1'000'000'000 + 1000 * k), "INS", data.data(), data.size(),
                 &batch.bytes);
    batch.ends.push_back(batch.bytes.size());
  }
  return batch;
}

inline recorder::Batch line_of(const std::string& text) {
  recorder::Batch batch;
  batch.stamp = from_utime(1'000'000'000);
  batch.bytes.assign(text.begin(), text.end());
  batch.bytes.push_back('\n');
  batch.ends.push_back(batch.bytes.size());
  return batch;
}

struct ReadBack {
  std::vector<std::int64_t> numbers;  ///< of the events in all logs, in the order of the names
  /// The newest; -1: none.
  [[nodiscard]] std::int64_t newest() const { return numbers.empty() ? -1 : numbers.back(); }
  int truncated = 0;  ///< logs that end inside an event
  int damaged = 0;    ///< logs with other damage
};

inline ReadBack read_back(const FaultyFolder::Files& files) {
  const std::string path =
      testing::TempDir() + "recorder_test_" + std::to_string(::getpid()) + ".log";
  ReadBack read;
  for (const auto& [name, file] : files) {
    if (name.rfind("rcs-", 0) != 0) continue;
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.bytes.data()),
               static_cast<std::streamsize>(file.bytes.size()));
    Result<LogReader> reader = LogReader::open(path);
    EXPECT_TRUE(reader.ok());
    LogEvent event;
    while (reader->next(&event)) read.numbers.push_back(event.number);
    read.truncated += reader->health().truncated ? 1 : 0;
    read.damaged += reader->health().skips > (reader->health().truncated ? 1 : 0) ? 1 : 0;
  }
  std::filesystem::remove(path);
  return read;
}

inline bool consecutive(const std::vector<std::int64_t>& numbers) {
  for (std::size_t k = 1; k < numbers.size(); ++k) {
    if (numbers[k] != numbers[k - 1] + 1) return false;
  }
  return true;
}

/// Segments of `segment` messages, at most `segments` of them.
inline recorder::RecorderParams small_params(std::int64_t segment, std::int64_t segments) {
  recorder::RecorderParams params;
  params.messages.segment_bytes = segment * kEventBytes;
  params.messages.max_bytes = segments * segment * kEventBytes;
  params.reserve_bytes = 0;
  params.resume_bytes = 0;
  return params;
}

}  // namespace rcs::test
