// BG's emergency stop on a disk that hangs.

#include <gtest/gtest.h>

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "tests/bg/bg_life.h"
#include "tests/support/fresh_folder.h"

namespace rcs::bg {
namespace {

namespace fs = std::filesystem;
using test::kGoto;
using test::kRelease;
using test::kStop;
using test::Life;

/// Executes jobs in a thread while it does not hang.
class Disk {
 public:
  void hang(bool on) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      hangs_ = on;
    }
    changed_.notify_all();
  }
  Outcome execute(const StopJob& job) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return !hangs_; });
    return rcs::execute(job);
  }
  [[nodiscard]] bool hangs() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return hangs_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool hangs_ = false;
};

/// As in the process of BG; if the disk does not hang, each job ends in the cycle of its start, so
/// that the test does not depend on the load of the computer.
class Writer final : public StopWriter {
 public:
  explicit Writer(Disk* disk)
      : disk_(disk), thread_([disk](const StopJob& job) { return disk->execute(job); }) {}
  void start(StopJob job) override {
    running_ = true;
    thread_.start(std::move(job));
  }
  [[nodiscard]] std::optional<Outcome> finished() override {
    std::optional<Outcome> result = thread_.finished();
    while (running_ && !result && !disk_->hangs()) {
      std::this_thread::yield();
      result = thread_.finished();
    }
    if (result) running_ = false;
    return result;
  }

 private:
  Disk* disk_;
  bool running_ = false;
  StopWriterThread thread_;
};

class BgStopDisk : public testing::Test {
 protected:
  BgStopDisk() : file_((rcs::test::fresh_folder() / "v.stop").string()) {
    Result<StopLatch> latch = StopLatch::open(file_);
    latch.value().use(std::make_unique<Writer>(&disk_));
    life_ = std::make_unique<Life>(file_, std::move(latch).value(), &now_);
    life_->cycle();
  }
  ~BgStopDisk() override { disk_.hang(false); }

  void expect_stopped(int cycles, int emergency_stop) {
    for (int k = 0; k < cycles; ++k) {
      if (k % 7 == 0) life_->send(kGoto);
      life_->cycle();
      ASSERT_TRUE(life_->brakes()) << k;
      ASSERT_EQ(life_->drive->emergency_stop, 1) << k;
      ASSERT_EQ(life_->status.state, "EMERGENCY_STOP") << k;
      ASSERT_EQ(life_->status.emergency_stop, emergency_stop) << k;
    }
  }

  Disk disk_;
  Stamp now_{std::chrono::seconds(100)};
  std::string file_;
  std::unique_ptr<Life> life_;
};

TEST_F(BgStopDisk, AStopIsInForceAndEchoedAtOnceAndPersistedLater) {
  disk_.hang(true);
  life_->speed_mps = 5.0;
  life_->send(kStop);
  life_->cycle();
  EXPECT_TRUE(life_->brakes());
  EXPECT_EQ(life_->status.status, +status_t::STATUS_EXEC);
  EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_LATCHED);
  ASSERT_EQ(life_->status.stop.size(), 1U);
  expect_stopped(1000, status_t::STOP_LATCHED);
  EXPECT_FALSE(fs::exists(file_));
  disk_.hang(false);
  life_->cycle();
  EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_PERSISTED);
  EXPECT_TRUE(fs::exists(file_));
}

TEST_F(BgStopDisk, AReleaseTakesEffectWhenTheFileIsGone) {
  life_->send(kStop);
  life_->cycle();
  disk_.hang(true);
  life_->send(kRelease);
  for (int k = 0; k < 20; ++k) {
    life_->cycle();
    ASSERT_TRUE(life_->brakes());
    ASSERT_EQ(life_->status.state, "EMERGENCY_STOP");
    ASSERT_EQ(life_->status.status, +status_t::STATUS_EXEC);
    ASSERT_EQ(life_->status.reason, "release accepted, the file of the latch is being removed");
  }
  disk_.hang(false);
  life_->cycle();
  EXPECT_EQ(life_->status.state, "RELEASED");
  EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_NONE);
  EXPECT_FALSE(fs::exists(file_));
  life_->cycle();
  EXPECT_FALSE(life_->brakes());
}

TEST_F(BgStopDisk, AReleaseThatWasNotWrittenInTimeHasFailedForGood) {
  life_->send(kStop);
  life_->cycle();
  disk_.hang(true);
  life_->send(kRelease);
  for (int k = 0; k < 60; ++k) life_->cycle();
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
  EXPECT_EQ(life_->status.status, +status_t::STATUS_ERROR);
  EXPECT_NE(life_->status.reason.find("was not removed in time"), std::string::npos)
      << life_->status.reason;
  EXPECT_TRUE(life_->has_event("stop.release_failed"));
  disk_.hang(false);
  life_->cycle();  // the file was removed, and is made again
  expect_stopped(100, status_t::STOP_PERSISTED);
  EXPECT_TRUE(fs::exists(file_));
}

// BG ends in an orderly way in the cycle in which the stop has arrived.
TEST_F(BgStopDisk, AStopIsPersistedBeforeTheProcessEnds) {
  disk_.hang(true);
  life_->send(kStop);
  life_->cycle();
  ASSERT_FALSE(fs::exists(file_));
  disk_.hang(false);
  life_.reset();
  EXPECT_TRUE(StopLatch::open(file_)->engaged());
}

TEST_F(BgStopDisk, AStopDuringAReleaseIsPersisted) {
  life_->send(kStop);
  life_->cycle();
  disk_.hang(true);
  life_->send(kRelease);
  life_->cycle();
  life_->send(kStop);
  life_->cycle();
  EXPECT_EQ(life_->status.stop.size(), 2U);
  disk_.hang(false);
  life_->cycle();
  life_->cycle();
  expect_stopped(100, status_t::STOP_PERSISTED);
  EXPECT_TRUE(fs::exists(file_));
}

}  // namespace
}  // namespace rcs::bg
