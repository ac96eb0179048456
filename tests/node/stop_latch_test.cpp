#include "rcs/node/stop_latch.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/fresh_folder.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

command_t stop() {
  command_t m{};
  m.issuer = "operator";
  m.serial = 7;
  m.utime = 5;
  m.kind = command_t::KIND_EMERGENCY_STOP;
  return m;
}

class StopLatchFile : public testing::Test {
 protected:
  StopLatchFile() : folder_(fresh_folder()), path_((folder_ / "state" / "v.stop").string()) {}

  [[nodiscard]] StopLatch open() const {
    Result<StopLatch> latch = StopLatch::open(path_);
    EXPECT_TRUE(latch.ok()) << (latch ? "" : latch.error().message);
    return latch ? std::move(latch).value() : StopLatch();
  }
  void write(const std::string& text) const {
    fs::create_directories(fs::path(path_).parent_path());
    std::ofstream(path_) << text;
  }

  fs::path folder_;
  std::string path_;
};

TEST(StopLatch, InMemoryLatchesAndReleases) {
  StopLatch latch;
  EXPECT_FALSE(latch.engaged());
  latch.engage(stop());
  EXPECT_TRUE(latch.engaged());
  EXPECT_TRUE(latch.persisted());
  EXPECT_TRUE(latch.persist().ok());
  EXPECT_TRUE(latch.release().ok());
  EXPECT_FALSE(latch.engaged());
}

TEST_F(StopLatchFile, SurvivesTheProcessUntilItIsReleased) {
  {
    StopLatch latch = open();
    EXPECT_FALSE(latch.engaged());
    latch.engage(stop());
    EXPECT_FALSE(latch.persisted());
    ASSERT_TRUE(latch.persist().ok());
    EXPECT_TRUE(latch.persisted());
  }
  StopLatch next = open();
  EXPECT_TRUE(next.engaged());
  EXPECT_TRUE(next.persisted());
  EXPECT_EQ(next.cause(), "operator, serial 7");
  ASSERT_TRUE(next.release().ok());
  EXPECT_FALSE(next.engaged());
  EXPECT_FALSE(open().engaged());
}

TEST_F(StopLatchFile, ARepeatedStopRecreatesALostFile) {
  StopLatch latch = open();
  latch.engage(stop());
  ASSERT_TRUE(latch.persist().ok());
  fs::remove(path_);  // by a cleanup job or a person
  EXPECT_TRUE(latch.persisted());
  latch.engage(stop());
  EXPECT_FALSE(latch.persisted());
  ASSERT_TRUE(latch.persist().ok());
  EXPECT_TRUE(open().engaged());
}

// Every state of the disk that a crash or damage can leave is either no file or a latched stop.
TEST_F(StopLatchFile, AnyContentIsALatchedStop) {
  StopLatch latch = open();
  latch.engage(stop());
  ASSERT_TRUE(latch.persist().ok());
  std::ifstream file(path_);
  const std::string whole((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (std::size_t n = 0; n <= whole.size(); ++n) {
    write(whole.substr(0, n));
    EXPECT_TRUE(open().engaged()) << n << " bytes";
  }
  write(std::string(100'000, '\0'));
  const StopLatch garbage = open();
  EXPECT_TRUE(garbage.engaged());
  EXPECT_NE(garbage.cause().find(path_ + " exists, but its content is invalid"), std::string::npos)
      << garbage.cause();
}

TEST_F(StopLatchFile, AnyFileAtItsPathIsALatchedStop) {
  fs::create_directories(path_);
  StopLatch folder = open();
  EXPECT_TRUE(folder.engaged());
  EXPECT_NE(folder.cause().find("is not a regular file"), std::string::npos) << folder.cause();
  EXPECT_TRUE(folder.release().ok()) << "an empty folder can be removed";
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_TRUE(open().engaged()) << "and a FIFO does not block";
  fs::remove(path_);
  fs::create_symlink("nowhere", path_);
  EXPECT_TRUE(open().engaged());
}

TEST_F(StopLatchFile, ControlCharactersOfAnIssuerDoNotReachTheFile) {
  command_t m = stop();
  m.issuer = "a\n\033[2Jb\xff";
  StopLatch latch = open();
  latch.engage(m);
  ASSERT_TRUE(latch.persist().ok());
  EXPECT_EQ(open().cause(), "a??[2Jb?, serial 7");
}

TEST_F(StopLatchFile, AFileThatCannotBeCreatedLeavesTheStopInMemory) {
  StopLatch latch = open();
  const fs::path state = fs::path(path_).parent_path();
  fs::remove(state);
  std::ofstream(state) << "a file instead of the folder";
  latch.engage(stop());
  const Outcome failed = latch.persist();
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().message.find(state.string()), std::string::npos)
      << failed.error().message;
  EXPECT_TRUE(latch.engaged());
  EXPECT_FALSE(latch.persisted());
  fs::remove(state);
  EXPECT_TRUE(latch.persist().ok()) << "and the folder is created again";
  EXPECT_TRUE(open().engaged());
}

TEST_F(StopLatchFile, AFileThatCannotBeWrittenIsAnErrorAndStillALatchedStop) {
  StopLatch latch = open();
  latch.engage(stop());
  // As on a full disk: the file can be created but not written.
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &none), 0);
  const Outcome failed = latch.persist();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  (void)signal(SIGXFSZ, ignored);
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().message.find("cannot write " + path_), std::string::npos)
      << failed.error().message;
  EXPECT_TRUE(latch.engaged() && !latch.persisted());
  EXPECT_TRUE(open().engaged());
  EXPECT_TRUE(latch.persist().ok());
}

TEST_F(StopLatchFile, AFailedReleaseHasNoEffect) {
  StopLatch latch = open();
  latch.engage(stop());
  ASSERT_TRUE(latch.persist().ok());
  fs::remove(path_);
  fs::create_directories(fs::path(path_) / "not_empty");
  const Outcome failed = latch.release();
  ASSERT_FALSE(failed.ok());
  EXPECT_NE(failed.error().message.find("cannot remove " + path_), std::string::npos);
  EXPECT_TRUE(latch.engaged());
}

TEST_F(StopLatchFile, AFolderThatCannotBeCreatedIsAnErrorAtTheStart) {
  std::ofstream(folder_ / "file") << "x";
  const Result<StopLatch> latch = StopLatch::open((folder_ / "file" / "v.stop").string());
  ASSERT_FALSE(latch.ok());
  EXPECT_NE(latch.error().message.find((folder_ / "file").string()), std::string::npos);
}

/// The latch of the configuration at this path.
std::string path_of(const fs::path& config) {
  const Result<ParamFile> file = ParamFile::load(config.string());
  EXPECT_TRUE(file.ok());
  const Result<StopLatch> latch = open_stop_latch(*file);
  return latch ? latch->path() : latch.error().message;
}

void set(const char* variable, const std::string& value) {
  (void)setenv(variable, value.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): one thread
}

TEST_F(StopLatchFile, EachConfigurationHasItsOwnLatch) {
  for (const char* v : {"a", "b"}) {
    fs::create_directories(folder_ / v);
    std::ofstream(folder_ / v / "vehicle.toml") << "[process]\nstate_directory = \"../state\"\n";
  }
  const std::string a = path_of(folder_ / "a" / "vehicle.toml");
  EXPECT_EQ(fs::weakly_canonical(fs::path(a).parent_path()), fs::canonical(folder_ / "state"));
  EXPECT_NE(fs::path(a).filename(), fs::path(path_of(folder_ / "b" / "vehicle.toml")).filename());
  // Independently of the notation of the path.
  EXPECT_EQ(fs::path(path_of(folder_ / "b" / ".." / "a" / "vehicle.toml")).filename(),
            fs::path(a).filename());
  fs::create_directory_symlink(folder_ / "a", folder_ / "link");
  EXPECT_EQ(fs::path(path_of(folder_ / "link" / "vehicle.toml")).filename(),
            fs::path(a).filename());
}

TEST_F(StopLatchFile, WithoutTheKeyTheEnvironmentNamesTheFolder) {
  const fs::path config = folder_ / "vehicle.toml";
  std::ofstream(config) << "";
  const auto folder = [&] { return fs::path(path_of(config)).parent_path(); };
  set("STATE_DIRECTORY", (folder_ / "systemd").string() + ":/other");
  set("XDG_STATE_HOME", (folder_ / "xdg").string());
  set("HOME", (folder_ / "home").string());
  EXPECT_EQ(folder(), folder_ / "systemd");
  set("STATE_DIRECTORY",
      "relative");  // would be another folder after a start in another working folder
  EXPECT_EQ(folder(), folder_ / "xdg" / "rcs");
  set("XDG_STATE_HOME", "");
  EXPECT_EQ(folder(), folder_ / "home" / ".local" / "state" / "rcs");
  set("HOME", "");
  EXPECT_NE(path_of(config).find("set [process] state_directory"), std::string::npos);
  set("HOME", "/proc/nowhere");
  EXPECT_NE(path_of(config).find("set [process] state_directory"), std::string::npos)
      << path_of(config);
}

}  // namespace
}  // namespace rcs::test
