#pragma once
// Writes a file in the format MCAP: messages in chunks, each with the index of its messages, and
// at the end a summary with the index of the chunks and statistics. The same calls give the same
// bytes.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/result.h"
#include "tools/mcap/compression.h"
#include "tools/mcap/mcap_format.h"

namespace rcs::mcap {

/// Receives the bytes of a file in their order.
class ByteSink {
 public:
  ByteSink() = default;
  ByteSink(const ByteSink&) = delete;
  ByteSink& operator=(const ByteSink&) = delete;
  virtual ~ByteSink() = default;

  virtual Outcome append(const std::uint8_t* data, std::size_t size) = 0;
};

struct WriterOptions {
  std::string profile;  ///< "ros2"
  std::string library;  ///< name and version of the writing program
  Compression compression = Compression::kZstd;
  int zstd_level = 3;
  /// A chunk ends when it has this many bytes: a reader that seeks reads whole chunks, and a file
  /// that is not closed lacks the last one.
  std::size_t chunk_bytes = std::size_t{1} << 20;
};

class Writer {
 public:
  /// @param sink  outlives the writer
  Writer(WriterOptions options, ByteSink* sink);

  /// The first failure of the sink is permanent; finish() returns it. Nothing is written then.
  /// @return the id, from 1; 0: the file has 65535 schemas
  std::uint16_t add_schema(const std::string& name, const std::string& encoding,
                           const std::string& text);
  /// @param schema_id  of add_schema()
  /// @return the id, from 1; 0: the file has 65535 channels
  std::uint16_t add_channel(std::uint16_t schema_id, const std::string& topic,
                            const std::string& message_encoding, const TextMap& metadata);
  /// A record for people and programs; its place is after the messages so far.
  void add_metadata(const std::string& name, const TextMap& values);
  /// @param channel_id  of add_channel()
  /// @param size  at most 4 GiB - 1
  void write(std::uint16_t channel_id, std::uint32_t sequence, std::uint64_t time_ns,
             const std::uint8_t* data, std::size_t size);
  /// Writes the last chunk and the summary. Without it the file is readable to its last chunk.
  Outcome finish();

  [[nodiscard]] const Outcome& outcome() const { return outcome_; }
  [[nodiscard]] std::uint64_t messages() const { return total_.messages; }
  [[nodiscard]] std::uint64_t messages_of(std::uint16_t channel_id) const {
    return channel_messages_[channel_id - std::size_t{1}];
  }
  [[nodiscard]] std::uint64_t bytes() const { return position_; }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Span {
    std::uint64_t messages = 0;
    std::uint64_t first_ns = 0;
    std::uint64_t last_ns = 0;

    void add(std::uint64_t time_ns);
  };
  struct ChunkIndex {
    Span span;
    std::uint64_t start = 0;
    std::uint64_t length = 0;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> index_offsets;  // by channel
    std::uint64_t index_length = 0;
    std::uint64_t compressed_bytes = 0;
    std::uint64_t bytes = 0;
  };

  void emit(const Bytes& bytes);
  void end_chunk();
  void write_indexes(ChunkIndex* index);
  void append_group(Opcode opcode, const Bytes& records, Bytes* summary, Bytes* offsets) const;
  [[nodiscard]] Bytes chunk_indexes() const;
  [[nodiscard]] Bytes statistics() const;

  WriterOptions options_;
  ByteSink* sink_;
  ZstdCompressor zstd_;
  Outcome outcome_ = Done{};
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  // of all bytes so far

  Bytes chunk_;       // records of the current chunk
  Bytes compressed_;  // buffer
  Bytes record_;      // buffer
  Span chunk_span_;
  Span total_;
  /// Of the current chunk, by channel: (log time, offset in the chunk).
  std::vector<std::vector<std::pair<std::uint64_t, std::uint64_t>>> entries_;

  // For the summary.
  Bytes schemas_;
  Bytes channels_;
  std::uint16_t schema_count_ = 0;
  std::vector<std::uint64_t> channel_messages_;  // by channel
  std::vector<ChunkIndex> chunks_;
  Bytes metadata_indexes_;
  std::uint32_t metadata_count_ = 0;
};

}  // namespace rcs::mcap
