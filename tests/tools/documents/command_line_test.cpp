// What all commands have in common.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <sstream>
#include <vector>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class CommandLine : public RcsCommand {
 protected:
  /// Exit status of a program of the system, next to rcs; its output is out() and messages().
  int run(const std::string& command) {
    const std::string line = variable("RCS_BIN_DIR") + "/" + command + " >" + folder_ + "/out 2>" +
                             folder_ + "/messages";
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// The programs that this build has.
  static std::vector<std::string> programs() {
    std::vector<std::string> built;
    for (const char* name :
         {"rcs", "sp", "wm", "bg", "gateway", "ros2_bridge", "sim", "rcs_view"}) {
      if (std::filesystem::exists(variable("RCS_BIN_DIR") + "/" + name)) built.emplace_back(name);
    }
    return built;
  }
};

/// Lines of a help that are wider than a terminal, or that have the words of CLI11.
std::string flaws_of(const std::string& help) {
  std::string flaws;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    bool flaw = line.size() > 100;
    for (const char* word :
         {"FLOAT:", "TEXT:", "INT:", "REQUIRED", "Needs:", "Excludes:", "UINT"}) {
      flaw = flaw || line.find(word) != std::string::npos;
    }
    if (flaw) flaws += line + "\n";
  }
  return flaws;
}

TEST_F(CommandLine, EveryProgramHasHelpAndVersion) {
  EXPECT_GE(programs().size(), 7U);
  for (const std::string& program : programs()) {
    EXPECT_EQ(run(program + " --help"), 0) << program;
    EXPECT_EQ(flaws_of(out()), "") << program;
    EXPECT_THAT(out(), HasSubstr("\nUsage: ")) << program;
    EXPECT_THAT(out(), HasSubstr("  --version   ")) << program;
    EXPECT_EQ(run(program + " --version"), 0) << program;
    const bool rcs = program.rfind("rcs", 0) == 0;
    EXPECT_THAT(out(), StartsWith(rcs ? "rcs 0." : program + " (rcs) 0.")) << program;
    EXPECT_EQ(messages(), "") << program;
  }
}

TEST_F(CommandLine, EveryProgramNamesAnUnknownOption) {
  for (const std::string& program : programs()) {
    const std::string name = program == "rcs_view" ? "rcs view" : program;
    EXPECT_EQ(run(program + " --bogus"), 2) << program;
    EXPECT_EQ(messages(), fmt::format("{0}: unknown option --bogus (see `{0} --help`)\n", name));
    EXPECT_EQ(run(program + " --hepl"), 2) << program;
    EXPECT_THAT(messages(), HasSubstr("unknown option --hepl; did you mean --help?")) << program;
  }
}

TEST_F(CommandLine, NodesAndSimulatorNameAMissingArgument) {
  EXPECT_EQ(run("wm"), 2);
  EXPECT_EQ(messages(), "wm: CONFIG is required; see `wm --help`\n");
  EXPECT_EQ(run("sim"), 2);
  EXPECT_EQ(messages(), "sim: SCENARIO is required; see `sim --help`\n");
  EXPECT_EQ(run("sim a.toml --gps-outage 0,nan"), 2);
  EXPECT_THAT(messages(), HasSubstr("nan is not a finite number"));
}

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
      if (line == "Commands:") listed = true;
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
    EXPECT_EQ(flaws_of(out()), "") << leaf;
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
