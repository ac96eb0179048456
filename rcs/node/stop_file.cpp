#include "rcs/node/stop_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>

#include "rcs/base/durable_folder.h"
#include "rcs/base/file_handle.h"
#include "rcs/node/bus/publisher.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFirstLine =
    "RCS emergency stop: while this file exists, BG does not drive. Release it at rest: rcs go "
    "--release\n";
constexpr std::string_view kStop = "stop ";
constexpr std::string_view kCheck = "check ";
constexpr std::size_t kDigits = 16;

Error failure(std::string_view what, const std::string& path, int code) {
  return {fmt::format("cannot {} {}: {}", what, path, std::strerror(code))};
}

std::string folder_of(const std::string& path) { return fs::path(path).parent_path().string(); }

Outcome make_folder(const std::string& folder) {
  const std::error_code error = make_durable_folder(folder);
  if (error) return failure("create the folder", folder, error.value());
  return Done{};
}

/// Does not wait for the disk: nothing that fails after the removal could put the file back, so the
/// release would have failed for the caller and not for its successor. A power failure within
/// seconds may bring the file back, which is the safe side.
Outcome remove_file(const std::string& path) {
  if (std::remove(path.c_str()) != 0 && errno != ENOENT) return failure("remove", path, errno);
  return Done{};
}

Outcome write_file(const std::string& path, const std::string& text) {
  const std::string folder = folder_of(path);
  if (Outcome made = make_folder(folder); !made) return made;
  const FileHandle file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644));
  if (!file.valid()) return failure("create", path, errno);
  const ssize_t n = write(file.get(), text.data(), text.size());
  if (n < 0) return failure("write", path, errno);
  if (static_cast<std::size_t>(n) < text.size()) return failure("write", path, ENOSPC);
  // Not truncated before: whatever a crash leaves of the old and the new text is a latched stop.
  if (ftruncate(file.get(), n) != 0) return failure("write", path, errno);
  if (fsync(file.get()) != 0) return failure("write", path, errno);
  // The creation of a file is permanent only when its folder is on the disk, too.
  const std::error_code error = sync_folder(folder);
  if (error) return failure("write the folder", folder, error.value());
  return Done{};
}

std::optional<std::uint64_t> hexadecimal(std::string_view text) {
  std::uint64_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, value, 16);
  if (text.size() != kDigits || error != std::errc() || at != end) return std::nullopt;
  return value;
}

/// nullopt: the text is damaged or incomplete.
std::optional<std::vector<stop_t>> stops_of(std::string_view text) {
  std::vector<stop_t> stops;
  if (text.substr(0, kFirstLine.size()) != kFirstLine) return std::nullopt;
  std::size_t begin = kFirstLine.size();
  for (;;) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    if (line.substr(0, kCheck.size()) == kCheck) break;
    if (line.substr(0, kStop.size()) != kStop || line.size() <= kStop.size() + kDigits) {
      return std::nullopt;
    }
    const std::optional<std::uint64_t> id = hexadecimal(line.substr(kStop.size(), kDigits));
    if (!id) return std::nullopt;
    stops.push_back(
        {static_cast<std::int64_t>(*id), std::string(line.substr(kStop.size() + kDigits + 1))});
  }
  // The check covers what a line by itself cannot show: parts of two texts.
  if (stops.empty() || text != stop_file_text(stops)) return std::nullopt;
  return stops;
}

}  // namespace

std::string printable_name(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

std::string stop_file_text(const std::vector<stop_t>& stops) {
  std::string text(kFirstLine);
  for (const stop_t& s : stops) {
    fmt::format_to(std::back_inserter(text), "{}{:016x} {}\n", kStop,
                   static_cast<std::uint64_t>(s.id), s.issuer);
  }
  const auto check = static_cast<std::uint64_t>(id_of(text));
  return text + fmt::format("{}{:016x}\n", kCheck, check);
}

LatchedStops read_stop_file(const std::string& path) {
  const auto nameless = [](std::string damage) {
    return LatchedStops{{stop_t{}}, std::move(damage)};
  };
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) {
    if (errno == ENOENT) return {};
    return nameless(fmt::format("{} cannot be examined: {}", path, std::strerror(errno)));
  }
  if (!S_ISREG(status.st_mode)) return nameless(fmt::format("{} is not a regular file", path));
  const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  std::array<char, 4096> bytes{};
  const ssize_t n = file.valid() ? read(file.get(), bytes.data(), bytes.size()) : -1;
  if (n < 0) return nameless(fmt::format("{} cannot be read: {}", path, std::strerror(errno)));
  const std::string_view text(bytes.data(), static_cast<std::size_t>(n));
  std::optional<std::vector<stop_t>> stops = stops_of(text);
  if (stops) return {std::move(*stops), ""};
  return nameless(fmt::format("{} exists, but its content is invalid or incomplete", path));
}

Outcome execute(const StopJob& job) {
  if (job.text.empty()) return remove_file(job.path);
  struct stat status {};
  if (job.only_if_missing && lstat(job.path.c_str(), &status) == 0) return Done{};
  return write_file(job.path, job.text);
}

Outcome check_stop_folder(const std::string& path) {
  if (Outcome made = make_folder(folder_of(path)); !made) return made;
  // An existing folder may be without write permission.
  return examine_stop_folder(path);
}

Outcome examine_stop_folder(const std::string& path) {
  const std::string folder = folder_of(path);
  std::error_code error;
  // The folder, or the one in which it would be created.
  fs::path existing = fs::absolute(folder, error);
  while (access(existing.c_str(), F_OK) != 0 && errno == ENOENT && existing.has_relative_path()) {
    existing = existing.parent_path();
  }
  if (!fs::is_directory(existing, error)) {
    return failure("write to the folder", folder, error ? error.value() : ENOTDIR);
  }
  if (access(existing.c_str(), W_OK | X_OK) != 0) {
    return failure("write to the folder", folder, errno);
  }
  return Done{};
}

// A file that cannot be opened was not made by a latch.
bool sync_stop_file(const std::string& path) {
  const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.valid() && fsync(file.get()) != 0 && errno != EINVAL) return false;
  return !sync_folder(folder_of(path));
}

}  // namespace rcs
