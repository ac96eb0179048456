#include "rcs/node/process/realtime.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <future>
#include <thread>

namespace rcs {
namespace {

/// A thread that waits until the end of the test.
class Waiting {
 public:
  explicit Waiting(bool background) {
    std::promise<pid_t> id;
    thread_ = std::thread([this, background, &id] {
      EXPECT_TRUE(!background || run_in_background());
      id.set_value(gettid());
      end_.get_future().wait();
    });
    id_ = id.get_future().get();
  }
  ~Waiting() {
    end_.set_value();
    thread_.join();
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  [[nodiscard]] int policy() const { return sched_getscheduler(id_) & ~SCHED_RESET_ON_FORK; }
  [[nodiscard]] int cpus() const {
    cpu_set_t set;
    return sched_getaffinity(id_, sizeof set, &set) == 0 ? CPU_COUNT(&set) : -1;
  }

 private:
  std::promise<void> end_;
  std::thread thread_;
  pid_t id_ = 0;
};

class RealtimeTest : public testing::Test {
 protected:
  RealtimeTest() { (void)sched_getaffinity(0, sizeof allowed_, &allowed_); }
  ~RealtimeTest() override {
    const sched_param ordinary{};
    (void)sched_setscheduler(0, SCHED_OTHER, &ordinary);
    (void)sched_setaffinity(0, sizeof allowed_, &allowed_);
  }
  cpu_set_t allowed_{};
};

TEST(Realtime, WithoutRequestsNothingIsRefused) {
  const RealtimeGrant grant = request_realtime({});
  EXPECT_EQ(grant.realtime_priority, 0);
  EXPECT_FALSE(grant.memory_locked);
  EXPECT_TRUE(grant.refusals.empty());
}

TEST(Realtime, AMissingProcessorIsRefusedAndReported) {
  RealtimeParams params;
  params.cpus = {1023};
  const RealtimeGrant grant = request_realtime(params);
  ASSERT_EQ(grant.refusals.size(), 1U);
  EXPECT_EQ(grant.refusals[0], "processors 1023 not granted: no such processors");
}

TEST_F(RealtimeTest, ProcessorsApplyToAllThreadsExceptTheBackgroundThread) {
  if (CPU_COUNT(&allowed_) < 2) GTEST_SKIP() << "needs two processors";
  const Waiting receiver(false);
  const Waiting loader(true);
  int first = 0;
  while (!CPU_ISSET(first, &allowed_)) ++first;
  RealtimeParams params;
  params.cpus = {first};
  EXPECT_TRUE(request_realtime(params).refusals.empty());
  EXPECT_EQ(receiver.cpus(), 1);
  EXPECT_EQ(loader.cpus(), CPU_COUNT(&allowed_));
}

TEST_F(RealtimeTest, ABackgroundThreadStaysInTheBackground) {
  const Waiting receiver(false);
  const Waiting loader(true);
  RealtimeParams params;
  params.realtime_priority = 1;
  const RealtimeGrant grant = request_realtime(params);
  EXPECT_EQ(loader.policy(), SCHED_IDLE);
  if (grant.realtime_priority == 0) GTEST_SKIP() << grant.refusals.at(0);
  EXPECT_EQ(receiver.policy(), SCHED_FIFO);
}

// All its threads start at idle priority: LCM's receiver could not be distinguished from background
// threads.
TEST(Realtime, AProcessThatIsStartedIdleIsGrantedNothing) {
  std::thread([] {
    ASSERT_TRUE(run_in_background());
    RealtimeParams params;
    params.realtime_priority = 1;
    const RealtimeGrant grant = request_realtime(params);
    EXPECT_EQ(grant.realtime_priority, 0);
    ASSERT_EQ(grant.refusals.size(), 1U);
    EXPECT_NE(grant.refusals[0].find("SCHED_IDLE"), std::string::npos);
  }).join();
}

}  // namespace
}  // namespace rcs
