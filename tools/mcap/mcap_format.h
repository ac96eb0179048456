#pragma once
// The container format MCAP (mcap.dev/spec, version 0): constants that its writer and its reader
// share. A file is MAGIC, Header, data section (Chunk, MessageIndex, Metadata, DataEnd), summary
// section, summary offsets, Footer, MAGIC. A record is its opcode, the number of bytes (uint64) and
// the content; numbers are little-endian.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace rcs::mcap {

inline constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F
};

/// Of a record: its opcode and the number of bytes of its content.
inline constexpr std::size_t kRecordHeadBytes = 9;

enum class Compression { kNone, kZstd };

/// The name in the file: "" or "zstd".
[[nodiscard]] constexpr const char* name_of(Compression c) {
  return c == Compression::kZstd ? "zstd" : "";
}

using TextMap = std::map<std::string, std::string>;

struct Schema {
  std::uint16_t id = 0;  ///< from 1
  std::string name;
  std::string encoding;  ///< "ros2msg"
  std::string text;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: none
  std::string topic;
  std::string message_encoding;  ///< "cdr"
  TextMap metadata;
};

/// A message in a file; `data` points into a buffer of the reader.
struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

}  // namespace rcs::mcap
