#include "rcs/node/stop_file.h"

#include <gmock/gmock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/fresh_folder.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

/// Files and folders that were synchronized with the disk; null: nobody asks.
std::vector<std::string>* synced = nullptr;

/// During its lifetime.
struct Recorded {
  Recorded() { synced = &paths; }
  Recorded(const Recorded&) = delete;
  Recorded& operator=(const Recorded&) = delete;
  ~Recorded() { synced = nullptr; }
  std::vector<std::string> paths;
};

}  // namespace
}  // namespace rcs::test

/// In place of that of the C library.
extern "C" int fsync(int fd) {
  if (rcs::test::synced != nullptr) {
    std::error_code error;
    rcs::test::synced->push_back(
        std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(fd), error).string());
  }
  return static_cast<int>(syscall(SYS_fsync, fd));
}

namespace rcs::test {
namespace {

TEST(StopFile, AStopIsOnTheDiskWithAllFoldersThatItNeeded) {
  const fs::path root = fs::canonical(fresh_folder());
  const std::string path = (root / "state" / "rcs" / "v.stop").string();
  {
    Recorded synced_now;
    ASSERT_TRUE(execute({path, stop_file_text({stop_t{7, "operator"}}), false}).ok());
    EXPECT_THAT(synced_now.paths, testing::IsSupersetOf({root.string(), (root / "state").string(),
                                                         (root / "state" / "rcs").string(), path}));
  }
  // Once they exist, only the file and its folder.
  Recorded synced_now;
  ASSERT_TRUE(execute({path, stop_file_text({stop_t{8, "operator"}}), false}).ok());
  EXPECT_THAT(synced_now.paths, testing::ElementsAre(path, (root / "state" / "rcs").string()));
}

TEST(StopFile, TheCheckedFolderIsOnTheDisk) {
  const fs::path root = fs::canonical(fresh_folder());
  Recorded synced_now;
  ASSERT_TRUE(check_stop_folder((root / "state" / "rcs" / "v.stop").string()).ok());
  EXPECT_THAT(synced_now.paths,
              testing::UnorderedElementsAre(root.string(), (root / "state").string()));
}

TEST(StopFile, ExaminingAFolderCreatesNothing) {
  const fs::path root = fs::canonical(fresh_folder());
  EXPECT_TRUE(examine_stop_folder((root / "v.stop").string()).ok());
  EXPECT_TRUE(examine_stop_folder((root / "state" / "rcs" / "v.stop").string()).ok());
  EXPECT_TRUE(fs::is_empty(root));
  std::ofstream(root / "file") << "x";
  const Outcome examined = examine_stop_folder((root / "file" / "rcs" / "v.stop").string());
  ASSERT_FALSE(examined.ok());
  EXPECT_EQ(examined.error().message,
            "cannot write to the folder " + (root / "file" / "rcs").string() + ": Not a directory");
  if (geteuid() == 0) return;  // may write anywhere
  fs::permissions(root, fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_FALSE(examine_stop_folder((root / "state" / "v.stop").string()).ok());
  EXPECT_FALSE(examine_stop_folder((root / "v.stop").string()).ok());
  fs::permissions(root, fs::perms::owner_all);
}

}  // namespace
}  // namespace rcs::test
