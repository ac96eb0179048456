// The help of a program with commands.
#include "rcs/command_line/program_text.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "rcs/base/text.h"

namespace rcs::command_line {
namespace {

using testing::HasSubstr;
using testing::Not;

class Help : public testing::Test {
 protected:
  Help() {
    app_.footer("Exit status: 0 done.");
    log_->add_option("LOG", log_file_, "event log")->required();
    log_->add_option("--radius", radius_, "largest error of the guess [m]")
        ->check(CLI::Range(0.0, 100.0))
        ->capture_default_str();
    log_->footer("The text below.\nExample:\n  rcs log run.log");
  }
  [[nodiscard]] std::string help(const std::string& name) const {
    return help_text(
        program_text(name == "rcs" ? app_ : *app_.get_subcommand(name.substr(4)), name));
  }

  CLI::App app_{"All programs.", "rcs"};
  CLI::App* log_ = app_.add_subcommand("log", "Print a log");
  CLI::App* map_ = app_.add_subcommand("map", "Print a map");
  std::string log_file_;
  double radius_ = 10.0;
};

TEST_F(Help, OfACommandHasUsageArgumentsAndOptions) {
  EXPECT_EQ(help("rcs log"),
            "Print a log.\n\n"
            "Usage: rcs log LOG [OPTIONS]\n\n"
            "Arguments:\n"
            "  LOG                       event log\n\n"
            "Options:\n"
            "  --radius NUMBER           largest error of the guess [m] (0 to 100; default: 10)\n"
            "  -h, --help                print this help and exit\n"
            "  --version                 print the version and exit\n\n"
            "The text below.\nExample:\n  rcs log run.log\n");
}

TEST_F(Help, OfAProgramListsItsCommands) {
  EXPECT_THAT(help("rcs"), HasSubstr("Usage: rcs COMMAND\n\nCommands:\n  log    "));
  EXPECT_THAT(help("rcs"), HasSubstr("`rcs COMMAND --help` describes a command"));
  EXPECT_THAT(help("rcs"), HasSubstr("\nExit status: 0 done.\n"));
}

TEST_F(Help, ACommandHasNotTheTextOfItsParent) {
  EXPECT_THAT(help("rcs map"), Not(HasSubstr("Exit status")));
}

TEST_F(Help, LongNamesAndTextsAreBroken) {
  std::string text;
  for (int i = 0; i < 40; ++i) text += "meaning" + std::to_string(i) + " ";
  log_->add_option("--a-name-of-many-words", radius_, text);
  log_->description(text);
  std::istringstream lines(help("rcs log"));
  int long_lines = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), kTextColumns) << line;
    long_lines += line.size() > kTextColumns - 15 ? 1 : 0;
  }
  EXPECT_GT(long_lines, 5);
  EXPECT_THAT(help("rcs log"),
              HasSubstr("  --a-name-of-many-words NUMBER\n                         "));
}

TEST_F(Help, ExamplesAreApartFromTheDescription) {
  const ProgramText text = program_text(*log_, "rcs log");
  ASSERT_EQ(text.description.size(), 1U);
  EXPECT_EQ(text.description[0].text, "The text below.");
  ASSERT_EQ(text.examples.size(), 1U);
  EXPECT_EQ(text.examples[0].text, "  rcs log run.log");
  EXPECT_TRUE(text.examples[0].verbatim);
}

}  // namespace
}  // namespace rcs::command_line
