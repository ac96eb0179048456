// What all commands have in common.

#include <gmock/gmock.h>

#include <sstream>
#include <vector>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class CommandLine : public RcsCommand {};

TEST_F(CommandLine, EveryCommandHasAVersion) {
  for (const char* command : {"", "log ", "log cut ", "register ", "map build "}) {
    EXPECT_EQ(rcs(std::string(command) + "--version"), 0) << command << messages();
    EXPECT_THAT(out(), StartsWith("rcs 0.")) << command;
  }
}

TEST_F(CommandLine, AnUnknownCommandIsNamedWithASuggestion) {
  EXPECT_EQ(rcs("regster a.pcd b.pcd"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown command regster; did you mean register?"));
  EXPECT_EQ(rcs("log ct run.log"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown command ct; did you mean"));
  EXPECT_EQ(rcs("log ct --help"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown command ct"));
}

TEST_F(CommandLine, AnUnknownOptionIsNamedWithASuggestion) {
  EXPECT_EQ(rcs("eval run.log --jsn"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown option --jsn; did you mean --json?"));
  EXPECT_EQ(rcs("--hepl"), 2);
  EXPECT_THAT(messages(), HasSubstr("did you mean --help?"));
  EXPECT_EQ(rcs("-v"), 2);
  EXPECT_THAT(messages(), HasSubstr("did you mean --version?"));
}

TEST_F(CommandLine, AMissingInputIsReportedByItsCommand) {
  EXPECT_EQ(rcs("log info " + folder_ + "/none.log"), 3);
  EXPECT_EQ(messages(), "rcs log info: " + folder_ + "/none.log: file does not exist\n");
}

/// Full names of all commands without sub-commands: "log cut".
class Leaves : public RcsCommand {
 protected:
  std::vector<std::string> below(const std::string& command) {
    EXPECT_EQ(rcs(command + " --help"), 0) << command;
    std::istringstream help(out());
    std::vector<std::string> leaves;
    bool listed = false;
    for (std::string line; std::getline(help, line);) {
      if (line.empty()) listed = false;
      if (listed && line.size() > 2 && line[2] != ' ') {
        std::string child = command;
        child.append(" ").append(line, 2, line.find(' ', 2) - 2);
        for (const std::string& leaf : below(child)) leaves.push_back(leaf);
      }
      if (line == "Subcommands:") listed = true;
    }
    if (leaves.empty()) leaves.push_back(command);
    return leaves;
  }
};

TEST_F(Leaves, EachHasAnExample) {
  const std::vector<std::string> leaves = below("");
  EXPECT_GE(leaves.size(), 35U);
  for (const std::string& leaf : leaves) {
    EXPECT_EQ(rcs(leaf + " --help"), 0) << leaf;
    EXPECT_THAT(out(), testing::ContainsRegex("Examples?:")) << leaf;
    EXPECT_THAT(out(), HasSubstr("rcs" + leaf)) << leaf;
    std::istringstream help(out());
    for (std::string line; std::getline(help, line);) {
      const bool name = line.rfind("  -", 0) == 0;  // may have a long default value
      if (!name) {
        EXPECT_LE(line.size(), 100U) << line;
      }
    }
  }
}

TEST_F(CommandLine, SeveralValuesAreOneWordSeparatedByCommas) {
  const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
  const std::string sim = "sim " + config + "sim/drill.toml --duration 1 -o " + folder_ + "/a.log ";
  EXPECT_EQ(rcs(sim + "--gps-outage 0,1"), 0) << messages();
  for (const char* wrong : {"0 1", "0", "0,1,2", "0,x", "-1,1"}) {
    EXPECT_EQ(rcs(sim + "--gps-outage " + wrong), 2) << wrong;
  }
  EXPECT_THAT(messages(), HasSubstr("expected BEGIN,LENGTH, each in [0, 1e+06]"));
  // A list does not consume the positional that follows.
  EXPECT_EQ(rcs("log cut --channel INS,GPS_FIX " + folder_ + "/a.log -o " + folder_ + "/b.log"), 0)
      << messages();
  EXPECT_EQ(rcs("log cut --channel INS GPS_FIX -o " + folder_ + "/b.log " + folder_ + "/a.log"), 3);
  EXPECT_EQ(rcs("config show --set sp.icp.gate_m=1 " + config + "demo3.toml"), 0) << messages();
}

TEST_F(CommandLine, AShortCommandPrintsNoProgressWithoutATerminal) {
  const std::string scenario = variable("RCS_SOURCE_DIR") + "/config/sim/drill.toml";
  EXPECT_EQ(rcs("sim " + scenario + " --duration 1 -o " + folder_ + "/a.log"), 0);
  EXPECT_EQ(messages(), "");
}

TEST_F(CommandLine, ProgressIsABarOnATerminalFromTheStart) {
  if (std::system("script --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no script(1)";
  const std::string sim = variable("RCS_BIN_DIR") + "/rcs sim " + variable("RCS_SOURCE_DIR") +
                          "/config/sim/drill.toml --duration 3600 -o " + folder_ + "/a.log";
  const std::string command = "script -qec 'timeout --preserve-status -s INT 1 " + sim + "' " +
                              folder_ + "/screen >/dev/null 2>&1 </dev/null";
  (void)std::system(command.c_str());  // NOLINT(cert-env33-c)
  EXPECT_THAT(text_of(folder_ + "/screen"), HasSubstr("sim ["));
  EXPECT_THAT(text_of(folder_ + "/screen"), HasSubstr("]   0 %"));
}

TEST_F(CommandLine, CtrlCEndsWithStatus130AndNoOutput) {
  const std::string command = "timeout --preserve-status -s INT 0.5 " + variable("RCS_BIN_DIR") +
                              "/rcs sim " + variable("RCS_SOURCE_DIR") +
                              "/config/sim/drill.toml --duration 3600 -o " + folder_ +
                              "/run.log >/dev/null 2>&1";
  const int status = std::system(command.c_str());  // NOLINT(cert-env33-c)
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

}  // namespace
}  // namespace rcs::test
