#include "rcs/base/regular_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdio>
#include <fstream>

namespace rcs {
namespace {

TEST(RegularFile, AFifoAFolderAndADeviceAreRejectedByName) {
  const std::string file = testing::TempDir() + "regular_file_test.txt";
  std::ofstream(file) << "x";
  EXPECT_TRUE(check_regular_file(file));
  const std::string fifo = testing::TempDir() + "regular_file_test.fifo";
  (void)std::remove(fifo.c_str());
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  for (const std::string& path : {fifo, testing::TempDir(), std::string("/dev/zero")}) {
    const Outcome checked = check_regular_file(path);
    ASSERT_FALSE(checked) << path;
    EXPECT_EQ(checked.error().message, path + ": is not a regular file");
  }
  EXPECT_EQ(check_regular_file("/nonexistent/a").error().message,
            "/nonexistent/a: cannot open: No such file or directory");
  (void)std::remove(fifo.c_str());
}

}  // namespace
}  // namespace rcs
