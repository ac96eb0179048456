// On a private bus (with_bus.sh). The process under test is a child of the test.
#include "rcs/node/process/node_main.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/node/bus/lcm_bus.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::ms;

Result<std::unique_ptr<Node>> make_echo(const ParamFile& params, Bus* bus) {
  int depth = 4;
  params.root().table("echo").get("depth", &depth, {1, 100});
  if (const Outcome read = params.finish({"process"}); !read) return read.error();
  return std::unique_ptr<Node>(std::make_unique<test::Echo>(
      NodeInfo{"echo", ms(50), ms(1)}, bus, "ODOMETRY", "ANSWER", static_cast<std::size_t>(depth)));
}

struct Ended {
  int code;
  std::string output;
};

/// A node process; its stderr and stdout in a pipe.
class Child {
 public:
  explicit Child(
      std::vector<std::string> args, const std::function<void()>& before = [] {}) {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe(ends.data()), 0);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDERR_FILENO);
      dup2(ends[1], STDOUT_FILENO);
      std::vector<char*> argv;
      argv.reserve(args.size() + 2);
      args.insert(args.begin(), "echo");
      for (std::string& a : args) argv.push_back(a.data());
      argv.push_back(nullptr);
      before();
      const int code = node_main(static_cast<int>(args.size()), argv.data(), "echo", make_echo);
      fflush(nullptr);
      _exit(code);
    }
    close(ends[1]);
    out_ = ends[0];
  }
  ~Child() { close(out_); }

  void read_until(const std::string& text) {
    std::array<char, 256> buffer{};
    while (output_.find(text) == std::string::npos) {
      const ssize_t n = read(out_, buffer.data(), buffer.size());
      if (n <= 0) return;
      output_.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  void terminate() const { (void)kill(pid_, SIGTERM); }
  Ended wait() {
    read_until("\x01");  // to the end
    int status = 0;
    waitpid(pid_, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), output_};
  }

 private:
  pid_t pid_ = -1;
  int out_ = -1;
  std::string output_;
};

std::string config(const std::string& text) {
  const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
  std::string path = testing::TempDir() + info->name() + ".toml";
  std::ofstream(path) << text;
  return path;
}

TEST(NodeMain, RunsUntilASignalAndPrintsTheAccount) {
  Child child({config("[echo]\ndepth = 3\n")});
  child.read_until("running");
  const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  ASSERT_TRUE(bus.ok());
  Inbox<odometry_t> answers(bus->get(), "ANSWER", 8);
  Outbox<odometry_t> outbox(bus->get(), "ODOMETRY");
  odometry_t m{};
  outbox.publish(&m);
  while (answers.empty()) (void)(*bus)->deliver_one(Stamp());
  child.terminate();
  const Ended ended = child.wait();
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_NE(ended.output.find("echo: 1 cycles, 0 missed"), std::string::npos) << ended.output;
  EXPECT_NE(ended.output.find("  ODOMETRY                    1 "), std::string::npos)
      << ended.output;
}

TEST(NodeMain, ExhaustedDescriptorsOrMemoryEndTheStartWithAReason) {
  const std::string path = config("[echo]\n");
  for (rlim_t most = 4; most < 16; ++most) {
    Child child({path}, [most] {
      for (int fd = STDERR_FILENO + 1; fd < 64; ++fd) (void)close(fd);
      const rlimit limit = {most, most};
      (void)setrlimit(RLIMIT_NOFILE, &limit);
    });
    child.read_until("stop with Ctrl-C");
    child.terminate();
    const Ended ended = child.wait();
    EXPECT_GE(ended.code, 0) << most << " descriptors: " << ended.output;
    EXPECT_NE(ended.output, "") << most << " descriptors";
  }
  const Ended ended = Child({path}, [] {
                        const rlimit limit = {1, 1};
                        (void)setrlimit(RLIMIT_AS, &limit);
                        // Memory that malloc() already holds.
                        for (std::size_t size = std::size_t{1} << 20; size >= 16;) {
                          void* volatile block = std::malloc(size);
                          if (block == nullptr) size /= 2;
                        }
                      }).wait();
  EXPECT_EQ(ended.code, 3) << ended.output;
  EXPECT_NE(ended.output.find("out of memory"), std::string::npos) << ended.output;
}

TEST(NodeMain, ReportsItsProcessAndTheRefusedRequests) {
  const std::string path = config("[echo]\n[process.echo]\ncpus = [1023]\n");
  const Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  ASSERT_TRUE(bus.ok());
  Inbox<process_t> inbox(bus->get(), "ECHO_PROCESS", 8);
  Child child({path});
  while (inbox.empty()) (void)(*bus)->deliver_one(Stamp());
  const process_t& m = *inbox.front();
  EXPECT_EQ(m.node, "echo");
  EXPECT_EQ(m.pid, child.pid());
  EXPECT_EQ(m.config, path);
  EXPECT_GT(m.rss_kb, 1000);
  EXPECT_GT(m.descriptors, 5);
  EXPECT_EQ(m.note, "processors 1023 not granted: no such processors");
  child.terminate();
  const Ended ended = child.wait();
  EXPECT_EQ(ended.code, 0);
  EXPECT_NE(ended.output.find("echo: processors 1023 not granted"), std::string::npos)
      << ended.output;
  EXPECT_EQ(ended.output.find("echo_process"), std::string::npos) << ended.output;
}

TEST(NodeMain, ChecksAConfigurationWithoutABus) {
  EXPECT_EQ(Child({config("[echo]\ndepth = 3\n"), "--check", "--lcm-url", "nonsense"}).wait().code,
            0);
  const std::string path = config("[echo]\n[process.other]\ncpu = [1]\n");
  const Ended ended = Child({path, "--check"}).wait();
  EXPECT_EQ(ended.code, 1);
  EXPECT_EQ(ended.output,
            "echo: " + path + ":3: [process.other] unknown key cpu; did you mean cpus?\n");
}

TEST(NodeMain, ANodeThatCreatesFilesHasAnotherFactoryForTheCheck) {
  const std::string path = config("[echo]\n");
  const auto run = [&path](std::vector<std::string> args) {
    args.insert(args.begin(), {"echo", path});
    std::vector<char*> argv;
    for (std::string& a : args) argv.push_back(a.data());
    return node_main(
        static_cast<int>(args.size()), argv.data(), "echo",
        [](const ParamFile&, Bus*) -> Result<std::unique_ptr<Node>> { return Error{"live"}; },
        make_echo);
  };
  EXPECT_EQ(run({"--check"}), 0);
  EXPECT_EQ(run({}), 3);
}

TEST(NodeMain, AWrongConfigurationEndsItWithTheReason) {
  const std::string path = config("[echo]\ndpeth = 3\n");
  const Ended ended = Child({path}).wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_EQ(ended.output, "echo: " + path + ":2: [echo] unknown key dpeth; did you mean depth?\n");
  EXPECT_EQ(Child({"/nonexistent.toml"}).wait().code, 3);
}

TEST(NodeMain, AWrongCommandLineExitsWithTwoAndHelpWithZero) {
  EXPECT_EQ(Child({}).wait().code, 2);
  EXPECT_EQ(Child({"--nonsense"}).wait().code, 2);
  const Ended help = Child({"--help"}).wait();
  EXPECT_EQ(help.code, 0);
  EXPECT_NE(help.output.find("Example"), std::string::npos);
}

TEST(NodeMain, ABusThatCannotBeOpenedEndsItWithTheReason) {
  const Ended ended = Child({config(""), "--lcm-url", "nonsense"}).wait();
  EXPECT_EQ(ended.code, 3);
  EXPECT_NE(ended.output.find("invalid LCM address nonsense"), std::string::npos);
}

}  // namespace
}  // namespace rcs
