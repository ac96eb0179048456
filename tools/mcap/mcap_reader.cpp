#include "tools/mcap/mcap_reader.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "rcs/base/byte_codec.h"
#include "tools/mcap/compression.h"

namespace rcs::mcap {
namespace {

/// zstd cannot compress to less than 1/2^15: a block of 128 kB needs 4 bytes.
constexpr std::uint64_t kMaxRatio = std::uint64_t{1} << 15;

/// Reads the fields of one record. After its end all reads give zeros, and ok() is false.
class Cursor {
 public:
  Cursor(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {}

  template <class T>
  T number() {
    if (!take(sizeof(T))) return T{};
    return wire::take<T>(at_ - sizeof(T));
  }
  std::string text() {
    const std::size_t n = number<std::uint32_t>();
    if (!take(n)) return {};
    return {reinterpret_cast<const char*>(at_ - n), n};
  }
  TextMap map() {
    const std::size_t n = number<std::uint32_t>();
    if (!take(n)) return {};
    Cursor inside(at_ - n, n);
    TextMap values;
    while (inside.left_ > 0 && inside.ok_) {
      std::string key = inside.text();
      std::string value = inside.text();
      if (inside.ok_) values.emplace(std::move(key), std::move(value));
    }
    ok_ = ok_ && inside.ok_;
    return values;
  }
  [[nodiscard]] const std::uint8_t* rest() const { return at_; }
  [[nodiscard]] std::size_t left() const { return left_; }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  bool take(std::size_t n) {
    if (!ok_ || n > left_) {
      ok_ = false;
      left_ = 0;
      return false;
    }
    at_ += n;
    left_ -= n;
    return true;
  }

  const std::uint8_t* at_;
  std::size_t left_;
  bool ok_ = true;
};

std::string counted(std::uint64_t n, const char* what) {
  return "; " + std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

}  // namespace

std::string ReaderHealth::summary() const {
  std::string text = std::to_string(messages) + (messages == 1 ? " message" : " messages");
  if (damaged_chunks > 0) text += counted(damaged_chunks, "damaged chunk");
  if (lost_records > 0) text += counted(lost_records, "malformed record");
  if (!io_error.empty()) {
    text += "; " + io_error;
  } else if (!complete) {
    text += "; the file is truncated";
  }
  if (checksum_differs) text += "; the checksum of the data section is wrong";
  return text;
}

Result<Reader> Reader::open(std::unique_ptr<ByteSource> source) {
  Reader reader(std::move(source));
  std::array<std::uint8_t, kMagic.size()> magic{};
  if (reader.source_->size() < magic.size()) return Error{"not an MCAP file"};
  if (!reader.source_->read(0, magic.size(), magic.data())) return Error{"cannot read"};
  if (magic != kMagic) {
    const bool other_version = std::equal(magic.begin(), magic.begin() + 5, kMagic.begin());
    return Error{other_version ? "a version of MCAP other than 0" : "not an MCAP file"};
  }
  reader.position_ = magic.size();
  reader.crc_ = crc32(magic.data(), magic.size());
  return reader;
}

bool Reader::next(Message* message) {
  if (next_in_chunk(message)) return true;
  for (;;) {
    switch (read_record(message)) {
      case Step::kMessage:
        return true;
      case Step::kEnd:
        return false;
      case Step::kOther:
        break;
    }
    if (next_in_chunk(message)) return true;
  }
}

const Channel* Reader::channel(std::uint16_t id) const {
  const auto at = channels_.find(id);
  return at == channels_.end() ? nullptr : &at->second;
}

const Schema* Reader::schema(std::uint16_t id) const {
  const auto at = schemas_.find(id);
  return at == schemas_.end() ? nullptr : &at->second;
}

/// Reads the content of a record to content_.
bool Reader::read_content(std::uint64_t bytes) {
  content_.resize(static_cast<std::size_t>(bytes));
  if (!source_->read(position_, content_.size(), content_.data())) {
    health_.io_error = "cannot read";
    return false;
  }
  crc_ = crc32(content_.data(), content_.size(), crc_);
  position_ += bytes;
  return true;
}

/// In pieces: an attachment may be large.
bool Reader::skip_content(std::uint64_t bytes) {
  constexpr std::uint64_t kPiece = 1U << 16;
  for (; bytes > kPiece; bytes -= kPiece) {
    if (!read_content(kPiece)) return false;
  }
  return read_content(bytes);
}

Reader::Step Reader::read_record(Message* message) {
  std::array<std::uint8_t, kRecordHeadBytes> head{};
  if (health_.complete || !health_.io_error.empty()) return Step::kEnd;
  const std::uint64_t left = source_->size() - position_;
  if (left < head.size()) return Step::kEnd;
  if (!source_->read(position_, head.size(), head.data())) {
    health_.io_error = "cannot read";
    return Step::kEnd;
  }
  const auto opcode = static_cast<Opcode>(head[0]);
  const auto bytes = wire::take<std::uint64_t>(head.data() + 1);
  if (bytes > left - head.size()) return Step::kEnd;
  const std::uint32_t crc_before = crc_;
  crc_ = crc32(head.data(), head.size(), crc_);
  position_ += head.size();
  switch (opcode) {
    case Opcode::kHeader:
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMetadata:
      if (!read_content(bytes)) return Step::kEnd;
      take_definition(opcode, content_.data(), content_.size());
      return Step::kOther;
    case Opcode::kMessage:
      if (!read_content(bytes)) return Step::kEnd;
      return take_message(content_.data(), content_.size(), message) ? Step::kMessage
                                                                     : Step::kOther;
    case Opcode::kChunk:
      if (!read_content(bytes)) return Step::kEnd;
      open_chunk();
      return Step::kOther;
    case Opcode::kDataEnd: {
      if (!read_content(bytes)) return Step::kEnd;
      const auto stated = Cursor(content_.data(), content_.size()).number<std::uint32_t>();
      health_.complete = true;
      health_.checksum_differs = stated != 0 && stated != crc_before;
      return Step::kEnd;
    }
    case Opcode::kFooter:
      return Step::kEnd;  // a file without a DataEnd
    default:
      return skip_content(bytes) ? Step::kOther : Step::kEnd;
  }
}

/// From the chunk record in content_.
void Reader::open_chunk() {
  chunk_.clear();
  chunk_at_ = 0;
  Cursor in(content_.data(), content_.size());
  in.number<std::uint64_t>();  // start and end of its messages
  in.number<std::uint64_t>();
  const auto bytes = in.number<std::uint64_t>();
  const auto crc = in.number<std::uint32_t>();
  const std::string compression = in.text();
  const auto stored = in.number<std::uint64_t>();
  bool sound =
      in.ok() && stored == in.left() && bytes <= kMaxChunkBytes && bytes <= stored * kMaxRatio;
  if (sound && compression.empty()) {
    sound = bytes == stored;
    if (sound) chunk_.assign(in.rest(), in.rest() + in.left());
  } else if (sound && compression == name_of(Compression::kZstd)) {
    sound = zstd_decompress(in.rest(), in.left(), static_cast<std::size_t>(bytes), &chunk_);
  } else if (sound) {
    if (unknown_compression_.empty()) unknown_compression_ = compression;
    sound = false;
  }
  if (sound && crc != 0) sound = crc32(chunk_.data(), chunk_.size()) == crc;
  if (!sound) {
    ++health_.damaged_chunks;
    chunk_.clear();
  }
}

bool Reader::next_in_chunk(Message* message) {
  while (chunk_at_ < chunk_.size()) {
    const std::uint8_t* head = chunk_.data() + chunk_at_;
    const std::size_t left = chunk_.size() - chunk_at_;
    const auto bytes =
        left < kRecordHeadBytes ? std::uint64_t{0} : wire::take<std::uint64_t>(head + 1);
    if (left < kRecordHeadBytes || bytes > left - kRecordHeadBytes) {
      ++health_.damaged_chunks;
      chunk_.clear();
      return false;
    }
    const auto size = static_cast<std::size_t>(bytes);
    chunk_at_ += kRecordHeadBytes + size;
    const auto opcode = static_cast<Opcode>(head[0]);
    if (opcode == Opcode::kMessage) {
      if (take_message(head + kRecordHeadBytes, size, message)) return true;
    } else if (opcode == Opcode::kSchema || opcode == Opcode::kChannel) {
      take_definition(opcode, head + kRecordHeadBytes, size);
    }
  }
  return false;
}

bool Reader::take_message(const std::uint8_t* data, std::size_t size, Message* message) {
  Cursor in(data, size);
  message->channel_id = in.number<std::uint16_t>();
  message->sequence = in.number<std::uint32_t>();
  message->log_time_ns = in.number<std::uint64_t>();
  message->publish_time_ns = in.number<std::uint64_t>();
  if (!in.ok() || channels_.count(message->channel_id) == 0) {
    ++health_.lost_records;
    return false;
  }
  message->data = in.rest();
  message->size = in.left();
  ++health_.messages;
  return true;
}

/// A second definition of an id must be the same, so that the first one is kept.
void Reader::take_definition(Opcode opcode, const std::uint8_t* data, std::size_t size) {
  Cursor in(data, size);
  if (opcode == Opcode::kHeader) {
    std::string profile = in.text();
    if (in.ok()) profile_ = std::move(profile);
  } else if (opcode == Opcode::kSchema) {
    Schema s;
    s.id = in.number<std::uint16_t>();
    s.name = in.text();
    s.encoding = in.text();
    s.text = in.text();
    if (in.ok() && s.id != 0) schemas_.emplace(s.id, std::move(s));
  } else if (opcode == Opcode::kChannel) {
    Channel c;
    c.id = in.number<std::uint16_t>();
    c.schema_id = in.number<std::uint16_t>();
    c.topic = in.text();
    c.message_encoding = in.text();
    c.metadata = in.map();
    if (in.ok()) channels_.emplace(c.id, std::move(c));
  } else {
    std::string name = in.text();
    TextMap values = in.map();
    if (in.ok()) metadata_.emplace(std::move(name), std::move(values));
  }
  if (!in.ok()) ++health_.lost_records;
}

}  // namespace rcs::mcap
