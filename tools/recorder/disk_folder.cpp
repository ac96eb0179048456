#include "tools/recorder/disk_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <system_error>
#include <vector>

#include "rcs/base/durable_folder.h"

namespace rcs::recorder {
namespace {

class DiskFile final : public AppendFile {
 public:
  explicit DiskFile(FileHandle file) : file_(std::move(file)) {}

  [[nodiscard]] int append(const std::uint8_t* data, std::size_t size,
                           std::size_t* written) override {
    *written = 0;
    ssize_t n = -1;
    do {
      n = ::write(file_.get(), data, size);
    } while (n < 0 && errno == EINTR);
    if (n < 0) return errno;
    *written = static_cast<std::size_t>(n);
    return 0;
  }
  [[nodiscard]] int sync() override { return fdatasync(file_.get()) == 0 ? 0 : errno; }

 private:
  FileHandle file_;
};

struct CloseDirectory {
  void operator()(DIR* directory) const { (void)closedir(directory); }
};

Error folder_error(const std::string& path, int code) {
  return {fmt::format("{}: cannot record to this folder: {}", path, std::strerror(code))};
}

}  // namespace

Result<std::unique_ptr<DiskFolder>> DiskFolder::open(const std::string& path) {
  if (const std::error_code error = make_durable_folder(path); error) {
    return folder_error(path, error.value());
  }
  FileHandle folder(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.valid()) return folder_error(path, errno);
  if (flock(folder.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return Error{path + ": another recorder writes to this folder"};
    return folder_error(path, errno);
  }
  if (faccessat(folder.get(), ".", W_OK | X_OK, AT_EACCESS) != 0) return folder_error(path, errno);
  return std::unique_ptr<DiskFolder>(new DiskFolder(std::move(folder)));
}

int DiskFolder::list(std::vector<FolderEntry>* entries) {
  entries->clear();
  const int again = openat(folder_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (again < 0) return errno;
  const std::unique_ptr<DIR, CloseDirectory> directory(fdopendir(again));  // owns `again`
  if (!directory) {
    const int reason = errno;
    (void)::close(again);
    return reason;
  }
  for (;;) {
    errno = 0;
    const dirent* const entry = readdir(directory.get());  // NOLINT(concurrency-mt-unsafe)
    if (entry == nullptr) return errno;
    struct stat status {};
    if (fstatat(folder_.get(), entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0) continue;
    if (S_ISREG(status.st_mode)) entries->push_back({entry->d_name, status.st_size});
  }
}

int DiskFolder::create(const std::string& name, std::unique_ptr<AppendFile>* file) {
  FileHandle handle(openat(folder_.get(), name.c_str(),
                           O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!handle.valid()) return errno;
  *file = std::make_unique<DiskFile>(std::move(handle));
  return 0;
}

int DiskFolder::remove(const std::string& name) {
  return unlinkat(folder_.get(), name.c_str(), 0) == 0 ? 0 : errno;
}

int DiskFolder::sync() { return fsync(folder_.get()) == 0 ? 0 : errno; }

std::int64_t DiskFolder::free_bytes() {
  struct statvfs status {};
  // Unknown: the writes themselves report a full disk.
  if (fstatvfs(folder_.get(), &status) != 0) return std::numeric_limits<std::int64_t>::max();
  return static_cast<std::int64_t>(status.f_bavail) * static_cast<std::int64_t>(status.f_frsize);
}

}  // namespace rcs::recorder
