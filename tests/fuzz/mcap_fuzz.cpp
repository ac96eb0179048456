// libFuzzer: the bytes as an MCAP file. Each message is converted to LCM or rejected.

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <string>

#include "lcmtypes/channel_types.h"
#include "rcs/cdr/cdr_message.h"
#include "rcs/ros2/schema.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/random_message.h"
#include "tools/mcap/log_import.h"
#include "tools/mcap/mcap_reader.h"
#include "tools/mcap/mcap_writer.h"

namespace {

using rcs::test::Bytes;

class MemorySource final : public rcs::mcap::ByteSource {
 public:
  MemorySource(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] bool read(std::uint64_t at, std::size_t n, std::uint8_t* out) override {
    RCS_CHECK(at <= size_ && n <= size_ - at);
    if (n > 0) std::memcpy(out, data_ + at, n);
    return true;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

class MemorySink final : public rcs::mcap::ByteSink {
 public:
  rcs::Outcome append(const std::uint8_t* data, std::size_t size) override {
    bytes.insert(bytes.end(), data, data + size);
    return rcs::Done{};
  }
  Bytes bytes;
};

/// A message on every channel.
Bytes file(rcs::mcap::Compression compression) {
  MemorySink sink;
  rcs::mcap::WriterOptions options;
  options.compression = compression;
  options.chunk_bytes = 2000;
  rcs::mcap::Writer writer(options, &sink);
  writer.add_metadata("clocks", {{"offset", "0"}});
  Bytes cdr;
  for (const rcs::channel::Info& c : rcs::channel::kAll) {
    rcs::channel::with_type_of(c.name, [&](const auto* type) {
      using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
      rcs::cdr::write_message(rcs::test::RandomMessage(1).make<T>(), &cdr);
      const std::uint16_t schema = writer.add_schema(rcs::ros2::schema_of<T>().name, "ros2msg", "");
      const std::uint16_t channel =
          writer.add_channel(schema, std::string("/rcs/") + c.name, "cdr", {});
      writer.write(channel, 1, 1000, cdr.data(), cdr.size());
    });
  }
  RCS_CHECK(writer.finish().ok());
  return sink.bytes;
}

std::vector<Bytes> seeds() {
  return rcs::test::spoil(
      {file(rcs::mcap::Compression::kNone), file(rcs::mcap::Compression::kZstd)});
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  rcs::Result<rcs::mcap::Reader> reader =
      rcs::mcap::Reader::open(std::make_unique<MemorySource>(data, size));
  if (!reader) return 0;
  rcs::mcap::Message message;
  Bytes lcm;
  while (reader->next(&message)) {
    const rcs::mcap::Channel* channel = reader->channel(message.channel_id);
    RCS_CHECK(channel != nullptr);
    const std::string name = channel->topic.substr(std::min<std::size_t>(5, channel->topic.size()));
    (void)rcs::mcap::to_lcm(name, message.data, message.size, &lcm);
  }
  return 0;
}
