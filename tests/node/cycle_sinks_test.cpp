#include "rcs/node/process/cycle_sinks.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "rcs/node/bus/local_bus.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::ms;

class CycleSinksTest : public testing::Test {
 protected:
  CycleSinksTest() {
    const std::vector<std::uint8_t> bytes = test::encode(test::odometry(1, 5));
    input_.receive(bytes.data(), bytes.size(), at_ms(93));
    stages_.start_cycle();
    stages_.mark("read");
    stages_.mark("write");
    stages_.close_account();
    stages_.end_cycle();
    cycle_ = {7, at_ms(95), at_ms(100), at_ms(120), &stages_};
    account_ = {&cycle_, ms(5), ms(17), 2, 1, &inputs_, 3};
  }

  LocalBus bus_;
  Inbox<odometry_t> input_{&bus_, "ODOMETRY", 2};
  std::vector<const InboxBase*> inputs_{&input_};
  StageClock stages_;
  Cycle cycle_;
  CycleAccount account_;
  NodeInfo info_{"wm", ms(25), ms(3)};
};

TEST_F(CycleSinksTest, ThePublisherSendsTheWholeAccountOnTheNodesChannel) {
  Inbox<cycle_t> cycles(&bus_, "WM_CYCLE", 2);
  CyclePublisher publisher(&bus_);
  publisher.on_account(info_, account_);
  bus_.deliver_next(at_ms(200));
  const cycle_t* m = cycles.latest();
  ASSERT_NE(m, nullptr);
  EXPECT_EQ(m->node, "wm");
  EXPECT_EQ(m->index, 7);
  EXPECT_EQ(m->utime, 100'000);
  EXPECT_EQ(m->wakeup_utime, 95'000);
  EXPECT_EQ(m->deadline_utime, 120'000);
  EXPECT_EQ(m->late_us, 5'000);
  EXPECT_EQ(m->slack_us, 17'000);
  EXPECT_EQ(m->missed, 2);
  EXPECT_EQ(m->overruns, 1);
  EXPECT_EQ(m->degrade_level, 3);
  ASSERT_EQ(m->n_stages, 2);
  EXPECT_EQ(m->stage[0].name, "read");
  EXPECT_EQ(m->stage[1].name, "write");
  ASSERT_EQ(m->n_inputs, 1);
  EXPECT_EQ(m->input[0].channel, "ODOMETRY");
  EXPECT_EQ(m->input[0].received, 1);
  EXPECT_EQ(m->input[0].age_us, 7'000) << "node time: now - last arrival";
}

TEST_F(CycleSinksTest, TheTimingFileHasOneLineForEachAccount) {
  const std::string path = testing::TempDir() + "cycle_sinks_test.timing";
  auto file = TimingFile::create(path);
  ASSERT_TRUE(file.ok());
  (*file)->on_account(info_, account_);
  ASSERT_TRUE((*file)->close().ok());
  std::ifstream in(path);
  std::string header;
  std::string line;
  std::getline(in, header);
  std::getline(in, line);
  EXPECT_EQ(header, "node,index,utime,late_us,slack_us,wall_us,cpu_us,stages");
  EXPECT_EQ(line.substr(0, 23), "wm,7,100000,5000,17000,");
  EXPECT_NE(line.find("read:"), std::string::npos);
  EXPECT_NE(line.find(" write:"), std::string::npos);
}

TEST_F(CycleSinksTest, AFullDiskIsAnError) {
  auto file = TimingFile::create("/dev/full");
  ASSERT_TRUE(file.ok());
  for (int i = 0; i < 1000; ++i) (*file)->on_account(info_, account_);
  const Outcome closed = (*file)->close();
  ASSERT_FALSE(closed.ok());
  EXPECT_NE(closed.error().message.find("/dev/full"), std::string::npos);
}

}  // namespace
}  // namespace rcs
