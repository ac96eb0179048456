#include "tools/rcs/vehicle/child_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

namespace rcs::cli {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Outcome {
  Exit exit;
  std::vector<std::string> lines;
};

Outcome run_to_end(ChildProcess process) {
  Outcome outcome;
  for (;;) {
    pollfd polled{process.exit_fd(), POLLIN, 0};
    EXPECT_EQ(poll(&polled, 1, 10'000), 1);
    const std::optional<Exit> exit = process.collect();
    process.read_output([&](std::string_view line) { outcome.lines.emplace_back(line); });
    if (exit) {
      outcome.exit = *exit;
      return outcome;
    }
  }
}

Outcome shell(const std::string& script) {
  Result<ChildProcess> started = ChildProcess::start("/bin/sh", {"-c", script});
  EXPECT_TRUE(started.ok());
  return run_to_end(std::move(started).value());
}

TEST(LineCutter, LinesDoNotDependOnWhereTheBytesAreCut) {
  const std::string text = "one\ntwo\r\nthree\n\nfour";
  for (std::size_t piece = 1; piece <= text.size(); ++piece) {
    LineCutter cutter;
    std::vector<std::string> lines;
    const auto take = [&](std::string_view line) { lines.emplace_back(line); };
    for (std::size_t at = 0; at < text.size(); at += piece) {
      cutter.add(std::string_view(text).substr(at, piece), take);
    }
    EXPECT_THAT(lines, ElementsAre("one", "two", "three"));
    cutter.flush(take);
    EXPECT_THAT(lines, ElementsAre("one", "two", "three", "four"));
  }
}

TEST(LineCutter, AnEndlessLineIsDeliveredInPieces) {
  LineCutter cutter;
  std::size_t bytes = 0;
  std::size_t longest = 0;
  for (int i = 0; i < 1000; ++i) {
    cutter.add("0123456789", [&](std::string_view line) {
      bytes += line.size();
      longest = std::max(longest, line.size());
    });
  }
  EXPECT_EQ(bytes, 10'000U);
  EXPECT_EQ(longest, LineCutter::kMaxLine);
}

TEST(ChildProcess, BothOutputsAndTheStatusAreReturned) {
  const Outcome outcome = shell("echo out; echo err >&2; cat; exit 3");
  EXPECT_THAT(outcome.lines, ElementsAre("out", "err"));
  EXPECT_FALSE(outcome.exit.by_signal);
  EXPECT_EQ(outcome.exit.code, 3);
  EXPECT_EQ(to_text(outcome.exit), "ended with status 3");
}

TEST(ChildProcess, ATerminatingSignalIsReported) {
  const Outcome outcome = shell("kill -SEGV $$");
  EXPECT_TRUE(outcome.exit.by_signal);
  EXPECT_EQ(outcome.exit.code, SIGSEGV);
}

TEST(ChildProcess, AProgramThatCannotBeExecutedIsReported) {
  Result<ChildProcess> started = ChildProcess::start("/nonexistent/program", {});
  ASSERT_TRUE(started.ok());
  const Outcome outcome = run_to_end(std::move(started).value());
  EXPECT_EQ(outcome.exit.code, 127);
  EXPECT_THAT(outcome.lines, ElementsAre("cannot execute /nonexistent/program"));
}

TEST(ChildProcess, InheritsNoDescriptorsAndLeadsItsOwnGroup) {
  const int leaked = dup(STDERR_FILENO);  // without FD_CLOEXEC
  // Field 5 of stat is the process group.
  const Outcome outcome = shell("ls /proc/$$/fd; cut -d' ' -f5 /proc/$$/stat; echo $$");
  close(leaked);
  ASSERT_EQ(outcome.lines.size(), 5U);
  const std::string pid = outcome.lines[4];
  EXPECT_THAT(outcome.lines, ElementsAre("0", "1", "2", pid, pid));
}

TEST(ChildProcess, DiesWithItsParent) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  const pid_t parent = fork();
  if (parent == 0) {
    close(pipe_ends[0]);
    // The child's child keeps a descriptor of the pipe open through its own output.
    dup2(pipe_ends[1], STDERR_FILENO);
    Result<ChildProcess> started = ChildProcess::start("/bin/sh", {"-c", "exec sleep 1000"});
    const int pid = started.ok() ? started->pid() : -1;
    (void)!write(pipe_ends[1], &pid, sizeof pid);
    (void)kill(getpid(), SIGKILL);
  }
  close(pipe_ends[1]);
  int pid = -1;
  ASSERT_EQ(read(pipe_ends[0], &pid, sizeof pid), static_cast<ssize_t>(sizeof pid));
  close(pipe_ends[0]);
  waitpid(parent, nullptr, 0);
  ASSERT_GT(pid, 0);
  // The kernel sends the signal before the parent can be waited for; the child's end takes a
  // moment.
  bool gone = false;
  for (int i = 0; i < 1000 && !gone; ++i) {
    gone = kill(pid, 0) != 0;
    if (!gone) {
      std::array<char, 64> state{};
      const std::string path = "/proc/" + std::to_string(pid) + "/stat";
      std::FILE* file = std::fopen(path.c_str(), "re");
      gone = file == nullptr;
      if (file != nullptr) {
        // "1234 (sleep) Z ...": it has not been reaped yet
        gone = std::fscanf(file, "%*d %*s %63s", state.data()) == 1 && state[0] == 'Z';
        (void)std::fclose(file);
      }
      (void)poll(nullptr, 0, 5);
    }
  }
  EXPECT_TRUE(gone) << pid;
}

TEST(FindProgram, SearchesThePathAndReportsTheSearchedFolders) {
  const Result<std::string> found = find_program("sh");
  ASSERT_TRUE(found.ok());
  EXPECT_NE(found->find("/sh"), std::string::npos);
  const Result<std::string> none = find_program("no_such_node");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().message.find("no program no_such_node"), std::string::npos);
}

}  // namespace
}  // namespace rcs::cli
