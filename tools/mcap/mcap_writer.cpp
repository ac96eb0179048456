#include "tools/mcap/mcap_writer.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "rcs/base/byte_codec.h"
#include "rcs/base/check.h"

namespace rcs::mcap {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class T>
void put(T value, Bytes* out) {
  const std::size_t at = out->size();
  out->resize(at + sizeof(T));
  wire::put(value, out->data() + at);
}

void put_text(std::string_view text, Bytes* out) {
  put(static_cast<std::uint32_t>(text.size()), out);
  out->insert(out->end(), text.begin(), text.end());
}

/// Appends a record; `content` appends the content, whose length is inserted afterwards.
template <class Content>
void put_record(Opcode opcode, Bytes* out, Content content) {
  out->push_back(static_cast<std::uint8_t>(opcode));
  const std::size_t at = out->size();
  put(std::uint64_t{0}, out);
  content();
  wire::put(static_cast<std::uint64_t>(out->size() - at - 8), out->data() + at);
}

/// Appends an array or a map: its length in bytes and its elements.
template <class Content>
void put_array(Bytes* out, Content content) {
  const std::size_t at = out->size();
  put(std::uint32_t{0}, out);
  content();
  wire::put(static_cast<std::uint32_t>(out->size() - at - 4), out->data() + at);
}

void put_map(const TextMap& values, Bytes* out) {
  put_array(out, [&] {
    for (const auto& [key, value] : values) {
      put_text(key, out);
      put_text(value, out);
    }
  });
}

}  // namespace

void Writer::Span::add(std::uint64_t time_ns) {
  first_ns = messages == 0 ? time_ns : std::min(first_ns, time_ns);
  last_ns = messages == 0 ? time_ns : std::max(last_ns, time_ns);
  ++messages;
}

Writer::Writer(WriterOptions options, ByteSink* sink)
    : options_(std::move(options)), sink_(sink), zstd_(options_.zstd_level) {
  Bytes begin(kMagic.begin(), kMagic.end());
  put_record(Opcode::kHeader, &begin, [&] {
    put_text(options_.profile, &begin);
    put_text(options_.library, &begin);
  });
  emit(begin);
}

std::uint16_t Writer::add_schema(const std::string& name, const std::string& encoding,
                                 const std::string& text) {
  if (schema_count_ == std::numeric_limits<std::uint16_t>::max()) return 0;
  ++schema_count_;
  record_.clear();
  put_record(Opcode::kSchema, &record_, [&] {
    put(schema_count_, &record_);
    put_text(name, &record_);
    put_text(encoding, &record_);
    put_text(text, &record_);
  });
  chunk_.insert(chunk_.end(), record_.begin(), record_.end());
  schemas_.insert(schemas_.end(), record_.begin(), record_.end());
  return schema_count_;
}

std::uint16_t Writer::add_channel(std::uint16_t schema_id, const std::string& topic,
                                  const std::string& message_encoding, const TextMap& metadata) {
  if (channel_messages_.size() == std::numeric_limits<std::uint16_t>::max()) return 0;
  channel_messages_.push_back(0);
  entries_.emplace_back();
  const auto id = static_cast<std::uint16_t>(channel_messages_.size());
  record_.clear();
  put_record(Opcode::kChannel, &record_, [&] {
    put(id, &record_);
    put(schema_id, &record_);
    put_text(topic, &record_);
    put_text(message_encoding, &record_);
    put_map(metadata, &record_);
  });
  chunk_.insert(chunk_.end(), record_.begin(), record_.end());
  channels_.insert(channels_.end(), record_.begin(), record_.end());
  return id;
}

void Writer::add_metadata(const std::string& name, const TextMap& values) {
  end_chunk();
  record_.clear();
  put_record(Opcode::kMetadata, &record_, [&] {
    put_text(name, &record_);
    put_map(values, &record_);
  });
  put_record(Opcode::kMetadataIndex, &metadata_indexes_, [&] {
    put(position_, &metadata_indexes_);
    put(static_cast<std::uint64_t>(record_.size()), &metadata_indexes_);
    put_text(name, &metadata_indexes_);
  });
  ++metadata_count_;
  emit(record_);
}

void Writer::write(std::uint16_t channel_id, std::uint32_t sequence, std::uint64_t time_ns,
                   const std::uint8_t* data, std::size_t size) {
  RCS_CHECK(channel_id > 0 && channel_id <= entries_.size());
  entries_[channel_id - std::size_t{1}].emplace_back(time_ns, chunk_.size());
  put_record(Opcode::kMessage, &chunk_, [&] {
    put(channel_id, &chunk_);
    put(sequence, &chunk_);
    put(time_ns, &chunk_);
    put(time_ns, &chunk_);  // when it was published is not known
    chunk_.insert(chunk_.end(), data, data + size);
  });
  chunk_span_.add(time_ns);
  total_.add(time_ns);
  ++channel_messages_[channel_id - std::size_t{1}];
  if (chunk_.size() >= options_.chunk_bytes) end_chunk();
}

void Writer::emit(const Bytes& bytes) {
  if (!outcome_) return;
  outcome_ = sink_->append(bytes.data(), bytes.size());
  position_ += bytes.size();
  crc_ = crc32(bytes.data(), bytes.size(), crc_);
}

void Writer::end_chunk() {
  if (chunk_.empty()) return;
  const bool compress = options_.compression == Compression::kZstd;
  if (compress) {
    Outcome compressed = zstd_.compress(chunk_, &compressed_);
    if (!compressed && outcome_) outcome_ = compressed;
  }
  const Bytes& records = compress ? compressed_ : chunk_;
  ChunkIndex index;
  index.span = chunk_span_;
  index.start = position_;
  index.bytes = chunk_.size();
  index.compressed_bytes = records.size();
  record_.clear();
  put_record(Opcode::kChunk, &record_, [&] {
    put(chunk_span_.first_ns, &record_);
    put(chunk_span_.last_ns, &record_);
    put(index.bytes, &record_);
    put(crc32(chunk_.data(), chunk_.size()), &record_);
    put_text(name_of(options_.compression), &record_);
    put(index.compressed_bytes, &record_);
    record_.insert(record_.end(), records.begin(), records.end());
  });
  emit(record_);
  index.length = position_ - index.start;
  write_indexes(&index);
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_span_ = {};
}

void Writer::write_indexes(ChunkIndex* index) {
  record_.clear();
  for (std::size_t c = 0; c < entries_.size(); ++c) {
    if (entries_[c].empty()) continue;
    const auto id = static_cast<std::uint16_t>(c + 1);
    index->index_offsets.emplace_back(id, position_ + record_.size());
    put_record(Opcode::kMessageIndex, &record_, [&] {
      put(id, &record_);
      put_array(&record_, [&] {
        for (const auto& [time_ns, offset] : entries_[c]) {
          put(time_ns, &record_);
          put(offset, &record_);
        }
      });
    });
    entries_[c].clear();
  }
  index->index_length = record_.size();
  emit(record_);
}

Writer::Bytes Writer::chunk_indexes() const {
  Bytes out;
  for (const ChunkIndex& c : chunks_) {
    put_record(Opcode::kChunkIndex, &out, [&] {
      put(c.span.first_ns, &out);
      put(c.span.last_ns, &out);
      put(c.start, &out);
      put(c.length, &out);
      put_array(&out, [&] {
        for (const auto& [channel, offset] : c.index_offsets) {
          put(channel, &out);
          put(offset, &out);
        }
      });
      put(c.index_length, &out);
      put_text(name_of(options_.compression), &out);
      put(c.compressed_bytes, &out);
      put(c.bytes, &out);
    });
  }
  return out;
}

Writer::Bytes Writer::statistics() const {
  Bytes out;
  put_record(Opcode::kStatistics, &out, [&] {
    put(total_.messages, &out);
    put(schema_count_, &out);
    put(static_cast<std::uint32_t>(channel_messages_.size()), &out);
    put(std::uint32_t{0}, &out);  // attachments
    put(metadata_count_, &out);
    put(static_cast<std::uint32_t>(chunks_.size()), &out);
    put(total_.first_ns, &out);
    put(total_.last_ns, &out);
    put_array(&out, [&] {
      for (std::size_t c = 0; c < channel_messages_.size(); ++c) {
        put(static_cast<std::uint16_t>(c + 1), &out);
        put(channel_messages_[c], &out);
      }
    });
  });
  return out;
}

/// Appends the records of one opcode, and their place to `offsets`.
void Writer::append_group(Opcode opcode, const Bytes& records, Bytes* summary,
                          Bytes* offsets) const {
  if (records.empty()) return;
  put_record(Opcode::kSummaryOffset, offsets, [&] {
    put(static_cast<std::uint8_t>(opcode), offsets);
    put(position_ + summary->size(), offsets);
    put(static_cast<std::uint64_t>(records.size()), offsets);
  });
  summary->insert(summary->end(), records.begin(), records.end());
}

Outcome Writer::finish() {
  end_chunk();
  Bytes data_end;
  put_record(Opcode::kDataEnd, &data_end, [&] { put(crc_, &data_end); });
  emit(data_end);

  Bytes end;  // summary, summary offsets, footer, magic
  Bytes offsets;
  append_group(Opcode::kSchema, schemas_, &end, &offsets);
  append_group(Opcode::kChannel, channels_, &end, &offsets);
  append_group(Opcode::kStatistics, statistics(), &end, &offsets);
  append_group(Opcode::kMetadataIndex, metadata_indexes_, &end, &offsets);
  append_group(Opcode::kChunkIndex, chunk_indexes(), &end, &offsets);
  const std::uint64_t offset_start = position_ + end.size();
  end.insert(end.end(), offsets.begin(), offsets.end());
  put_record(Opcode::kFooter, &end, [&] {
    put(position_, &end);
    put(offset_start, &end);
    put(std::uint32_t{0}, &end);
  });
  // The checksum, the last 4 bytes of the footer, covers everything in front of it; the length of
  // the footer must be set before.
  const std::size_t crc_at = end.size() - 4;
  wire::put(crc32(end.data(), crc_at), end.data() + crc_at);
  end.insert(end.end(), kMagic.begin(), kMagic.end());
  emit(end);
  return outcome_;
}

}  // namespace rcs::mcap
