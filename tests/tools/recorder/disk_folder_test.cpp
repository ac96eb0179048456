// The folder of a recording in the file system.

#include "tools/recorder/disk_folder.h"

#include <gmock/gmock.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/fresh_folder.h"

namespace rcs::recorder {
namespace {

namespace fs = std::filesystem;

TEST(DiskFolder, FilesAreAppendedListedAndRemovedAndNeverOverwritten) {
  const std::string path = test::fresh_folder() / "new" / "folder";
  const Result<std::unique_ptr<DiskFolder>> opened = DiskFolder::open(path);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  DiskFolder& folder = **opened;
  const std::uint8_t bytes[] = {'a', 'b', 'c'};
  {
    std::unique_ptr<AppendFile> file;
    ASSERT_EQ(folder.create("one", &file), 0);
    std::size_t written = 0;
    EXPECT_EQ(file->append(bytes, 3, &written), 0);
    EXPECT_EQ(written, 3U);
    EXPECT_EQ(file->append(bytes, 2, &written), 0);
    EXPECT_EQ(file->sync(), 0);
    EXPECT_EQ(folder.sync(), 0);
    std::unique_ptr<AppendFile> again;
    EXPECT_EQ(folder.create("one", &again), EEXIST);
  }
  fs::create_directory(fs::path(path) / "sub");
  fs::create_symlink("one", fs::path(path) / "link");
  std::ifstream in(fs::path(path) / "one");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "abcab");
  std::vector<FolderEntry> entries;
  ASSERT_EQ(folder.list(&entries), 0);
  ASSERT_EQ(entries.size(), 1U);
  EXPECT_EQ(entries[0].name, "one");
  EXPECT_EQ(entries[0].bytes, 5);
  EXPECT_GT(folder.free_bytes(), 0);
  EXPECT_EQ(folder.remove("one"), 0);
  EXPECT_EQ(folder.remove("one"), ENOENT);
}

TEST(DiskFolder, ASecondRecorderIsRejected) {
  const std::string path = test::fresh_folder();
  {
    const Result<std::unique_ptr<DiskFolder>> first = DiskFolder::open(path);
    ASSERT_TRUE(first.ok());
    const Result<std::unique_ptr<DiskFolder>> second = DiskFolder::open(path);
    ASSERT_FALSE(second.ok());
    EXPECT_THAT(second.error().message,
                testing::HasSubstr("another recorder writes to this folder"));
  }
  EXPECT_TRUE(DiskFolder::open(path).ok());
}

TEST(DiskFolder, AFolderThatCannotBeMadeIsNamed) {
  const fs::path file = test::fresh_folder() / "file";
  std::ofstream(file) << "x";
  for (const fs::path& path : {file, file / "below", fs::path("/proc/nowhere")}) {
    const Result<std::unique_ptr<DiskFolder>> opened = DiskFolder::open(path.string());
    ASSERT_FALSE(opened.ok()) << path;
    EXPECT_THAT(opened.error().message,
                testing::StartsWith(path.string() + ": cannot record to this folder: "));
  }
}

}  // namespace
}  // namespace rcs::recorder
