// Effects of every command of `rcs` on its inputs, on devices and on existing files.

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <filesystem>

#include "lcmtypes/channels.h"
#include "rcs/node/log/log_file.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Outputs : public RcsCommand {
 protected:
  Outputs() {
    Result<LogWriter> log = LogWriter::create(log_);
    RCS_CHECK(log.ok());
    const std::uint8_t bytes[] = {1, 2, 3};
    for (int k = 0; k < 100; ++k) {
      const char* channel = k % 2 == 0 ? channel::kIns : channel::kBgDrive;
      RCS_CHECK(log->write(from_utime(1000L * k), channel, bytes, sizeof bytes).ok());
    }
    RCS_CHECK(log->close().ok());
    fs::create_directories(folder_ + "/map");
    fs::create_directories(folder_ + "/calib");
    for (const char* name : {"a.toml", "b.csv", "c.xyz"}) {
      std::ofstream(folder_ + "/" + name) << "precious\n";
    }
  }

  /// Runs the command with a shell in the folder.
  int shell(const std::string& command) {
    const std::string rcs = variable("RCS_BIN_DIR") + "/rcs";
    const std::string line =
        "cd " + folder_ + " && rcs=" + rcs + " && { " + command + "; } 2>" + folder_ + "/messages";
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] int partial_files() const {
    int n = 0;
    for (const fs::directory_entry& e : fs::recursive_directory_iterator(folder_)) {
      n += e.path().string().find(".part") != std::string::npos ? 1 : 0;
    }
    return n;
  }

  std::string log_ = folder_ + "/run.log";
};

TEST_F(Outputs, NoCommandWritesOverItsInput) {
  const std::string commands[] = {
      "replay a.toml run.log -o run.log",
      "replay a.toml run.log -o a.toml",
      "log cut run.log -o run.log",
      "eval run.log --truth b.csv --export run.log",
      "eval run.log --truth b.csv --report b.csv",
      "eval run.log --truth b.csv --svg run.log",
      "report run.log -o run.log",
      "report run.log -o page.html --svg run.log",
      "import kitti --scans map --poses b.csv --calib calib -o b.csv",
      "import imu-gps b.csv --columns a.toml -o b.csv",
      "import comma2k19 map -o map",
      "sim a.toml -o a.toml",
      "sim a.toml -o new.log --prior-map a.toml",
      "map build run.log -o run.log",
      "map build run.log --prior map -o map",
      "map merge map calib -o map",
      "map diff map calib --picture map",
      "map export map --geotiff map",
      "map export map --hillshade map",
      "map import raster b.csv --heights EGM96 --sigma 1 --date 2020-01-01 -o b.csv",
      "map import cloud c.xyz --heights EGM96 --sigma 1 --date 2020-01-01 -o c.xyz",
      "map import av2 map --sigma 0.1 -o map",
      "map localizability map -o map",
      "map study a.toml -o a.toml",
      "smooth run.log --config a.toml -o run.log",
      "budget a.toml run.log --svg run.log",
      "drill a.toml -o a.toml",
      "consistency --scenario a.toml -o a.toml",
      "outages run.log --config a.toml --logs run.log",
      "register c.xyz b.csv --plot c.xyz",
      "view run.log --shot t=0 -o run.log",
  };
  const std::string before = text_of(log_);
  for (const std::string& command : commands) {
    EXPECT_EQ(shell("$rcs " + command), 3) << command;
    EXPECT_THAT(messages(), HasSubstr("is also an input of this command")) << command;
    EXPECT_EQ(text_of(log_), before) << command;
    for (const char* name : {"a.toml", "b.csv", "c.xyz"}) {
      EXPECT_EQ(text_of(folder_ + "/" + name), "precious\n") << command;
    }
  }
  EXPECT_EQ(partial_files(), 0);
}

TEST_F(Outputs, NoOutputIsWrittenIntoAMap) {
  const std::string index = folder_ + "/map/map.index";
  std::ofstream(index) << "precious\n";
  fs::create_symlink("map/new.log", folder_ + "/link.log");
  for (const char* command : {
           "map diff map calib --picture map/map.index",
           "map diff map calib --picture calib/../map/1m/new.png",
           "map merge calib calib -o map/inner",
           "replay a.toml run.log -o map/new.log",
           "report run.log -o map/new/page.html",
           "log cut run.log -o map/new.log",
           "log cut run.log -o link.log",
       }) {
    EXPECT_EQ(shell(std::string("$rcs ") + command), 3) << command;
    EXPECT_THAT(messages(), HasSubstr("is in the a priori map")) << command;
    EXPECT_EQ(text_of(index), "precious\n") << command;
    EXPECT_EQ(std::distance(fs::directory_iterator(folder_ + "/map"), {}), 1) << command;
  }
  // A writer of maps may replace the map itself.
  for (const char* name : {"map", "map/"}) {
    EXPECT_EQ(shell(std::string("$rcs map merge calib calib -o ") + name), 3) << name;
    EXPECT_THAT(messages(), testing::Not(HasSubstr("is in the a priori map"))) << name;
  }
}

TEST_F(Outputs, ALinkTargetIsWrittenEvenIfItDoesNotExist) {
  fs::create_directories(folder_ + "/disk");
  fs::create_symlink("disk/new.log", folder_ + "/second.log");
  fs::create_symlink(folder_ + "/second.log", folder_ + "/first.log");
  ASSERT_EQ(shell("$rcs log cut run.log -o first.log"), 0) << messages();
  for (const char* link : {"/first.log", "/second.log"}) {
    EXPECT_TRUE(fs::is_symlink(folder_ + link)) << link;
  }
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder_ + "/disk/new.log")));
}

TEST_F(Outputs, AnInputIsIdentifiedByItsInodeNotByItsName) {
  fs::create_symlink(log_, folder_ + "/soft.log");
  fs::create_hard_link(log_, folder_ + "/hard.log");
  const std::string before = text_of(log_);
  for (const char* name : {"soft.log", "hard.log", "./run.log", "map/../run.log"}) {
    EXPECT_EQ(shell(std::string("$rcs log cut run.log -o ") + name), 3) << name;
    EXPECT_THAT(messages(), HasSubstr("is also an input of this command")) << name;
    EXPECT_EQ(text_of(log_), before) << name;
  }
  // Named after OUT.
  fs::create_hard_link(log_, folder_ + "/new.log.timing");
  EXPECT_EQ(shell("$rcs replay a.toml run.log -o new.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("new.log.timing: is also an input of this command"));
}

TEST_F(Outputs, AFileThatAnInputNamesIsAnInput) {
  const std::string source = variable("RCS_SOURCE_DIR") + "/config/sim/";
  for (const char* name : {"town.toml", "reference.toml", "town.asc", "ins_grades.toml"}) {
    fs::copy_file(source + name, folder_ + "/" + name);
  }
  std::ofstream(folder_ + "/short.toml") << "based_on = \"town.toml\"\n";
  for (const char* name : {"short.toml", "reference.toml", "town.asc", "ins_grades.toml"}) {
    const std::string before = text_of(folder_ + "/" + name);
    EXPECT_EQ(shell(std::string("$rcs sim short.toml --duration 1 -o ") + name), 3) << name;
    EXPECT_THAT(messages(), HasSubstr("is also an input of this command")) << name;
    EXPECT_EQ(text_of(folder_ + "/" + name), before) << name;
  }
  EXPECT_EQ(partial_files(), 0);
}

TEST_F(Outputs, ARunWithANameIsAnInput) {
  ASSERT_EQ(shell("$rcs sim " + variable("RCS_SOURCE_DIR") +
                  "/config/sim/drill.toml --duration 12 -o drive.log && $rcs replay " +
                  variable("RCS_SOURCE_DIR") + "/config/demo3.toml drive.log -o result.log"),
            0)
      << messages();
  const std::string before = text_of(folder_ + "/result.log");
  EXPECT_EQ(shell("$rcs report x=result.log -o result.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("is also an input of this command"));
  EXPECT_EQ(shell("$rcs report x=result.log -o page.html --svg ./result.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("is also an input of this command"));
  EXPECT_EQ(text_of(folder_ + "/result.log"), before);
}

TEST_F(Outputs, TwoOutputsHaveTwoNames) {
  for (const char* command :
       {"eval run.log --report a.html --svg ./a.html",
        "map export map --geotiff x --hillshade map/../x", "sim a.toml -o new --prior-map new"}) {
    EXPECT_EQ(shell(std::string("$rcs ") + command), 3) << command;
    EXPECT_THAT(messages(), HasSubstr("is the name of two outputs of this command")) << command;
  }
  EXPECT_EQ(shell("$rcs eval run.log --report /dev/null --svg /dev/null"), 3);
  EXPECT_THAT(messages(), testing::Not(HasSubstr("two outputs"))) << "a device";
}

TEST_F(Outputs, AClosedStreamIsNoFile) {
  EXPECT_EQ(shell("$rcs log cut nothing.log -o cut.log 2>&- <&-"), 3);
  EXPECT_EQ(shell("$rcs log cut run.log -o cut.log >&- 2>&- <&-"), 0);
  EXPECT_EQ(shell("$rcs log cut run.log -o plain.log"), 0);
  EXPECT_EQ(text_of(folder_ + "/cut.log"), text_of(folder_ + "/plain.log"));
  EXPECT_EQ(shell("$rcs log info run.log >&-"), 3) << "the result is lost";
}

TEST_F(Outputs, AMessageThatCannotBeWrittenDoesNotEndTheWork) {
  EXPECT_EQ(shell("$rcs log cut run.log -o full.log 2>/dev/full"), 0);
  EXPECT_TRUE(fs::exists(folder_ + "/full.log"));
  EXPECT_EQ(shell("{ $rcs log cut run.log -o pipe.log; echo $? >status; } 2>&1 | true; true"), 0);
  EXPECT_TRUE(fs::exists(folder_ + "/pipe.log"));
  EXPECT_EQ(text_of(folder_ + "/status"), "0\n");
}

TEST_F(Outputs, AMessageHasNoControlCharactersAndNoInternalNames) {
  std::ofstream(folder_ + "/bad.toml") << "[\"sp\\u001b[31m\"]\nx = 1\n";
  EXPECT_EQ(shell("$rcs config check bad.toml >out"), 1);
  EXPECT_THAT(text_of(folder_ + "/out"), HasSubstr("\\u001b[31m"));
  EXPECT_EQ(text_of(folder_ + "/out").find('\x1b'), std::string::npos);
  std::ofstream(folder_ + "/bad.xyz") << "1 2 \x1b[31m\n";
  EXPECT_EQ(shell("$rcs register bad.xyz $(printf 'no\\033[2J.xyz')"), 3);
  EXPECT_EQ(messages().find('\x1b'), std::string::npos) << messages();
  EXPECT_EQ(shell("$rcs log cut run.log -o a.toml/x.log"), 3);
  EXPECT_EQ(messages(), "rcs log cut: a.toml/x.log: cannot create its folder: Not a directory\n");
  const std::string name(250, 'x');
  EXPECT_EQ(shell("$rcs log cut run.log -o " + name), 3);
  EXPECT_THAT(messages(), testing::Not(HasSubstr(".partial")));
}

TEST_F(Outputs, ACommandThatCannotWorkPrintsNoDocument) {
  for (const char* command : {"log list map --json", "config explain nope gate_m --json",
                              "register c.xyz c.xyz --json --plot /dev/null",
                              "go --halt --json --lcm-url 'udpm://239.255.76.99:9999?ttl=0'"}) {
    EXPECT_GE(shell(std::string("$rcs ") + command + " >out"), 2) << command;
    EXPECT_EQ(text_of(folder_ + "/out"), "") << command;
  }
}

TEST_F(Outputs, ANegativeResultHasADocument) {
  EXPECT_EQ(shell("$rcs log cut run.log --around mode -o cut.log --json >out"), 1) << messages();
  EXPECT_THAT(text_of(folder_ + "/out"), HasSubstr("\"occurrences\": 0"));
  EXPECT_EQ(shell("$rcs log mcap run.log --channel NOPE -o x.mcap --json >out"), 1) << messages();
  EXPECT_THAT(text_of(folder_ + "/out"), HasSubstr("\"mcap\": null"));
}

TEST_F(Outputs, AFifoOrDeviceIsWrittenInPlace) {
  ASSERT_EQ(shell("mkfifo pipe && { cat pipe >got & } && $rcs log cut run.log -o pipe && wait"), 0)
      << messages();
  ASSERT_EQ(shell("$rcs log cut run.log -o plain.log"), 0);
  EXPECT_TRUE(fs::is_fifo(folder_ + "/pipe"));
  EXPECT_EQ(text_of(folder_ + "/got"), text_of(folder_ + "/plain.log"));
  EXPECT_EQ(partial_files(), 0);

  const std::string full = folder_ + "/full";
  if (::mknod(full.c_str(), S_IFCHR | 0666, makedev(1, 7)) != 0 || !std::ofstream(full)) {
    GTEST_SKIP() << "SKIPPED: no device nodes may be made here";
  }
  EXPECT_EQ(shell("$rcs log cut run.log -o full"), 3);
  EXPECT_THAT(messages(), HasSubstr("No space left on device"));
  EXPECT_TRUE(fs::is_character_file(full));
  EXPECT_EQ(shell("$rcs smooth run.log --config a.toml -o full"), 3);
  EXPECT_TRUE(fs::is_character_file(full));
}

TEST_F(Outputs, AFullStandardOutputIsAnError) {
  for (const char* command : {"log info run.log", "log info run.log --json", "log list run.log",
                              "--help", "log cut --help", "drill --list"}) {
    EXPECT_EQ(shell(std::string("$rcs ") + command + " >/dev/full"), 3) << command;
    EXPECT_FALSE(messages().empty()) << command;
  }
  EXPECT_EQ(shell("$rcs log info run.log >/dev/null"), 0) << messages();
}

TEST_F(Outputs, AFailureKeepsTheOldFileAndASuccessReplacesItWithItsLinkAndMode) {
  const std::string old = folder_ + "/old.log";
  std::ofstream(old) << "old";
  EXPECT_EQ(shell("$rcs log cut run.log --channel NOBODY -o old.log"), 3);
  EXPECT_EQ(text_of(old), "old");
  EXPECT_EQ(partial_files(), 0);
  fs::permissions(old, fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("old.log", folder_ + "/link.log");
  EXPECT_EQ(shell("$rcs log cut run.log --sensors -o link.log"), 0) << messages();
  EXPECT_TRUE(fs::is_symlink(folder_ + "/link.log"));
  EXPECT_EQ(fs::status(old).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  Result<LogReader> cut = LogReader::open(old);
  ASSERT_TRUE(cut);
  LogEvent event;
  int events = 0;
  for (; cut->next(&event); ++events) EXPECT_EQ(event.channel, channel::kIns);
  EXPECT_EQ(events, 50);
}

TEST_F(Outputs, AnInterruptKeepsTheOldFile) {
  const std::string scenario = variable("RCS_SOURCE_DIR") + "/config/sim/drill_long.toml";
  std::ofstream(folder_ + "/old.log") << "old";
  for (const char* signal : {"INT", "TERM", "HUP"}) {
    // The simulation takes minutes, and its temporary file exists from its start.
    EXPECT_NE(shell(std::string("timeout --signal=") + signal + " --kill-after=20 3 $rcs sim " +
                    scenario + " -o old.log"),
              0)
        << signal;
    EXPECT_EQ(text_of(folder_ + "/old.log"), "old") << signal;
    EXPECT_EQ(partial_files(), 0) << signal;
  }
}

}  // namespace
}  // namespace rcs::test
