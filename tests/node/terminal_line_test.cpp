#include "rcs/node/process/terminal_line.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <utility>

namespace rcs {
namespace {

/// stderr of this process is a pipe for the life of this object.
class PipedStderr {
 public:
  PipedStderr() : before_(dup(STDERR_FILENO)) {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) return;
    (void)fcntl(ends[0], F_SETFL, O_NONBLOCK);
    reader_ = ends[0];
    (void)dup2(ends[1], STDERR_FILENO);
    (void)close(ends[1]);
  }
  ~PipedStderr() {
    (void)dup2(before_, STDERR_FILENO);
    (void)close(before_);
    (void)close(reader_);
  }
  PipedStderr(const PipedStderr&) = delete;
  PipedStderr& operator=(const PipedStderr&) = delete;

  void close_reader() { (void)close(std::exchange(reader_, -1)); }

  [[nodiscard]] std::string read_all() const {
    std::string text;
    std::array<char, 4096> bytes{};
    for (ssize_t n = 0; (n = read(reader_, bytes.data(), bytes.size())) > 0;) {
      text.append(bytes.data(), static_cast<std::size_t>(n));
    }
    return text;
  }

 private:
  int before_ = -1;
  int reader_ = -1;
};

TEST(TerminalLines, AFullPipeDropsLinesAndBlocksNothing) {
  TerminalLines lines;
  std::string text;
  {
    const PipedStderr piped;
    for (int k = 0; k < 100'000; ++k) lines.print("node: ", "a line of an event");
    text = piped.read_all();
    lines.print("the next line");
    text += piped.read_all();
  }
  EXPECT_EQ(text.substr(0, 25), "node: a line of an event\n");
  const std::string end = " lines dropped: stderr was blocked)\nthe next line\n";
  ASSERT_GT(text.size(), end.size());
  EXPECT_EQ(text.substr(text.size() - end.size()), end);
}

TEST(TerminalLines, ALongLineIsCut) {
  TerminalLines lines;
  std::string text;
  {
    const PipedStderr piped;
    lines.print(std::string(100'000, 'x'));
    text = piped.read_all();
  }
  EXPECT_EQ(text.size(), 4096U);
  EXPECT_EQ(text.back(), '\n');
}

TEST(TerminalLines, AReaderThatEndsDoesNotEndTheProcess) {
  TerminalLines lines;
  std::string text;
  {
    PipedStderr piped;
    piped.close_reader();
    lines.print("nobody reads this");  // SIGPIPE would end the test
  }
  {
    const PipedStderr piped;
    lines.print("the next line");
    text = piped.read_all();
  }
  EXPECT_EQ(text, "(1 lines dropped: stderr was blocked)\nthe next line\n");
}

// As of an ssh connection that stalls. A terminal is ready with room for a byte.
TEST(TerminalLines, ATerminalThatIsNotReadBlocksNothing) {
  const int own = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(own, 0);
  ASSERT_EQ(grantpt(own), 0);
  ASSERT_EQ(unlockpt(own), 0);
  const int terminal = open(ptsname(own), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(terminal, 0);
  const int before = dup(STDERR_FILENO);
  (void)dup2(terminal, STDERR_FILENO);
  (void)alarm(30);  // ends the test if a write blocks
  TerminalLines lines;
  for (int k = 0; k < 1000; ++k) lines.print("node: ", std::string(100, 'x'));
  (void)alarm(0);
  (void)dup2(before, STDERR_FILENO);
  EXPECT_EQ(fcntl(terminal, F_GETFL) & O_NONBLOCK, 0) << "others share it";
  for (const int fd : {before, terminal, own}) (void)close(fd);
}

}  // namespace
}  // namespace rcs
