// MCAP files: what is written is read, damage is bounded, the same calls give the same bytes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>

#include "rcs/base/byte_codec.h"
#include "tests/support/random_message.h"
#include "tools/mcap/mcap_reader.h"
#include "tools/mcap/mcap_writer.h"

namespace rcs::mcap {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::HasSubstr;

class MemorySink final : public ByteSink {
 public:
  Outcome append(const std::uint8_t* data, std::size_t size) override {
    bytes.insert(bytes.end(), data, data + size);
    return Done{};
  }
  Bytes bytes;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(Bytes bytes) : bytes_(std::move(bytes)) { bytes_.shrink_to_fit(); }
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
  [[nodiscard]] bool read(std::uint64_t at, std::size_t n, std::uint8_t* out) override {
    RCS_CHECK(at <= bytes_.size() && n <= bytes_.size() - at);
    if (n > 0) std::memcpy(out, bytes_.data() + at, n);
    return true;
  }

 private:
  Bytes bytes_;
};

Reader reader_of(const Bytes& bytes) {
  Result<Reader> reader = Reader::open(std::make_unique<MemorySource>(bytes));
  EXPECT_TRUE(reader.ok());
  return std::move(reader).value();
}

constexpr int kMessages = 200;

/// Message k has k % 50 bytes of value k, on topic "/a" or "/b".
Bytes file(Compression compression, std::size_t chunk_bytes = 1000) {
  MemorySink sink;
  WriterOptions options;
  options.profile = "ros2";
  options.compression = compression;
  options.chunk_bytes = chunk_bytes;
  Writer writer(options, &sink);
  writer.add_metadata("clocks", {{"utc_us", "17"}, {"a", ""}});
  const std::uint16_t schema = writer.add_schema("p/msg/T", "ros2msg", "int32 x\n");
  const std::uint16_t a = writer.add_channel(schema, "/a", "cdr", {{"k", "v"}});
  std::uint16_t b = 0;
  for (int k = 0; k < kMessages; ++k) {
    if (k == 100) b = writer.add_channel(schema, "/b", "cdr", {});
    const Bytes data(static_cast<std::size_t>(k % 50), static_cast<std::uint8_t>(k));
    const std::uint64_t time_ns = 1'000'000ULL * static_cast<std::uint64_t>(k == 150 ? 3 : k);
    writer.write(k >= 100 && k % 2 == 0 ? b : a, static_cast<std::uint32_t>(k), time_ns,
                 data.data(), data.size());
  }
  EXPECT_TRUE(writer.finish().ok());
  EXPECT_EQ(writer.bytes(), sink.bytes.size());
  return sink.bytes;
}

/// Number of messages, all of which must be those of file() from the first on.
int read_all(Reader* reader) {
  Message m;
  int n = 0;
  for (; reader->next(&m); ++n) {
    EXPECT_EQ(m.sequence, static_cast<std::uint32_t>(n));
    EXPECT_EQ(m.size, static_cast<std::size_t>(n % 50));
    EXPECT_TRUE(std::all_of(m.data, m.data + m.size,
                            [n](std::uint8_t b) { return b == static_cast<std::uint8_t>(n); }));
  }
  return n;
}

TEST(Mcap, WhatIsWrittenIsRead) {
  for (const Compression c : {Compression::kNone, Compression::kZstd}) {
    Reader reader = reader_of(file(c));
    EXPECT_EQ(read_all(&reader), kMessages);
    EXPECT_TRUE(reader.health().good()) << reader.health().summary();
    EXPECT_EQ(reader.profile(), "ros2");
    EXPECT_EQ(reader.metadata().at("clocks").at("utc_us"), "17");
    EXPECT_EQ(reader.channel(1)->topic, "/a");
    EXPECT_EQ(reader.channel(1)->metadata.at("k"), "v");
    EXPECT_EQ(reader.channel(2)->topic, "/b");
    EXPECT_EQ(reader.schema(1)->text, "int32 x\n");
    EXPECT_EQ(reader.channel(3), nullptr);
  }
}

TEST(Mcap, TheSameCallsGiveTheSameBytes) {
  EXPECT_EQ(file(Compression::kZstd), file(Compression::kZstd));
}

TEST(Mcap, AFileWithoutMessagesIsComplete) {
  MemorySink sink;
  Writer writer({}, &sink);
  EXPECT_TRUE(writer.finish().ok());
  Reader reader = reader_of(sink.bytes);
  Message m;
  EXPECT_FALSE(reader.next(&m));
  EXPECT_TRUE(reader.health().good());
}

/// The fields of the records of the summary, by hand: they are for readers that seek.
TEST(Mcap, TheSummaryDescribesTheFile) {
  const Bytes bytes = file(Compression::kZstd);
  const auto u64 = [&](std::size_t at) { return wire::take<std::uint64_t>(bytes.data() + at); };
  const auto u32 = [&](std::size_t at) { return wire::take<std::uint32_t>(bytes.data() + at); };
  const std::size_t footer = bytes.size() - 8 - 20;
  EXPECT_EQ(bytes[footer - 9], 0x02);
  const std::size_t summary = u64(footer);
  const std::size_t offsets = u64(footer + 8);
  EXPECT_EQ(u32(footer + 16), crc32(bytes.data() + summary, footer + 16 - summary));
  EXPECT_EQ(bytes[summary - 13], 0x0F);
  EXPECT_EQ(u32(summary - 4), crc32(bytes.data(), summary - 13));

  std::uint64_t messages = 0;
  std::size_t chunks = 0;
  std::vector<int> groups;
  for (std::size_t at = offsets; at < footer - 9; at += 9 + u64(at + 1)) {
    ASSERT_EQ(bytes[at], 0x0E);
    const std::size_t start = u64(at + 10);
    EXPECT_EQ(bytes[start], bytes[at + 9]) << "a group begins with its opcode";
    groups.push_back(bytes[at + 9]);
  }
  EXPECT_THAT(groups, testing::ElementsAre(0x03, 0x04, 0x0B, 0x0D, 0x08));
  for (std::size_t at = summary; at < offsets; at += 9 + u64(at + 1)) {
    if (bytes[at] == 0x0B) messages = u64(at + 9);
    if (bytes[at] != 0x08) continue;
    ++chunks;
    const std::size_t content = at + 9;
    const std::size_t chunk = u64(content + 16);
    EXPECT_EQ(bytes[chunk], 0x06);
    EXPECT_EQ(u64(content + 24), 9 + u64(chunk + 1)) << "length of the chunk";
    EXPECT_EQ(u64(chunk + 9), u64(content)) << "first time";
    EXPECT_EQ(u64(chunk + 17), u64(content + 8)) << "last time";
    // Each index record is at its offset, and has the channel of the map.
    const std::size_t map = u32(content + 32);
    for (std::size_t k = content + 36; k < content + 36 + map; k += 10) {
      const std::size_t index = u64(k + 2);
      EXPECT_EQ(bytes[index], 0x07);
      EXPECT_EQ(wire::take<std::uint16_t>(bytes.data() + index + 9),
                wire::take<std::uint16_t>(bytes.data() + k));
    }
  }
  EXPECT_EQ(messages, std::uint64_t{kMessages});
  EXPECT_GT(chunks, 3U);
}

TEST(Mcap, ATruncatedFileIsReadToItsLastCompleteChunk) {
  const Bytes whole = file(Compression::kZstd);
  int before = 0;
  int steps = 0;
  for (std::size_t end = 8; end < whole.size(); ++end) {
    Reader reader = reader_of(Bytes(whole.begin(), whole.begin() + static_cast<long>(end)));
    const int n = read_all(&reader);
    EXPECT_GE(n, before) << "cut at " << end;
    steps += n > before ? 1 : 0;
    before = n;
    if (!reader.health().complete) {
      EXPECT_THAT(reader.health().summary(), HasSubstr("the file is truncated"));
    }
  }
  EXPECT_EQ(before, kMessages);
  EXPECT_GT(steps, 3) << "chunk by chunk";
}

TEST(Mcap, ADamagedChunkIsOmitted) {
  for (const Compression c : {Compression::kNone, Compression::kZstd}) {
    Bytes bytes = file(c);
    // The first chunk follows the header and the metadata.
    std::size_t at = 8;
    while (bytes[at] != 0x06) at += 9 + wire::take<std::uint64_t>(bytes.data() + at + 1);
    at += 9 + wire::take<std::uint64_t>(bytes.data() + at + 1);  // schema and channel are in it
    while (bytes[at] != 0x06) at += 9 + wire::take<std::uint64_t>(bytes.data() + at + 1);
    std::uint8_t& byte = bytes[at + 9 + 60];
    byte = static_cast<std::uint8_t>(byte ^ 0x10U);
    Reader reader = reader_of(bytes);
    Message m;
    int n = 0;
    while (reader.next(&m)) ++n;
    EXPECT_GT(n, kMessages / 2);
    EXPECT_LT(n, kMessages);
    EXPECT_EQ(reader.health().damaged_chunks, 1U);
    EXPECT_TRUE(reader.health().checksum_differs);
    EXPECT_FALSE(reader.health().good());
  }
}

TEST(Mcap, OtherFilesAreRejected) {
  EXPECT_FALSE(Reader::open(std::make_unique<MemorySource>(Bytes{})).ok());
  Bytes bytes = file(Compression::kNone);
  bytes[5] = '1';
  const Result<Reader> reader = Reader::open(std::make_unique<MemorySource>(bytes));
  ASSERT_FALSE(reader.ok());
  EXPECT_THAT(reader.error().message, HasSubstr("version"));
}

TEST(Mcap, ASmallFileDoesNotNeedMuchMemory) {
  // A chunk that states 200 MB of content.
  Bytes bytes = file(Compression::kZstd);
  std::size_t at = 8;
  while (bytes[at] != 0x06) at += 9 + wire::take<std::uint64_t>(bytes.data() + at + 1);
  wire::put(std::uint64_t{200'000'000}, bytes.data() + at + 9 + 16);
  Reader reader = reader_of(bytes);
  Message m;
  while (reader.next(&m)) {
  }
  EXPECT_GT(reader.health().damaged_chunks, 0U);
}

TEST(Mcap, DamagedFilesAreReadOrRejected) {
  std::mt19937 random(23);
  std::uint64_t messages = 0;
  for (const Compression c : {Compression::kNone, Compression::kZstd}) {
    const Bytes whole = file(c, 500);
    for (int i = 0; i < 6000; ++i) {
      const Bytes bytes = test::mutated(whole, &random);
      Result<Reader> reader = Reader::open(std::make_unique<MemorySource>(bytes));
      if (!reader) continue;
      Message m;
      std::size_t sum = 0;
      while (reader->next(&m)) {
        for (std::size_t k = 0; k < m.size; ++k) sum += m.data[k];
        RCS_CHECK(reader->channel(m.channel_id) != nullptr);
      }
      EXPECT_LT(sum, std::size_t{1} << 40U);
      messages += reader->health().messages;
    }
  }
  EXPECT_GT(messages, 100'000U) << "most of a damaged file is read";
}

TEST(Mcap, AFullDiskIsAnError) {
  class FullSink final : public ByteSink {
   public:
    Outcome append(const std::uint8_t* /*data*/, std::size_t size) override {
      written_ += size;
      return written_ < 2000 ? Outcome(Done{}) : Outcome(Error{"no space"});
    }

   private:
    std::size_t written_ = 0;
  };
  FullSink sink;
  WriterOptions options;
  options.compression = Compression::kNone;
  options.chunk_bytes = 500;
  Writer writer(options, &sink);
  const std::uint16_t channel = writer.add_channel(0, "/a", "cdr", {});
  const Bytes data(100);
  for (int k = 0; k < 100; ++k) writer.write(channel, 0, 0, data.data(), data.size());
  EXPECT_FALSE(writer.outcome().ok());
  EXPECT_EQ(writer.finish().error().message, "no space");
}

}  // namespace
}  // namespace rcs::mcap
