// libFuzzer: the bytes as an LCM event log. The reader must end and account for every byte; the
// time of a replay must not jump for any stamps.

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>

#include "lcmtypes/channels.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/log/log_source.h"
#include "tests/fuzz/seeds.h"

namespace {

using rcs::test::Bytes;

constexpr std::size_t kHeader = 28;

/// A file in memory with a path that can be opened.
class MemoryFile {
 public:
  MemoryFile() : fd_(memfd_create("log", 0)) { RCS_CHECK(fd_ >= 0); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(fd_); }
  void write(const std::uint8_t* data, std::size_t size) const {
    RCS_CHECK(::write(fd_, data, size) == static_cast<ssize_t>(size));
  }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

/// The first messages of a drive.
Bytes short_log() {
  class Recorder final : public rcs::BusTap {
   public:
    explicit Recorder(rcs::LogWriter* log) : log_(*log) {}
    void on_deliver(rcs::Stamp due, std::string_view channel, const std::uint8_t* data,
                    std::size_t size) override {
      if (log_.events() < 40) RCS_CHECK(log_.write(due, channel, data, size).ok());
    }

   private:
    rcs::LogWriter& log_;
  };
  const MemoryFile file;
  rcs::Result<rcs::LogWriter> log = rcs::LogWriter::create(file.path());
  RCS_CHECK(log.ok());
  Recorder recorder(&log.value());
  rcs::test::hostile_drive("", {}, &recorder);
  RCS_CHECK(log->close().ok());
  std::ifstream in(file.path(), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<Bytes> seeds() { return rcs::test::spoil({short_log()}); }

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  return rcs::test::write_seeds(*argc, *argv, seeds);
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file;
  file.write(data, size);
  rcs::Result<rcs::LogReader> reader = rcs::LogReader::open(file.path());
  if (!reader) return 0;
  rcs::LogEvent event;
  std::size_t read = 0;
  while (reader->next(&event)) read += kHeader + event.channel.size() + event.data.size();
  RCS_CHECK(read + static_cast<std::size_t>(reader->health().skipped_bytes) == size);

  reader->rewind();
  rcs::LogSource source(&reader.value(), {rcs::channel::kIns, rcs::channel::kGpsFix});
  rcs::SourceEvent out;
  for (rcs::Stamp now = source.peek(); source.peek() != rcs::Stamp::max(); now = source.peek()) {
    source.take(&out);
    if (source.peek() == rcs::Stamp::max()) break;
    RCS_CHECK(source.peek() <= now + rcs::LogSource::kMaxAhead &&
              source.peek() >= now - rcs::LogSource::kMaxBack);
  }
  return 0;
}
