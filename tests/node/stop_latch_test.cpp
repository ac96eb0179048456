#include "rcs/node/stop_latch.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/fresh_folder.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;

using Event = StopLatch::Step::Event;
using Release = StopLatch::Release;

stop_t stop(std::int64_t id = 7, const std::string& issuer = "operator") { return {id, issuer}; }

class StopLatchFile : public testing::Test {
 protected:
  StopLatchFile() : folder_(fresh_folder()), path_((folder_ / "state" / "v.stop").string()) {}

  [[nodiscard]] StopLatch open() const {
    Result<StopLatch> latch = StopLatch::open(path_);
    EXPECT_TRUE(latch.ok()) << (latch ? "" : latch.error().message);
    return latch ? std::move(latch).value() : StopLatch();
  }
  /// What the latch has to do, later than any attempt before.
  StopLatch::Step work(StopLatch* latch) {
    now_ += 2 * StopLatch::kTryAgain;
    return latch->step(now_);
  }
  void expect_persisted(StopLatch* latch) {
    const StopLatch::Step step = work(latch);
    EXPECT_EQ(step.event, Event::kNone) << step.trouble;
    EXPECT_TRUE(latch->persisted());
  }
  void write(const std::string& text) const {
    fs::create_directories(fs::path(path_).parent_path());
    std::ofstream(path_) << text;
  }

  fs::path folder_;
  std::string path_;
  Stamp now_{std::chrono::seconds(100)};
};

TEST(StopLatch, InMemoryLatchesAndReleases) {
  StopLatch latch;
  EXPECT_FALSE(latch.engaged());
  latch.engage(stop());
  EXPECT_TRUE(latch.engaged());
  EXPECT_TRUE(latch.persisted());
  EXPECT_EQ(latch.step(Stamp()).event, Event::kNone);
  EXPECT_EQ(latch.release({7}, "operator", false, Stamp::max()), Release::kAll);
  EXPECT_EQ(latch.step(Stamp()).event, Event::kReleased);
  EXPECT_FALSE(latch.engaged());
  EXPECT_EQ(latch.take_released(), std::vector<std::int64_t>{7});
}

TEST(StopLatch, AStopIsReleasedByItsIssuerOrAnAuthority) {
  StopLatch latch;
  latch.engage(stop(1, "operator"));
  latch.engage(stop(2, "gateway"));
  latch.engage(stop(3, "gateway"));
  latch.engage(stop(0));
  EXPECT_EQ(latch.release({1, 0, 9}, "gateway", false, Stamp::max()), Release::kNone);
  EXPECT_EQ(latch.release({}, "operator", true, Stamp::max()), Release::kNone);
  EXPECT_EQ(latch.release({1, 2}, "gateway", false, Stamp::max()), Release::kSome);
  EXPECT_EQ(latch.take_released(), std::vector<std::int64_t>{2});
  EXPECT_EQ(latch.cause(), "operator, gateway, an unknown issuer");
  EXPECT_EQ(latch.step(Stamp()).event, Event::kNone);
  EXPECT_EQ(latch.release({1, 3, 0}, "operator", true, Stamp::max()), Release::kAll);
  EXPECT_TRUE(latch.engaged()) << "until the step";
  EXPECT_EQ(latch.step(Stamp()).event, Event::kReleased);
}

TEST(StopLatch, AStopThatArrivesBeforeTheReleaseHasTakenEffectEndsIt) {
  StopLatch latch;
  latch.engage(stop(1));
  EXPECT_EQ(latch.release({1}, "operator", false, Stamp::max()), Release::kAll);
  latch.engage(stop(1));
  EXPECT_TRUE(latch.releasing()) << "a copy";
  latch.engage(stop(2));
  EXPECT_EQ(latch.step(Stamp()).event, Event::kNone);
  EXPECT_EQ(latch.stops().size(), 2U);
}

TEST(StopLatch, AStopOfManyEndsAReleaseLikeAnyOther) {
  StopLatch latch;
  std::vector<std::int64_t> all;
  for (int k = 1; k <= 100; ++k) latch.engage(stop(k));
  for (const stop_t& s : latch.stops()) all.push_back(s.id);
  ASSERT_EQ(latch.release(all, "operator", true, Stamp::max()), Release::kAll);
  latch.engage(stop(1));
  EXPECT_TRUE(latch.releasing()) << "a copy";
  latch.engage(stop(200));
  EXPECT_FALSE(latch.releasing()) << "it is one of those without a name";
  EXPECT_EQ(latch.step(Stamp()).event, Event::kNone);
  EXPECT_EQ(latch.stops().size(), all.size());
}

TEST(StopLatch, ASuperiorReleasesTheStopsThatItHasSetOnBehalfOfOthers) {
  StopLatch latch;
  latch.engage(stop(1, "gateway:alice"));
  latch.engage(stop(2, "gateway2"));
  EXPECT_EQ(latch.release({1, 2}, "gateway:bob", false, Stamp::max()), Release::kNone);
  EXPECT_EQ(latch.release({1, 2}, "gateway", false, Stamp::max()), Release::kSome);
  ASSERT_EQ(latch.stops().size(), 1U);
  EXPECT_EQ(latch.stops()[0].id, 2);
}

TEST(StopLatch, TooManyStopsAreOneWithoutAName) {
  StopLatch latch;
  for (int k = 1; k <= 100; ++k) latch.engage(stop(k, "gateway"));
  ASSERT_EQ(latch.stops().size(), StopLatch::kMaxStops + 1);
  std::vector<std::int64_t> all;
  for (const stop_t& s : latch.stops()) all.push_back(s.id);
  EXPECT_EQ(latch.release(all, "gateway", false, Stamp::max()), Release::kSome);
  EXPECT_EQ(latch.release(all, "gateway", false, Stamp::max()), Release::kNone);
  EXPECT_EQ(latch.release(all, "operator", true, Stamp::max()), Release::kAll);
}

TEST_F(StopLatchFile, SurvivesTheProcessUntilItIsReleased) {
  {
    StopLatch latch = open();
    EXPECT_FALSE(latch.engaged());
    latch.engage(stop());
    latch.engage(stop(-9, "gateway"));
    EXPECT_FALSE(latch.persisted());
    expect_persisted(&latch);
  }
  StopLatch next = open();
  EXPECT_TRUE(next.engaged());
  EXPECT_TRUE(next.persisted());
  EXPECT_EQ(next.cause(), "operator, gateway");
  ASSERT_EQ(next.stops().size(), 2U);
  EXPECT_EQ(next.stops()[1].id, -9);
  EXPECT_EQ(next.release({7, -9}, "gateway", false, Stamp::max()), Release::kSome);
  EXPECT_FALSE(next.persisted()) << "the file still lists the other one";
  expect_persisted(&next);
  StopLatch last = open();
  ASSERT_EQ(last.stops().size(), 1U);
  EXPECT_EQ(last.release({7}, "operator", false, Stamp::max()), Release::kAll);
  EXPECT_EQ(work(&last).event, Event::kReleased);
  EXPECT_FALSE(last.engaged());
  EXPECT_FALSE(open().engaged());
}

TEST_F(StopLatchFile, ARepeatedStopRecreatesALostFile) {
  StopLatch latch = open();
  latch.engage(stop());
  expect_persisted(&latch);
  fs::remove(path_);  // by a cleanup job or a person
  expect_persisted(&latch);
  EXPECT_FALSE(open().engaged());
  latch.engage(stop());
  expect_persisted(&latch);
  EXPECT_TRUE(open().engaged());
}

// Every state of the disk that a crash or damage can leave is either no file or a latched stop.
TEST_F(StopLatchFile, AnyContentIsALatchedStop) {
  StopLatch latch = open();
  latch.engage(stop());
  expect_persisted(&latch);
  std::ifstream file(path_);
  const std::string whole((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (std::size_t n = 0; n <= whole.size(); ++n) {
    write(whole.substr(0, n));
    const StopLatch truncated = open();
    ASSERT_EQ(truncated.stops().size(), 1U) << n << " bytes";
    EXPECT_EQ(truncated.stops()[0].id, n < whole.size() ? 0 : 7) << n << " bytes";
  }
  for (std::size_t n = 0; n < whole.size(); ++n) {
    std::string damaged = whole;
    damaged[n] = static_cast<char>(damaged[n] ^ 1);
    write(damaged);
    const StopLatch latched = open();
    ASSERT_EQ(latched.stops().size(), 1U);
    EXPECT_EQ(latched.stops()[0].id, 0) << "byte " << n << ": nobody but an authority releases it";
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
  EXPECT_EQ(folder.release({0}, "operator", true, Stamp::max()), Release::kAll);
  EXPECT_EQ(work(&folder).event, Event::kReleased) << "an empty folder can be removed";
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  EXPECT_TRUE(open().engaged()) << "and a FIFO does not block";
  fs::remove(path_);
  fs::create_symlink("nowhere", path_);
  EXPECT_TRUE(open().engaged());
}

TEST_F(StopLatchFile, ControlCharactersOfAnIssuerDoNotReachTheFile) {
  StopLatch latch = open();
  latch.engage(stop(7, "a\n\033[2Jb\xff"));
  expect_persisted(&latch);
  EXPECT_EQ(open().cause(), "a??[2Jb?");
  EXPECT_EQ(latch.release({7}, "a\n\033[2Jb\xff", false, Stamp::max()), Release::kAll);
}

TEST_F(StopLatchFile, AFileThatCannotBeCreatedLeavesTheStopInMemory) {
  StopLatch latch = open();
  const fs::path state = fs::path(path_).parent_path();
  fs::remove(state);
  std::ofstream(state) << "a file instead of the folder";
  latch.engage(stop());
  const StopLatch::Step failed = work(&latch);
  ASSERT_EQ(failed.event, Event::kNotWritten);
  EXPECT_NE(failed.trouble.find(state.string()), std::string::npos) << failed.trouble;
  EXPECT_TRUE(latch.engaged());
  EXPECT_FALSE(latch.persisted());
  fs::remove(state);
  EXPECT_EQ(latch.step(now_).event, Event::kNone) << "not tried again at once";
  EXPECT_FALSE(latch.persisted());
  expect_persisted(&latch);  // and the folder is created again
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
  const StopLatch::Step failed = work(&latch);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  (void)signal(SIGXFSZ, ignored);
  ASSERT_EQ(failed.event, Event::kNotWritten);
  EXPECT_NE(failed.trouble.find("cannot write " + path_), std::string::npos) << failed.trouble;
  EXPECT_TRUE(latch.engaged() && !latch.persisted());
  EXPECT_TRUE(open().engaged());
  expect_persisted(&latch);
}

TEST_F(StopLatchFile, AFailedReleaseHasNoEffect) {
  StopLatch latch = open();
  latch.engage(stop());
  expect_persisted(&latch);
  fs::remove(path_);
  fs::create_directories(fs::path(path_) / "not_empty");
  EXPECT_EQ(latch.release({7}, "operator", false, Stamp::max()), Release::kAll);
  const StopLatch::Step failed = work(&latch);
  ASSERT_EQ(failed.event, Event::kNotReleased);
  EXPECT_NE(failed.trouble.find("cannot remove " + path_), std::string::npos) << failed.trouble;
  EXPECT_TRUE(latch.engaged());
  EXPECT_FALSE(latch.releasing());
  fs::remove_all(path_);
  expect_persisted(&latch);
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
