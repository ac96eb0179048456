#include "rcs/node/stop_latch.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

#include "rcs/base/file_handle.h"
#include "rcs/node/process/process.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFirstLine = "RCS emergency stop: vehicle stopped by ";

Error failure(std::string_view what, const std::string& path, int code) {
  return {fmt::format("cannot {} {}: {}", what, path, std::strerror(code))};
}

std::string folder_of(const std::string& path) { return fs::path(path).parent_path().string(); }

Outcome make_folder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return failure("create the folder", folder, error.value());
  return Done{};
}

/// The creation or removal of a file is permanent only when its folder is on the disk, too.
Outcome sync_folder(const std::string& folder) {
  const FileHandle handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!handle.valid()) return failure("open the folder", folder, errno);
  if (fsync(handle.get()) != 0) return failure("write the folder", folder, errno);
  return Done{};
}

/// @return the file at `path` is on the disk; a file that cannot be opened was not made by a latch
bool sync_existing(const std::string& path) {
  const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.valid() && fsync(file.get()) != 0 && errno != EINVAL) return false;
  return sync_folder(folder_of(path)).ok();
}

/// Names come from the bus and are printed on terminals.
std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

/// Cause of the stop latched at `path`; empty: not latched.
std::string cause_at(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) {
    if (errno == ENOENT) return "";
    return fmt::format("{} cannot be examined: {}", path, std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) return fmt::format("{} is not a regular file", path);
  const FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!file.valid()) return fmt::format("{} cannot be read: {}", path, std::strerror(errno));
  std::array<char, 512> bytes{};
  const ssize_t n = read(file.get(), bytes.data(), bytes.size());
  if (n < 0) return fmt::format("{} cannot be read: {}", path, std::strerror(errno));
  const std::string_view text(bytes.data(), static_cast<std::size_t>(n));
  const std::size_t end = text.find('\n');
  if (text.substr(0, kFirstLine.size()) != kFirstLine || end == std::string_view::npos) {
    return fmt::format("{} exists, but its content is invalid or incomplete", path);
  }
  return printable(std::string(text.substr(kFirstLine.size(), end - kFirstLine.size())));
}

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

/// Value of an environment variable; empty if it is not set.
std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): at the start
  return value == nullptr ? "" : value;
}

/// A relative folder would depend on the working directory: treated as not set.
std::string folder_variable(const char* name) {
  std::string value = variable(name);
  return fs::path(value).is_absolute() ? value : "";
}

std::string default_folder() {
  if (const std::string given = folder_variable("STATE_DIRECTORY"); !given.empty()) {
    return given.substr(0, given.find(':'));  // systemd separates several by colons
  }
  if (const std::string given = folder_variable("XDG_STATE_HOME"); !given.empty()) {
    return given + "/rcs";
  }
  if (const std::string home = folder_variable("HOME"); !home.empty()) {
    return home + "/.local/state/rcs";
  }
  return "";
}

}  // namespace

Result<StopLatch> StopLatch::open(const std::string& path) {
  const std::string folder = folder_of(path);
  if (const Outcome made = make_folder(folder); !made) return made.error();
  // fs::create_directories() accepts an existing folder without write permission.
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    return failure("write to the folder", folder, errno);
  }
  StopLatch latch;
  latch.path_ = path;
  latch.cause_ = cause_at(path);
  latch.engaged_ = !latch.cause_.empty();
  // The previous process may have been killed before the file was on the disk.
  if (latch.engaged_) latch.persisted_ = sync_existing(path);
  return latch;
}

void StopLatch::engage(const command_t& stop) {
  if (engaged_) {
    struct stat status {};
    if (!path_.empty() && lstat(path_.c_str(), &status) != 0) persisted_ = false;
    return;
  }
  engaged_ = true;
  persisted_ = false;
  cause_ = fmt::format("{}, serial {}", printable(stop.issuer), stop.serial);
}

Outcome StopLatch::persist() {
  if (persisted()) return Done{};
  const std::string folder = folder_of(path_);
  if (Outcome made = make_folder(folder); !made) return made;
  const FileHandle file(
      ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0644));
  if (!file.valid()) return failure("create", path_, errno);
  const std::string content = fmt::format(
      "{}{}\nWhile this file exists, BG does not drive. Release it at rest: rcs go --release\n",
      kFirstLine, cause_);
  const ssize_t n = write(file.get(), content.data(), content.size());
  if (n < 0) return failure("write", path_, errno);
  if (static_cast<std::size_t>(n) < content.size()) return failure("write", path_, ENOSPC);
  if (fsync(file.get()) != 0) return failure("write", path_, errno);
  if (Outcome synced = sync_folder(folder); !synced) return synced;
  persisted_ = true;
  return Done{};
}

Outcome StopLatch::release() {
  if (!engaged_) return Done{};
  if (!path_.empty()) {
    const std::string folder = folder_of(path_);
    if (std::remove(path_.c_str()) != 0 && errno != ENOENT) return failure("remove", path_, errno);
    persisted_ = false;  // unknown until the folder is on the disk
    if (Outcome made = make_folder(folder); !made) return made;
    if (Outcome synced = sync_folder(folder); !synced) return synced;
  }
  engaged_ = false;
  cause_.clear();
  return Done{};
}

Result<std::string> state_folder(const ParamFile& file) {
  const Result<ProcessTables> tables = read_process_tables(file);
  if (!tables) return tables.error();
  const std::string& key = tables->state_directory;
  return key.empty() ? default_folder() : file.resolve(key);
}

Result<StopLatch> open_stop_latch(const ParamFile& file) {
  const Result<std::string> state = state_folder(file);
  if (!state) return state.error();
  const std::string& folder = *state;
  if (folder.empty()) {
    return Error{fmt::format(
        "{}: no folder to latch emergency stops in: set [process] state_directory, or one of "
        "STATE_DIRECTORY, XDG_STATE_HOME and HOME",
        file.name())};
  }
  // The folder of the configuration with links resolved, its name as given: a link that is set to
  // another version of the vehicle's configuration does not lose the vehicle's stop.
  std::error_code error;
  const fs::path given(file.name());
  const fs::path parent = fs::weakly_canonical(fs::absolute(given, error).parent_path(), error);
  const std::string config = (parent / given.filename()).string();
  const fs::path name = fmt::format("{}-{:016x}.stop", given.stem().string(), fnv1a(config));
  Result<StopLatch> latch = StopLatch::open((folder / name).string());
  if (latch) return latch;
  return Error{
      fmt::format("{}; emergency stops are latched there: set [process] state_directory in {}",
                  latch.error().message, file.name())};
}

}  // namespace rcs
