#include "rcs/node/process/process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <optional>
#include <vector>

#include "rcs/node/bus/local_bus.h"
#include "tests/node/fixtures.h"
#include "tests/support/heap_guard.h"

namespace rcs {
namespace {

using test::at_ms;
using test::HeapGuard;
using test::ms;

std::string error_of(const std::string& text) {
  const Result<ParamFile> file = ParamFile::parse(text, "file.toml");
  if (!file) return file.error().message;
  const Result<ProcessTables> tables = read_process_tables(*file);
  return tables ? "" : tables.error().message;
}

TEST(ProcessTables, ReadsTheRequestsOfEachNode) {
  const Result<ParamFile> file = ParamFile::parse(R"(
[sp]
of_sp = 1
[process]
bus_firewalled = true
[process.sp]
realtime_priority = 60
lock_memory = true
cpus = [2, 3]
[up]
nodes = ["wm", "sp", "bg"]
non_critical = ["bg"]
)",
                                                  "file.toml");
  ASSERT_TRUE(file.ok());
  const Result<ProcessTables> tables = read_process_tables(*file);
  ASSERT_TRUE(tables.ok()) << tables.error().message;
  EXPECT_TRUE(tables->bus_firewalled);
  const RealtimeParams sp = tables->realtime_of("sp");
  EXPECT_EQ(sp.realtime_priority, 60);
  EXPECT_TRUE(sp.lock_memory);
  EXPECT_EQ(sp.cpus, (std::vector<int>{2, 3}));
  EXPECT_EQ(tables->realtime_of("wm").realtime_priority, 0);
  EXPECT_EQ(tables->nodes, (std::vector<std::string>{"wm", "sp", "bg"}));
  EXPECT_FALSE(tables->is_critical("bg"));
  EXPECT_TRUE(tables->is_critical("gateway")) << "the list replaces the default";
}

TEST(ProcessTables, AnEmptyFileRequestsNothing) {
  const Result<ParamFile> file = ParamFile::parse("", "file.toml");
  const Result<ProcessTables> tables = read_process_tables(*file);
  ASSERT_TRUE(tables.ok());
  EXPECT_FALSE(tables->bus_firewalled);
  EXPECT_TRUE(tables->realtime.empty());
  EXPECT_EQ(tables->nodes, (std::vector<std::string>{"sp", "wm"}));
  EXPECT_TRUE(tables->is_critical("wm"));
  EXPECT_FALSE(tables->is_critical("gateway"));
  EXPECT_FALSE(tables->is_critical("ros2_bridge"));
}

TEST(ProcessTables, EveryErrorNamesItsLine) {
  EXPECT_EQ(error_of("[process.sp]\nrealtime_priority = 99\n"),
            "file.toml:2: [process.sp] realtime_priority = 99: not in [0, 98]");
  EXPECT_EQ(error_of("[process.wm]\nrealtime_prioritu = 5\n"),
            "file.toml:2: [process.wm] unknown key realtime_prioritu; did you mean "
            "realtime_priority?");
  EXPECT_EQ(error_of("[process]\nsp = 5\n"), "file.toml:2: [process] sp = 5: not a table");
  EXPECT_EQ(error_of("[process.sp]\ncpus = [1, -1]\n"),
            "file.toml:2: [process.sp] cpus = -1: not in [0, 1023]");
  EXPECT_EQ(error_of("[process.sp]\ncpus = 1\n"),
            "file.toml:2: [process.sp] cpus = 1: not a list: write [a, b]");
  EXPECT_NE(error_of("[up]\nnodes = []\n").find("empty"), std::string::npos);
  EXPECT_NE(error_of("[up]\nnodes = [\"sp\", \"sp\"]\n").find("sp is listed twice"),
            std::string::npos);
  EXPECT_NE(error_of("[up]\nnodes = [\"../sp\"]\n").find("../sp is not a valid node name"),
            std::string::npos);
  EXPECT_EQ(error_of("[up]\nnodes = [\"sp\", \"ros2_bridge\"]\n"), "");
  EXPECT_NE(error_of("[up]\nnodes = [\"2sp\"]\n").find("2sp is not a valid node name"),
            std::string::npos);
  EXPECT_EQ(error_of("[up]\nnodes = [\"sp\"]\nnon_critical = [\"gatway\"]\n"),
            "file.toml:3: [up] non_critical = [ 'gatway' ]: gatway is not in nodes");
  EXPECT_NE(error_of("[up]\nnodes = [1]\n").find("not a string"), std::string::npos);
  EXPECT_EQ(error_of("[up]\nnode = [\"sp\"]\n"),
            "file.toml:2: [up] unknown key node; did you mean nodes?");
}

TEST(CycleCounter, PassesAccountsOnAndKeepsTheNewest) {
  struct Last final : CycleSink {
    void on_account(const NodeInfo& /*node*/, const CycleAccount& /*account*/) override { ++count; }
    int count = 0;
  };
  Last last;
  CycleCounter counter(&last);
  Cycle cycle;
  cycle.index = 6;
  CycleAccount account;
  account.cycle = &cycle;
  account.missed = 2;
  account.overruns = 3;
  account.degrade_level = 4;
  counter.on_account({}, account);
  EXPECT_EQ(last.count, 1);
  EXPECT_EQ(counter.counts().cycles, 7);
  EXPECT_EQ(counter.counts().missed, 2);
  EXPECT_EQ(counter.counts().overruns, 3);
  EXPECT_EQ(counter.counts().degrade_level, 4);
}

TEST(ProcessUsage, MeasuresTheUsageOfTheProcess) {
  ProcessUsage usage;
  process_t before{};
  usage.read(&before);
  EXPECT_GT(before.rss_kb, 500);
  EXPECT_GT(before.descriptors, 3);
  const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  process_t after{};
  usage.read(&after);
  EXPECT_EQ(after.descriptors, before.descriptors + 1);
  EXPECT_GE(after.cpu_us, before.cpu_us);
  close(fd);
  usage.read(&after);
  EXPECT_EQ(after.descriptors, before.descriptors);
}

TEST(ProcessUsage, MeasuresTheHeapInUse) {
  if (!HeapGuard::available()) GTEST_SKIP() << "NOT TESTED: a sanitizer owns malloc";
  ProcessUsage usage;
  process_t empty{};
  usage.read(&empty);
  // The large block has a mapping of its own, the small ones are in an arena.
  std::vector<std::vector<char>> blocks(200, std::vector<char>(10'240));
  blocks.emplace_back(20'480'000);
  process_t full{};
  usage.read(&full);
  EXPECT_NEAR(static_cast<double>(full.heap_kb - empty.heap_kb), 22'000.0, 200.0);
  blocks.clear();
  blocks.shrink_to_fit();
  usage.read(&full);
  EXPECT_NEAR(static_cast<double>(full.heap_kb - empty.heap_kb), 0.0, 100.0);
}

/// Runs never; has a note.
class NodeWithNote final : public Node {
 public:
  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return Stamp::max(); }
  void run(const Cycle&) override {}
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::string_view note() const override { return text; }

  std::string_view text;

 private:
  NodeInfo info_{"sp", ms(50), Duration::zero()};
};

/// 30 s of a process whose node is idle.
class ProcessNodeTest : public testing::Test {
 protected:
  ProcessNodeTest() {
    ProcessFacts facts{"sp", "vehicle.toml", 42, at_ms(500), {}, "bus reachable from eth0"};
    facts.grant.memory_locked = true;
    facts.grant.refusals = {"SCHED_FIFO 60 not granted: Operation not permitted"};
    node_.emplace(&bus_, facts, &counter_, &of_);
  }

  LocalBus bus_;
  CycleCounter counter_{nullptr};
  NodeWithNote of_;
  Inbox<process_t> inbox_{&bus_, "SP_PROCESS", 100};
  std::optional<ProcessNode> node_;
};

TEST_F(ProcessNodeTest, PublishesOnceASecondWithTheRefusedRequests) {
  test::ListSource source(test::odometry_items(at_ms(0), ms(100), 301));
  LockstepTimeline timeline(&bus_, &source, Duration::zero());
  run({&*node_}, timeline, nullptr);
  EXPECT_NEAR(static_cast<double>(inbox_.account().received), 31.0, 1.0);
  const process_t& m = *inbox_.front();
  EXPECT_EQ(m.node, "sp");
  EXPECT_EQ(m.pid, getpid());
  EXPECT_EQ(m.start_utime, 500'000);
  EXPECT_EQ(m.config, "vehicle.toml");
  EXPECT_EQ(m.realtime_priority, 0);
  EXPECT_EQ(m.memory_locked, 1);
  EXPECT_EQ(m.note, "SCHED_FIFO 60 not granted: Operation not permitted; bus reachable from eth0");
}

TEST_F(ProcessNodeTest, TheNoteOfTheNodeIsAddedWhileThereIsOne) {
  StageClock stages;
  const auto note_at = [&](int s, std::string_view text) {
    of_.text = text;
    const Stamp now = Stamp(s * ProcessNode::kPeriod);
    node_->run({static_cast<std::uint64_t>(s), now, now, now, &stages});
    bus_.deliver_next(now);
    const std::string note = inbox_.front()->note;
    inbox_.pop();
    return note;
  };
  const std::string start = note_at(0, "");
  EXPECT_EQ(note_at(1, "keys expire at 2027"), start + "; keys expire at 2027");
  EXPECT_EQ(note_at(2, ""), start);
}

TEST_F(ProcessNodeTest, AllocatesNothingOnceWarm) {
  if (!HeapGuard::available()) GTEST_SKIP() << "NOT TESTED: a sanitizer owns malloc";
  StageClock stages;
  for (int i = 0; i < 20; ++i) {
    const Stamp now = Stamp(i * ProcessNode::kPeriod);
    const Cycle cycle{static_cast<std::uint64_t>(i), now, now, now, &stages};
    std::optional<HeapGuard> guard;
    if (i > 3) guard.emplace();
    node_->run(cycle);
    const std::int64_t allocations = guard ? guard->allocations() : 0;
    guard.reset();
    EXPECT_EQ(allocations, 0) << i;
    bus_.deliver_next(now);
  }
}

}  // namespace
}  // namespace rcs
