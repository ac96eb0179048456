#include "rcs/node/log/log_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <limits>

#include "rcs/base/input_files.h"

namespace rcs {
namespace {

constexpr std::array<std::uint8_t, 4> kSync{0xED, 0xA1, 0xDA, 0x01};
constexpr std::size_t kHeaderBytes = 28;
constexpr std::size_t kWindowBytes = std::size_t{1} << 20;
constexpr std::size_t kScanBytes = std::size_t{64} << 10;
/// About 36,000 years: later stamps are treated as damage, and arithmetic on earlier ones cannot
/// overflow.
constexpr std::int64_t kMaxUtime = std::int64_t{1} << 60;

template <class T>
T load_big_endian(const std::uint8_t* p) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) value = value << 8 | p[i];
  return static_cast<T>(value);
}

template <class T>
void append_big_endian(T value, std::vector<std::uint8_t>* out) {
  for (std::size_t i = sizeof(T); i-- > 0;) {
    out->push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i)));
  }
}

/// @param text  bytes, of a file or of a string
template <class Byte>
bool printable(const Byte* text, std::size_t size) {
  return std::all_of(text, text + size, [](Byte c) { return c > 0x20 && c < 0x7f; });
}

Error file_error(const std::string& path, const char* what, int error_number) {
  return {fmt::format("{}: {}: {}", path, what, std::strerror(error_number))};
}

}  // namespace

std::string LogHealth::summary() const {
  std::string text = fmt::format("{} events", events);
  if (skips > 0) {
    text += fmt::format("; skipped {} unreadable bytes in {} place{}", skipped_bytes, skips,
                        skips == 1 ? "" : "s");
  }
  if (truncated) text += "; the file ends inside an event (truncated)";
  if (!io_error.empty()) text += "; stopped: " + io_error;
  return text;
}

struct LogReader::Header {
  std::int64_t number = 0;
  std::int64_t utime = 0;
  std::size_t channel_bytes = 0;
  std::size_t data_bytes = 0;

  [[nodiscard]] std::int64_t event_bytes() const {
    return static_cast<std::int64_t>(kHeaderBytes + channel_bytes + data_bytes);
  }
};

LogReader::LogReader(FileHandle file, std::string path, std::int64_t size,
                     std::size_t max_data_bytes)
    : file_(std::move(file)),
      path_(std::move(path)),
      size_(size),
      max_data_bytes_(max_data_bytes) {}

namespace {

/// Fingerprints of the message revision without run and publisher ids (ADR 65).
constexpr std::uint64_t kFormerFingerprints[] = {
    0xc8b13fcbebb56923ULL,  // ladar_ranges_t
    0xe4075d478e63a9eaULL,  // ladar_points_t
    0x71754f31a5a8fdb7ULL,  // ins_t
    0x5d2524ab615a94c3ULL,  // gps_fix_t
    0xb44ced651c390e45ULL,  // odometry_t
    0xba81c655a0fc6544ULL,  // registration_t
    0x2bf8605f572c5ddbULL,  // nav_state_t
    0xbcfb448c1ed53470ULL,  // truth_t
};
constexpr int kEventsLookedAt = 64;

bool is_of_former_revision(const LogEvent& event) {
  if (event.data.size() < sizeof(std::uint64_t)) return false;
  std::uint64_t fingerprint = 0;
  for (std::size_t i = 0; i < sizeof(fingerprint); ++i) {
    fingerprint = fingerprint << 8U | event.data[i];
  }
  return std::find(std::begin(kFormerFingerprints), std::end(kFormerFingerprints), fingerprint) !=
         std::end(kFormerFingerprints);
}

}  // namespace

Result<LogReader> LogReader::open(const std::string& path, std::size_t max_data_bytes) {
  // O_NONBLOCK: opening a FIFO would wait for its writer.
  FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file.valid()) return file_error(path, "cannot open the log", errno);
  struct stat status {};
  if (fstat(file.get(), &status) != 0) return file_error(path, "cannot open the log", errno);
  if (!S_ISREG(status.st_mode)) return Error{path + ": not a log: not a regular file"};
  report_input(path);
  LogReader reader(std::move(file), path, status.st_size, max_data_bytes);
  LogEvent event;
  for (int k = 0; k < kEventsLookedAt && reader.next(&event); ++k) {
    if (!is_of_former_revision(event)) continue;
    return Error{path + ": recorded with a former revision of the messages (" + event.channel +
                 "), which this version cannot read: record, simulate or import it again"};
  }
  reader.rewind();
  return reader;
}

void LogReader::rewind() {
  position_ = 0;
  health_ = {};
}

/// `bytes` contiguous bytes of the file, or null at its end or after a read error.
const std::uint8_t* LogReader::view(std::int64_t offset, std::size_t bytes) {
  if (!health_.io_error.empty() || offset + static_cast<std::int64_t>(bytes) > size_) {
    return nullptr;
  }
  const std::int64_t skip = offset - window_start_;
  if (skip >= 0 &&
      skip + static_cast<std::int64_t>(bytes) <= static_cast<std::int64_t>(window_bytes_)) {
    return window_.data() + skip;
  }
  window_.resize(std::max({bytes, window_.size(), kWindowBytes}));
  window_start_ = offset;
  window_bytes_ = 0;
  while (window_bytes_ < bytes) {
    const ssize_t n =
        pread(file_.get(), window_.data() + window_bytes_, window_.size() - window_bytes_,
              offset + static_cast<std::int64_t>(window_bytes_));
    if (n > 0) {
      window_bytes_ += static_cast<std::size_t>(n);
    } else if (n == 0 || errno != EINTR) {
      health_.io_error = n == 0 ? "the file was truncated while it was read"
                                : fmt::format("read error: {}", std::strerror(errno));
      return nullptr;
    }
  }
  return window_.data();
}

/// True if the bytes at `offset`, possibly truncated or none, can begin an event.
bool LogReader::begins_event(std::int64_t offset) {
  const std::int64_t left = std::min(size_ - offset, static_cast<std::int64_t>(kSync.size()));
  const std::uint8_t* p = view(offset, static_cast<std::size_t>(left));
  return p != nullptr && std::equal(p, p + left, kSync.begin());
}

/// True if a plausible event header begins at `offset`.
bool LogReader::header_at(std::int64_t offset, Header* header) {
  const std::uint8_t* p = view(offset, kHeaderBytes);
  if (p == nullptr || !std::equal(kSync.begin(), kSync.end(), p)) return false;
  const auto channel_bytes = load_big_endian<std::int32_t>(p + 20);
  const auto data_bytes = load_big_endian<std::int32_t>(p + 24);
  header->number = load_big_endian<std::int64_t>(p + 4);
  header->utime = load_big_endian<std::int64_t>(p + 12);
  if (channel_bytes < 1 || data_bytes < 0 || header->utime < 0 || header->utime > kMaxUtime) {
    return false;
  }
  header->channel_bytes = static_cast<std::size_t>(channel_bytes);
  header->data_bytes = static_cast<std::size_t>(data_bytes);
  if (header->channel_bytes > kMaxChannelBytes) return false;
  if (header->data_bytes > max_data_bytes_) return false;
  const std::uint8_t* channel =
      view(offset + static_cast<std::int64_t>(kHeaderBytes), header->channel_bytes);
  return channel == nullptr || printable(channel, header->channel_bytes);
}

/// The first plausible header in [from, to), or `to`.
std::int64_t LogReader::find_event(std::int64_t from, std::int64_t to) {
  while (from < to) {
    const std::size_t bytes =
        static_cast<std::size_t>(std::min(static_cast<std::int64_t>(kScanBytes), to - from));
    const std::uint8_t* p = view(from, bytes);
    if (p == nullptr) return to;
    const void* hit = std::memchr(p, kSync.front(), bytes);
    if (hit == nullptr) {
      from += static_cast<std::int64_t>(bytes);
      continue;
    }
    from += static_cast<const std::uint8_t*>(hit) - p;
    Header header;
    if (header_at(from, &header)) return from;
    ++from;
  }
  return to;
}

void LogReader::skip_to(std::int64_t offset) {
  health_.skipped_bytes += offset - position_;
  ++health_.skips;
  position_ = offset;
}

bool LogReader::next(LogEvent* event) {
  while (position_ < size_ && health_.io_error.empty()) {
    Header header;
    if (!header_at(position_, &header)) {
      if (size_ - position_ < static_cast<std::int64_t>(kHeaderBytes)) {
        health_.truncated = begins_event(position_);
        skip_to(size_);
      } else {
        skip_to(find_event(position_ + 1, size_));
      }
      continue;
    }
    const std::int64_t end = position_ + header.event_bytes();
    if (end > size_ || !begins_event(end)) {
      // Either the lengths of this header are wrong, and another event begins within its claimed
      // extent; or they are right, and the bytes after it are damaged or missing.
      const std::int64_t claimed_end = std::min(end, size_);
      const std::int64_t inside = find_event(position_ + 1, claimed_end);
      if (inside < claimed_end || end > size_) {
        health_.truncated = inside == claimed_end;
        skip_to(inside);
        continue;
      }
    }
    const std::uint8_t* p = view(position_, static_cast<std::size_t>(header.event_bytes()));
    if (p == nullptr) break;
    const std::uint8_t* channel = p + kHeaderBytes;
    const std::uint8_t* data = channel + header.channel_bytes;
    event->number = header.number;
    event->stamp = from_utime(header.utime);
    event->channel.assign(reinterpret_cast<const char*>(channel), header.channel_bytes);
    event->data.assign(data, data + header.data_bytes);
    position_ = end;
    ++health_.events;
    return true;
  }
  return false;
}

bool is_recordable(std::string_view channel, std::size_t data_bytes) {
  return !channel.empty() && channel.size() <= LogReader::kMaxChannelBytes &&
         printable(channel.data(), channel.size()) && data_bytes <= LogReader::kDefaultMaxDataBytes;
}

void append_event(std::int64_t number, Stamp stamp, std::string_view channel,
                  const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>* out) {
  RCS_CHECK(!channel.empty() && channel.size() <= LogReader::kMaxChannelBytes &&
            size <= static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()));
  out->insert(out->end(), kSync.begin(), kSync.end());
  append_big_endian(number, out);
  append_big_endian(to_utime(stamp), out);
  append_big_endian(static_cast<std::int32_t>(channel.size()), out);
  append_big_endian(static_cast<std::int32_t>(size), out);
  out->insert(out->end(), channel.begin(), channel.end());
  out->insert(out->end(), data, data + size);
}

LogWriter::LogWriter(FileHandle file, std::string path)
    : file_(std::move(file)), path_(std::move(path)) {
  buffer_.reserve(kWindowBytes);
}

Result<LogWriter> LogWriter::create(const std::string& path) {
  FileHandle file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!file.valid()) return file_error(path, "cannot create the log", errno);
  return LogWriter(std::move(file), path);
}

LogWriter::~LogWriter() {
  if (file_.valid()) (void)close();
}

Outcome LogWriter::fail(const char* what) {
  failure_ = file_error(path_, what, errno).message;
  return Error{failure_};
}

Outcome LogWriter::write(Stamp stamp, std::string_view channel, const std::uint8_t* data,
                         std::size_t size) {
  if (!failure_.empty()) return Error{failure_};
  append_event(events_++, stamp, channel, data, size, &buffer_);
  return buffer_.size() < kWindowBytes / 2 ? Outcome(Done{}) : flush();
}

Outcome LogWriter::flush() {
  std::size_t written = 0;
  while (written < buffer_.size()) {
    const ssize_t n = ::write(file_.get(), buffer_.data() + written, buffer_.size() - written);
    if (n >= 0) {
      written += static_cast<std::size_t>(n);
    } else if (errno != EINTR) {
      return fail("cannot write the log");
    }
  }
  buffer_.clear();
  return Done{};
}

Outcome LogWriter::close() {
  if (failure_.empty() && file_.valid()) {
    (void)flush();
    if (file_.close() != 0 && failure_.empty()) return fail("cannot close the log");
  }
  return failure_.empty() ? Outcome(Done{}) : Outcome(Error{failure_});
}

}  // namespace rcs
