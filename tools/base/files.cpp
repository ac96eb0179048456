#include "tools/base/files.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <set>
#include <utility>

#include "rcs/base/exit_status.h"
#include "rcs/base/regular_file.h"

namespace rcs::tools {
namespace {

namespace fs = std::filesystem;

/// Device and inode.
using FileId = std::pair<dev_t, ino_t>;

struct Inputs {
  std::mutex mutex;  // drives of a campaign run in parallel
  std::set<FileId> ids;
};
Inputs& inputs() {
  static Inputs all;
  return all;
}

/// Existing temporaries, in a form that a signal handler may read. More than any command uses.
std::array<std::atomic<const char*>, 64> temporaries{};

void exchange_temporary(const char* from, const char* to) {
  for (std::atomic<const char*>& place : temporaries) {
    const char* expected = from;
    if (place.compare_exchange_strong(expected, to)) return;
  }
}

std::string end_of_temporary() { return fmt::format(".{}.partial", ::getpid()); }

/// The temporary of an OutputFile: a command may read back what it has written.
bool is_temporary(const std::string& path) {
  const std::string end = end_of_temporary();
  return path.size() > end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
}

extern "C" void on_kill(int signal) {
  for (const std::atomic<const char*>& place : temporaries) {
    if (const char* path = place.load(); path != nullptr) ::unlink(path);
  }
  if (signal == SIGHUP) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  constexpr std::string_view kMessage = "rcs: interrupted\n";
  (void)!::write(STDERR_FILENO, kMessage.data(), kMessage.size());
  ::_exit(kExitInterrupted);
}

Error file_error(std::string_view path, std::string_view what) {
  return {fmt::format("{}: {}: {}", path, what, std::strerror(errno))};
}

/// The path with symbolic links resolved, also if the target does not exist yet.
fs::path without_links(fs::path path) {
  constexpr int kMaxLinks = 40;  // as many as the system follows
  std::error_code error;
  for (int k = 0; k < kMaxLinks && fs::is_symlink(path, error); ++k) {
    path =
        path.parent_path() / fs::read_symlink(path, error);  // an absolute target replaces the path
  }
  return path;
}

/// The folder of the a priori map that contains `path`; empty: none.
fs::path map_around(const std::string& path) {
  std::error_code error;
  fs::path at = fs::weakly_canonical(fs::absolute(without_links(path), error), error);
  if (!at.has_filename()) at = at.parent_path();  // "folder/"
  while (at.has_relative_path()) {
    at = at.parent_path();
    if (fs::exists(at / "map.index", error)) return at;
  }
  return {};
}

}  // namespace

void note_input(const std::string& path) {
  if (is_temporary(path)) return;
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return;
  if (!S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)) return;
  const std::lock_guard<std::mutex> lock(inputs().mutex);
  inputs().ids.insert({status.st_dev, status.st_ino});
}

Outcome check_output(const std::string& path) {
  if (const fs::path map = map_around(path); !map.empty()) {
    return Error{fmt::format("{}: is in the a priori map {}, which must not be written to", path,
                             map.string())};
  }
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return Done{};
  const std::lock_guard<std::mutex> lock(inputs().mutex);
  if (inputs().ids.count({status.st_dev, status.st_ino}) == 0) return Done{};
  return Error{path + ": is also an input of this command: not written"};
}

void remove_temporaries_when_killed() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // nohup ignores SIGHUP, and a shell ignores SIGINT for background processes.
    if (std::signal(signal, on_kill) == SIG_IGN) std::signal(signal, SIG_IGN);
  }
}

Result<std::string> read_text(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return file_error(path, "cannot open");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  if (file.bad()) return file_error(path, "cannot read");
  return text;
}

Result<std::vector<std::uint8_t>> read_bytes(const std::string& path) {
  const Result<std::string> text = read_text(path);
  if (!text) return text.error();
  return std::vector<std::uint8_t>(text->begin(), text->end());
}

OutputFile::OutputFile(std::string path) : path_(std::move(path)), target_(path_) {
  std::error_code ignored;  // creating the file reports the problem
  const fs::file_status there = fs::status(path_, ignored);
  in_place_ = fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there);
  if (in_place_) {
    write_path_ = path_;
    return;
  }
  target_ = without_links(path_).string();
  const fs::path folder = fs::path(target_).parent_path();
  if (!folder.empty()) fs::create_directories(folder, ignored);
  write_path_ = target_ + end_of_temporary();
  exchange_temporary(nullptr, write_path_.c_str());
}

OutputFile::~OutputFile() {
  if (in_place_) return;
  std::remove(write_path_.c_str());
  exchange_temporary(write_path_.c_str(), nullptr);
}

Outcome OutputFile::write(std::string_view text) const {
  if (Outcome checked = check(); !checked) return checked;
  std::ofstream file(write_path_, std::ios::binary);
  if (!file) return file_error(path_, "cannot create");
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  file.close();
  return file ? Outcome(Done{}) : file_error(path_, "cannot write");
}

Outcome OutputFile::check() const {
  std::error_code error;
  if (fs::is_directory(target_, error)) {
    return Error{path_ + ": is a folder; the output is a file"};
  }
  const fs::path folder = fs::path(target_).parent_path();
  error.clear();
  if (!in_place_ && !folder.empty()) fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: cannot create its folder: {}", path_, error.message())};
  return check_output(target_);
}

Outcome OutputFile::commit() const {
  if (in_place_) return Done{};
  if (Outcome checked = check(); !checked) return checked;
  struct stat before {};
  if (::stat(target_.c_str(), &before) == 0) ::chmod(write_path_.c_str(), before.st_mode & 07777U);
  if (std::rename(write_path_.c_str(), target_.c_str()) != 0) {
    return file_error(path_, "cannot move the finished file there");
  }
  // Its number may be that of an input that was removed, e.g. of a temporary configuration.
  struct stat written {};
  if (::stat(target_.c_str(), &written) == 0) {
    const std::lock_guard<std::mutex> lock(inputs().mutex);
    inputs().ids.erase({written.st_dev, written.st_ino});
  }
  return Done{};
}

Outcome write_text(const std::string& path, std::string_view text) {
  const OutputFile out(path);
  const Outcome written = out.write(text);
  return written ? out.commit() : written;
}

}  // namespace rcs::tools
