#include "tools/mcap/mcap_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "rcs/base/regular_file.h"

namespace rcs::mcap {
namespace {

Error file_error(const std::string& name, const char* what, int number) {
  return {fmt::format("{}: {}: {}", name, what, std::strerror(number))};
}

class FileSource final : public ByteSource {
 public:
  FileSource(FileHandle file, std::uint64_t size) : file_(std::move(file)), size_(size) {}

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  [[nodiscard]] bool read(std::uint64_t at, std::size_t n, std::uint8_t* out) override {
    while (n > 0) {
      const ssize_t got = ::pread(file_.get(), out, n, static_cast<off_t>(at));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;  // 0: somebody has made the file shorter
      out += got;
      at += static_cast<std::uint64_t>(got);
      n -= static_cast<std::size_t>(got);
    }
    return true;
  }

 private:
  FileHandle file_;
  std::uint64_t size_;
};

}  // namespace

Result<std::unique_ptr<FileSink>> FileSink::create(const std::string& path,
                                                   const std::string& name) {
  FileHandle file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (!file.valid()) return file_error(name, "cannot create", errno);
  return std::unique_ptr<FileSink>(new FileSink(std::move(file), name));
}

Outcome FileSink::append(const std::uint8_t* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(file_.get(), data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return file_error(name_, "cannot write", errno);
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return Done{};
}

Outcome FileSink::close() {
  return file_.close() == 0 ? Outcome(Done{}) : file_error(name_, "cannot write", errno);
}

Result<Reader> open_file(const std::string& path) {
  if (Outcome checked = check_regular_file(path); !checked) return checked.error();
  FileHandle file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!file.valid() || ::fstat(file.get(), &status) != 0) {
    return file_error(path, "cannot open", errno);
  }
  const auto size = static_cast<std::uint64_t>(status.st_size);
  Result<Reader> reader = Reader::open(std::make_unique<FileSource>(std::move(file), size));
  if (!reader) return Error{path + ": " + reader.error().message};
  return reader;
}

}  // namespace rcs::mcap
