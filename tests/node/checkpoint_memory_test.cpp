#include "rcs/node/process/checkpoint_memory.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace rcs {
namespace {

constexpr CheckpointLayout kLayout{20'000, 16, 8'000};
constexpr std::uint64_t kProgram = 7;

using State = std::vector<unsigned char>;

class CheckpointMemoryTest : public testing::Test {
 protected:
  CheckpointMemoryTest() {
    Result<CheckpointOwner> created = CheckpointOwner::create();
    EXPECT_TRUE(created.ok());
    owner_ = std::move(created).value();
  }
  std::unique_ptr<CheckpointMemory> open(const CheckpointLayout& layout = kLayout,
                                         std::uint64_t program = kProgram) {
    Result<std::unique_ptr<CheckpointMemory>> memory =
        CheckpointMemory::open(owner_.path(), layout, program);
    EXPECT_TRUE(memory.ok()) << memory.error().message;
    return std::move(memory).value();
  }
  CheckpointOwner owner_;
  State state_ = State(kLayout.state_bytes);
  State row_ = State(kLayout.row_bytes);
};

TEST_F(CheckpointMemoryTest, ASuccessorReadsTheNewestRecords) {
  auto first = open();
  EXPECT_FALSE(first->read_state(state_.data()));
  EXPECT_FALSE(first->read_row(3, row_.data()));
  for (unsigned char k = 1; k <= 5; ++k) first->write_state(State(kLayout.state_bytes, k).data());
  first->write_row(3, State(kLayout.row_bytes, 9).data());
  first.reset();
  const auto second = open();
  ASSERT_TRUE(second->read_state(state_.data()));
  EXPECT_EQ(state_, State(kLayout.state_bytes, 5));
  ASSERT_TRUE(second->read_row(3, row_.data()));
  EXPECT_EQ(row_, State(kLayout.row_bytes, 9));
  EXPECT_FALSE(second->read_row(4, row_.data()));
  second->clear();
  EXPECT_FALSE(second->read_state(state_.data()));
  EXPECT_FALSE(second->read_row(3, row_.data()));
}

TEST_F(CheckpointMemoryTest, RecordsOfAnotherProgramOrLayoutAreDiscarded) {
  open()->write_state(State(kLayout.state_bytes, 1).data());
  EXPECT_FALSE(open(kLayout, kProgram + 1)->read_state(state_.data()));
  EXPECT_FALSE(open()->read_state(state_.data())) << "the other program has discarded it";
  open()->write_state(State(kLayout.state_bytes, 1).data());
  EXPECT_FALSE(open({kLayout.state_bytes, 20, kLayout.row_bytes})->read_state(state_.data()));
}

class CheckpointFile : public testing::Test {
 protected:
  CheckpointFile() { EXPECT_NE(mkdtemp(folder_.data()), nullptr); }
  ~CheckpointFile() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] const std::string& folder() const { return folder_; }
  [[nodiscard]] static std::string error_of(const Result<CheckpointOwner>& owner) {
    return owner ? "" : owner.error().message;
  }

 private:
  std::string folder_ = (std::filesystem::temp_directory_path() / "rcs_memory_XXXXXX").string();
};

TEST_F(CheckpointFile, ALaterRunFindsTheMemoryOfItsVehicle) {
  const auto write = [this](const std::string& vehicle, unsigned char value) {
    const Result<CheckpointOwner> owner = CheckpointOwner::open(folder(), vehicle);
    ASSERT_TRUE(owner.ok()) << error_of(owner);
    auto memory = CheckpointMemory::open(owner->path(), kLayout, kProgram);
    ASSERT_TRUE(memory.ok());
    (*memory)->write_state(State(kLayout.state_bytes, value).data());
  };
  write("a", 1);
  write("b", 2);
  const Result<CheckpointOwner> owner = CheckpointOwner::open(folder(), "a");
  ASSERT_TRUE(owner.ok()) << error_of(owner);
  auto memory = CheckpointMemory::open(owner->path(), kLayout, kProgram);
  ASSERT_TRUE(memory.ok());
  State state(kLayout.state_bytes);
  ASSERT_TRUE((*memory)->read_state(state.data()));
  EXPECT_EQ(state, State(kLayout.state_bytes, 1));
}

TEST_F(CheckpointFile, OutdatedFilesOfVehiclesThatDoNotRunAreRemoved) {
  namespace fs = std::filesystem;
  const auto names = [this] {
    std::set<std::string> all;
    for (const auto& i : fs::directory_iterator(folder())) all.insert(i.path().string());
    return all;
  };
  const auto outdate = [&] {
    for (const std::string& name : names()) {
      fs::last_write_time(name, fs::last_write_time(name) - std::chrono::minutes(11));
    }
  };
  std::ofstream(folder() + "/other") << "of another program";
  const Result<CheckpointOwner> runs = CheckpointOwner::open(folder(), "runs");
  ASSERT_TRUE(CheckpointOwner::open(folder(), "ended").ok());
  ASSERT_TRUE(CheckpointOwner::open(folder(), "new").ok());
  EXPECT_EQ(names().size(), 4U);
  outdate();
  ASSERT_TRUE(CheckpointOwner::open(folder(), "new").ok());
  EXPECT_EQ(names().size(), 2U + 1U);
  EXPECT_EQ(names().count(folder() + "/other"), 1U);
  EXPECT_FALSE(CheckpointOwner::open(folder(), "runs").ok()) << "it still exists";
}

TEST_F(CheckpointFile, OneRunHasItAtATime) {
  const Result<CheckpointOwner> first = CheckpointOwner::open(folder(), "a");
  ASSERT_TRUE(first.ok()) << error_of(first);
  EXPECT_NE(error_of(CheckpointOwner::open(folder(), "a")).find("another `rcs up`"),
            std::string::npos);
  EXPECT_TRUE(CheckpointOwner::open(folder(), "b").ok());
}

TEST_F(CheckpointFile, WhatAnotherUserCouldHavePutThereIsRefused) {
  namespace fs = std::filesystem;
  std::string path;
  {
    ASSERT_TRUE(CheckpointOwner::open(folder(), "a").ok());
    path = fs::directory_iterator(folder())->path().string();
  }
  fs::permissions(path, fs::perms::group_read, fs::perm_options::add);
  EXPECT_NE(error_of(CheckpointOwner::open(folder(), "a")).find(path), std::string::npos);
  fs::rename(path, folder() + "/other");
  fs::create_symlink(folder() + "/other", path);
  EXPECT_NE(error_of(CheckpointOwner::open(folder(), "a")).find(path), std::string::npos);
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_NE(error_of(CheckpointOwner::open(folder(), "a")).find("regular"), std::string::npos);
  EXPECT_NE(error_of(CheckpointOwner::open(folder() + "/none", "a")).find("/none/"),
            std::string::npos);
}

TEST_F(CheckpointMemoryTest, ABadPathIsAnErrorThatNamesIt) {
  const auto memory = CheckpointMemory::open("/nonexistent/memory", kLayout, kProgram);
  ASSERT_FALSE(memory.ok());
  EXPECT_NE(memory.error().message.find("/nonexistent/memory"), std::string::npos);
}

// Each record has one value in all bytes; a mixture is one that was read although its writer was
// killed within it.
TEST_F(CheckpointMemoryTest, AProcessThatIsKilledAtAnyInstantLeavesCompleteRecords) {
  std::mt19937 random(1);
  int rows_lost = 0;
  unsigned char newest = 0;
  for (int life = 0; life < 60; ++life) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const auto memory = open();
      for (unsigned char value = 1;; value = static_cast<unsigned char>(value % 250 + 1)) {
        std::fill(state_.begin(), state_.end(), value);
        std::fill(row_.begin(), row_.end(), value);
        memory->write_state(state_.data());
        memory->write_row(value % kLayout.rows, row_.data());
      }
    }
    std::this_thread::sleep_for(
        std::chrono::microseconds(std::uniform_int_distribution<>(2000, 9000)(random)));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    ASSERT_EQ(waitpid(child, nullptr, 0), child);
    const auto memory = open();
    if (memory->read_state(state_.data())) {
      newest = state_[0];
      EXPECT_EQ(state_, State(kLayout.state_bytes, state_[0]));
    } else {
      EXPECT_EQ(newest, 0) << "a state that was there is lost";
    }
    for (std::size_t k = 0; k < kLayout.rows; ++k) {
      if (!memory->read_row(k, row_.data())) {
        ++rows_lost;
        continue;
      }
      EXPECT_EQ(row_, State(kLayout.row_bytes, row_[0]));
      EXPECT_EQ(row_[0] % kLayout.rows, k);
    }
  }
  EXPECT_GT(newest, 0);
  std::printf("[  KILLED  ] rows that were being written: %d in 60 lives\n", rows_lost);
}

}  // namespace
}  // namespace rcs
