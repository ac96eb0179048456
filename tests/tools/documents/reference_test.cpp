// The generated documents: docs/reference, man pages, completion.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <regex>
#include <set>
#include <sstream>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::IsSupersetOf;

class Reference : public RcsCommand {
 protected:
  /// Exit status of a shell command; its output is in said() afterwards.
  int shell(const std::string& command) {
    std::ofstream(folder_ + "/command.sh") << command << "\n";
    const std::string line = "bash " + folder_ + "/command.sh >" + folder_ + "/said 2>&1";
    const int status = std::system(line.c_str());  // NOLINT(cert-env33-c)
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string said() const { return text_of(folder_ + "/said"); }
  [[nodiscard]] static std::string page(const std::string& name) {
    return text_of(variable("RCS_SOURCE_DIR") + "/docs/reference/" + name + ".md");
  }
  /// Commands of a --help: the first words of the lines below "Commands:".
  std::vector<std::string> commands_in_help(const std::string& command) {
    EXPECT_EQ(rcs(command + " --help"), 0) << messages();
    const std::string help = out();
    std::vector<std::string> found;
    std::istringstream lines(help.substr(std::min(help.find("Commands:"), help.size())));
    std::string line;
    std::getline(lines, line);
    for (; std::getline(lines, line) && line.compare(0, 2, "  ") == 0;) {
      if (line[2] != ' ') found.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
    return found;
  }
  /// What bash offers for a line whose last word is being written.
  std::vector<std::string> completed(const std::vector<std::string>& words) {
    std::string line = "source " + folder_ + "/rcs.bash; COMP_WORDS=(";
    for (const std::string& word : words) line += "'" + word + "' ";
    line += "); COMP_CWORD=" + std::to_string(words.size() - 1) +
            "; _rcs; printf '%s\\n' \"${COMPREPLY[@]}\"";
    EXPECT_EQ(shell(line), 0) << said();
    std::istringstream lines(said());
    std::vector<std::string> found;
    for (std::string one; std::getline(lines, one);) {
      if (!one.empty()) found.push_back(one);
    }
    return found;
  }
};

TEST_F(Reference, PagesAreCurrent) {
  ASSERT_EQ(rcs("reference pages -o " + folder_ + " --lcmtypes " + variable("RCS_SOURCE_DIR") +
                "/lcmtypes"),
            0)
      << messages();
  for (const char* name : {"cli", "configuration", "messages", "events"}) {
    const std::string generated = text_of(folder_ + "/" + name + ".md");
    ASSERT_FALSE(generated.empty()) << name;
    EXPECT_TRUE(generated == page(name))
        << "docs/reference/" << name
        << ".md is not current. Run: build/release/bin/rcs reference pages";
  }
}

TEST_F(Reference, CommandPageHasEveryCommand) {
  const std::string cli = page("cli");
  const std::vector<std::string> commands = commands_in_help("");
  EXPECT_GT(commands.size(), 20U);
  for (const std::string& command : commands) {
    EXPECT_THAT(cli, HasSubstr("\n## rcs " + command + "\n"));
    for (const std::string& sub : commands_in_help(command)) {
      EXPECT_THAT(cli, HasSubstr(fmt::format("\n### rcs {} {}\n", command, sub)));
    }
  }
  EXPECT_THAT(cli, HasSubstr("| `-o, --out` |"));
  EXPECT_THAT(cli, HasSubstr("\n## sim\n"));
  EXPECT_THAT(cli, HasSubstr("\n| 2 | ")) << "the exit statuses";
}

TEST_F(Reference, MessagePageHasEveryFieldWithItsUnit) {
  const std::string messages = page("messages");
  EXPECT_THAT(messages, HasSubstr("| `BG_STATUS` | output | [status_t](#status_t) | bg | 20 Hz |"));
  EXPECT_THAT(messages, HasSubstr("| `v_world_mps` | double[3] | m/s |"));
  EXPECT_THAT(messages, HasSubstr("| `cov_world_pose` | double[6][6] |"));
  EXPECT_THAT(messages, HasSubstr("| `MODE_LOST` | 7 | no source: the pose becomes invalid |"));
}

TEST_F(Reference, EventsNameOnlyKeysThatExist) {
  const std::string configuration = page("configuration");
  const std::string events = page("events");
  const std::regex key("\\[([a-z_.]+)\\]( [a-z0-9_]+_[a-z0-9_]+)?");
  int found = 0;
  for (std::sregex_iterator m(events.begin(), events.end(), key), end; m != end; ++m, ++found) {
    const std::size_t table = configuration.find("\n## [" + (*m)[1].str() + "]\n");
    if ((*m)[1].str().compare(0, 8, "process.") == 0) continue;  // of a node
    ASSERT_NE(table, std::string::npos) << (*m)[0];
    if (!(*m)[2].matched) continue;
    const std::string section =
        configuration.substr(table, configuration.find("\n## ", table + 1) - table);
    EXPECT_THAT(section, HasSubstr("| `" + (*m)[2].str().substr(1) + "` |")) << (*m)[0];
  }
  EXPECT_GT(found, 10);
}

TEST_F(Reference, EveryCommandHasAManPageWithoutWarnings) {
  ASSERT_EQ(rcs("reference man -o " + folder_ + "/man1"), 0) << messages();
  for (const std::string& command : commands_in_help("")) {
    EXPECT_TRUE(fs::exists(folder_ + "/man1/rcs-" + command + ".1")) << command;
  }
  EXPECT_THAT(text_of(folder_ + "/man1/rcs-replay.1"), HasSubstr("\\fB\\-o, \\-\\-out\\fR"));
  if (shell("command -v groff") != 0) {
    GTEST_SKIP() << "NOT RUN: groff, which finds errors in the man pages, is not installed";
  }
  for (const auto& entry : fs::directory_iterator(folder_ + "/man1")) {
    EXPECT_EQ(shell("groff -man -ww -z " + entry.path().string()), 0);
    EXPECT_THAT(said(), IsEmpty()) << entry.path();
  }
}

TEST_F(Reference, BashCompletesCommandsOptionsAndValues) {
  ASSERT_EQ(rcs("reference completion -o " + folder_ + "/rcs.bash"), 0) << messages();
  EXPECT_EQ(completed({"rcs", ""}), commands_in_help(""));
  EXPECT_THAT(completed({"rcs", "repl"}), ElementsAre("replay"));
  EXPECT_THAT(completed({"rcs", "log", "c"}), testing::UnorderedElementsAre("cut", "csv"));
  EXPECT_THAT(completed({"rcs", "log", "cut", "run.log", "--se"}), ElementsAre("--sensors"));
  EXPECT_THAT(completed({"rcs", "replay", "-"}),
              IsSupersetOf({"-o", "--out", "--without", "--help", "--version"}));
  EXPECT_THAT(completed({"rcs", "eval", "run.log", "--format", ""}), ElementsAre("kitti", "tum"));
  EXPECT_THAT(completed({"rcs", "eval", "run.log", "--format", "=", "t"}), ElementsAre("tum"));
  EXPECT_THAT(completed({"rcs", "load", ""}), ElementsAre("cpu", "io", "memory"));
  // Files: readline completes them when nothing is offered.
  EXPECT_THAT(completed({"rcs", "eval", "ru"}), IsEmpty());
  EXPECT_EQ(shell("source " + folder_ + "/rcs.bash; complete -p rcs"), 0);
  EXPECT_THAT(said(), HasSubstr("-o default"));
}

}  // namespace
}  // namespace rcs::test
