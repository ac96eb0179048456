#pragma once
// Reads the messages of an MCAP file in the order of the file, from untrusted bytes. A file that
// ends early is read to its last complete chunk; a damaged chunk is left out. Memory is bounded by
// the size of the file and kMaxChunkBytes, and time by the bytes of the file and of its
// decompressed chunks. Nothing throws but std::bad_alloc.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/mcap/mcap_format.h"

namespace rcs::mcap {

/// A file, or bytes in memory.
class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// @param at + n  at most size()
  /// @return false: the system could not read
  [[nodiscard]] virtual bool read(std::uint64_t at, std::size_t n, std::uint8_t* out) = 0;
};

/// What a reader found so far.
struct ReaderHealth {
  std::uint64_t messages = 0;        ///< delivered
  std::uint64_t damaged_chunks = 0;  ///< omitted or ended early: checksum, compression, lengths
  std::uint64_t lost_records = 0;    ///< malformed, or a message without a channel
  bool complete = false;             ///< the data section has its end record
  bool checksum_differs = false;     ///< that of the data section
  std::string io_error;

  [[nodiscard]] bool good() const {
    return complete && damaged_chunks == 0 && lost_records == 0 && !checksum_differs &&
           io_error.empty();
  }
  /// One line for people: "1203 messages; 1 damaged chunk; the file is truncated".
  [[nodiscard]] std::string summary() const;
};

class Reader {
 public:
  /// Larger chunks are counted as damaged.
  static constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{256} << 20;

  /// @return an error if the bytes do not begin as an MCAP file
  static Result<Reader> open(std::unique_ptr<ByteSource> source);

  /// The next message; `message->data` is valid until the next call. False at the end: then check
  /// health().
  [[nodiscard]] bool next(Message* message);

  /// Null: no such channel so far.
  [[nodiscard]] const Channel* channel(std::uint16_t id) const;
  [[nodiscard]] const Schema* schema(std::uint16_t id) const;
  [[nodiscard]] const std::string& profile() const { return profile_; }
  /// Of the metadata records so far, by their names.
  [[nodiscard]] const std::map<std::string, TextMap>& metadata() const { return metadata_; }
  [[nodiscard]] const ReaderHealth& health() const { return health_; }
  [[nodiscard]] std::uint64_t size_bytes() const { return source_->size(); }
  [[nodiscard]] std::uint64_t position_bytes() const { return position_; }  ///< for progress
  /// A compression that this reader does not have; empty: none was found.
  [[nodiscard]] const std::string& unknown_compression() const { return unknown_compression_; }

 private:
  explicit Reader(std::unique_ptr<ByteSource> source) : source_(std::move(source)) {}

  enum class Step { kMessage, kOther, kEnd };

  Step read_record(Message* message);
  bool read_content(std::uint64_t bytes);
  bool skip_content(std::uint64_t bytes);
  void open_chunk();
  bool next_in_chunk(Message* message);
  bool take_message(const std::uint8_t* data, std::size_t size, Message* message);
  void take_definition(Opcode opcode, const std::uint8_t* data, std::size_t size);

  std::unique_ptr<ByteSource> source_;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;  // of the bytes so far
  std::string profile_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::map<std::string, TextMap> metadata_;
  std::string unknown_compression_;
  ReaderHealth health_;

  std::vector<std::uint8_t> content_;  // of the current record
  std::vector<std::uint8_t> chunk_;    // decompressed records of the current chunk
  std::size_t chunk_at_ = 0;
};

}  // namespace rcs::mcap
