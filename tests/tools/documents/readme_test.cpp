// The commands of README.md that take seconds, and the options of the others.

#include "tests/tools/documents/readme_fixture.h"

namespace rcs::test {
namespace {

TEST_F(Readme, TheTableListsOnlyCommandsOfTheReadme) {
  EXPECT_GT(commands_.size(), 50U);
  for (const ReadmeCommand& c : kReadmeCommands) {
    const bool found =
        std::any_of(commands_.begin(), commands_.end(), [&c](const std::string& command) {
          return command.compare(0, c.command.size(), c.command) == 0;
        });
    EXPECT_TRUE(found) << c.command;
  }
}

TEST_F(Readme, CommandsInSentencesExistWithTheirOptions) {
  EXPECT_GT(inline_commands_.size(), 40U);
  link_programs();
  for (const std::string& command : inline_commands_) {
    expect_options("build/release/bin/" + command);
  }
}

TEST_F(Readme, EveryCommandRuns) {
  ASSERT_NO_FATAL_FAILURE(make_folder(12.0));
  run_all(false);
}

}  // namespace
}  // namespace rcs::test
