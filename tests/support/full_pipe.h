#pragma once
// A named pipe without room, and without a reader that reads.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <utility>

#include "rcs/base/file_handle.h"

namespace rcs::test {

class FullPipe {
 public:
  explicit FullPipe(std::filesystem::path path) : path_(std::move(path)) {
    EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0) << path_;
    // Read and write: it has a reader, so that nobody gets SIGPIPE, and can be opened at once.
    pipe_ = FileHandle(::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
    const std::array<char, 4096> block{};
    while (write(pipe_.get(), block.data(), block.size()) > 0) {
    }
    EXPECT_TRUE(full());
  }
  [[nodiscard]] bool full() const {
    pollfd room{pipe_.get(), POLLOUT, 0};
    return poll(&room, 1, 0) == 0;
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  FileHandle pipe_;
};

}  // namespace rcs::test
