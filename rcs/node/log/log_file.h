#pragma once
// LCM event logs: a reader that handles truncated, corrupt and hostile files, and a writer that
// detects a full disk. Format, big-endian: sync 0xEDA1DA01, int64 event number, int64
// timestamp [us], int32 channel length, int32 data length, channel, data.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/file_handle.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs {

struct LogEvent {
  std::int64_t number = 0;
  Stamp stamp;
  std::string channel;
  std::vector<std::uint8_t> data;
};

/// Statistics of a reader so far.
struct LogHealth {
  std::int64_t events = 0;         ///< delivered
  std::int64_t skipped_bytes = 0;  ///< bytes that belong to no readable event
  std::int64_t skips = 0;          ///< number of such places
  bool truncated = false;          ///< the file ends inside an event
  std::string io_error;            ///< error of the operating system; the rest was not read

  [[nodiscard]] bool good() const { return skips == 0 && io_error.empty(); }
  /// One line for people: "1203 events; skipped 88 bytes in 1 place; the file ends inside an
  /// event".
  [[nodiscard]] std::string summary() const;
};

/// Streams through a log of any size. After damage it continues at the next plausible event.
class LogReader {
 public:
  static constexpr std::size_t kMaxChannelBytes = 63;  ///< LCM's own limit
  static constexpr std::size_t kDefaultMaxDataBytes = std::size_t{16} << 20;

  /// @param max_data_bytes  a header with a larger length is treated as damage
  static Result<LogReader> open(const std::string& path,
                                std::size_t max_data_bytes = kDefaultMaxDataBytes);

  /// The next event, in reused buffers; false at the end: then check health().
  [[nodiscard]] bool next(LogEvent* event);
  void rewind();
  /// Continues at the event that begins there, by position_bytes() before it was read.
  void seek(std::int64_t position_bytes) { position_ = position_bytes; }

  [[nodiscard]] const LogHealth& health() const { return health_; }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::int64_t size_bytes() const { return size_; }
  [[nodiscard]] std::int64_t position_bytes() const { return position_; }  ///< for progress

 private:
  struct Header;

  LogReader(FileHandle file, std::string path, std::int64_t size, std::size_t max_data_bytes);
  const std::uint8_t* view(std::int64_t offset, std::size_t bytes);
  bool header_at(std::int64_t offset, Header* header);
  bool begins_event(std::int64_t offset);
  std::int64_t find_event(std::int64_t from, std::int64_t to);
  void skip_to(std::int64_t offset);

  FileHandle file_;
  std::string path_;
  std::int64_t size_ = 0;
  std::size_t max_data_bytes_ = 0;
  std::int64_t position_ = 0;
  std::vector<std::uint8_t> window_;  // of the file, from window_start_
  std::int64_t window_start_ = 0;
  std::size_t window_bytes_ = 0;
  LogHealth health_;
};

/// True if LogReader (with its default limit) returns the event from a log: the channel has 1 to 63
/// printable characters.
[[nodiscard]] bool is_recordable(std::string_view channel, std::size_t data_bytes);

/// Appends the bytes of one event, which must be recordable or have a longer payload, to `out`.
void append_event(std::int64_t number, Stamp stamp, std::string_view channel,
                  const std::uint8_t* data, std::size_t size, std::vector<std::uint8_t>* out);

/// Writes events in the order given. The same calls give the same bytes.
class LogWriter {
 public:
  static Result<LogWriter> create(const std::string& path);
  LogWriter(LogWriter&&) = default;
  LogWriter& operator=(LogWriter&&) = default;
  ~LogWriter();  ///< closes; call close() for the result

  /// The first failure (a full disk) is permanent: nothing more is written, and each call returns
  /// it.
  Outcome write(Stamp stamp, std::string_view channel, const std::uint8_t* data, std::size_t size);
  Outcome close();

  [[nodiscard]] std::int64_t events() const { return events_; }

 private:
  LogWriter(FileHandle file, std::string path);
  Outcome flush();
  Outcome fail(const char* what);

  FileHandle file_;
  std::string path_;
  std::vector<std::uint8_t> buffer_;
  std::int64_t events_ = 0;
  std::string failure_;
};

}  // namespace rcs
