// What all commands have in common.

#include <gmock/gmock.h>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class CommandLine : public RcsCommand {};

TEST_F(CommandLine, EveryCommandHasAVersion) {
  for (const char* command : {"", "log ", "log cat ", "register ", "map build "}) {
    EXPECT_EQ(rcs(std::string(command) + "--version"), 0) << command << messages();
    EXPECT_THAT(out(), StartsWith("rcs 0.")) << command;
  }
}

TEST_F(CommandLine, AnUnknownCommandIsNamedWithASuggestion) {
  EXPECT_EQ(rcs("regster a.pcd b.pcd"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown command regster; did you mean register?"));
  EXPECT_EQ(rcs("log ct run.log"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown command ct; did you mean"));
}

TEST_F(CommandLine, AnUnknownOptionIsNamedWithASuggestion) {
  EXPECT_EQ(rcs("eval run.log --jsn"), 2);
  EXPECT_THAT(messages(), HasSubstr("unknown option --jsn; did you mean --json?"));
  EXPECT_EQ(rcs("--hepl"), 2);
  EXPECT_THAT(messages(), HasSubstr("did you mean --help?"));
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
