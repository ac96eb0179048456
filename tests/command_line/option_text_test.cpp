// Names, permitted values and defaults of options, as the help and the reference pages state them.
#include "rcs/command_line/option_text.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>

namespace rcs::command_line {
namespace {

using testing::ElementsAre;

class OptionTextTest : public testing::Test {
 protected:
  static std::string value(CLI::Option* option) { return option_text(*option).value; }
  static std::string range(CLI::Option* option) { return permitted(option_text(*option)); }

  CLI::App app_{"", "drive"};
  double number_ = 10.0;
  int count_ = 3;
  unsigned row_ = 0;
  std::string text_;
  std::vector<double> numbers_{0.5, 5.0};
  std::vector<std::string> words_{"a.toml", "b.toml"};
  bool flag_ = false;
};

TEST_F(OptionTextTest, NameOfTheValueIsThatOfItsKind) {
  EXPECT_EQ(value(app_.add_option("--number", number_)), "NUMBER");
  EXPECT_EQ(value(app_.add_option("--count", count_)), "INTEGER");
  EXPECT_EQ(value(app_.add_option("--row", row_)), "INTEGER");
  EXPECT_EQ(value(app_.add_option("--text", text_)), "TEXT");
  EXPECT_EQ(value(app_.add_option("--numbers", numbers_)), "NUMBER");
  EXPECT_EQ(value(app_.add_option("--file", text_)->check(CLI::ExistingFile)), "FILE");
  EXPECT_EQ(value(app_.add_option("--folder", text_)->check(CLI::ExistingDirectory)), "FOLDER");
  EXPECT_EQ(value(app_.add_option("--method", text_)->check(CLI::IsMember({"a", "b"}))), "NAME");
  EXPECT_EQ(value(app_.add_option("--at", text_)->type_name("X,Y")), "X,Y");
  EXPECT_EQ(value(app_.add_flag("--flag", flag_)), "");
}

TEST_F(OptionTextTest, PermittedValuesAreWords) {
  EXPECT_EQ(range(app_.add_option("--a", number_)->check(CLI::Range(0.0, 100.0))), "0 to 100");
  EXPECT_EQ(range(app_.add_option("--b", number_)->check(CLI::Range(0.1, 1e9))), "0.1 to 1e9");
  EXPECT_EQ(range(app_.add_option("--c", number_)->check(CLI::Range(1e-6, 1e12))), "1e-6 to 1e12");
  EXPECT_EQ(range(app_.add_option("--d", count_)->check(CLI::Range(-5, 5))), "-5 to 5");
  EXPECT_EQ(range(app_.add_option("--e", count_)->check(CLI::NonNegativeNumber)), "at least 0");
  EXPECT_EQ(range(app_.add_option("--f", number_)->check(CLI::PositiveNumber)), "more than 0");
  EXPECT_EQ(range(app_.add_option("--g", row_)), "at least 0");
  EXPECT_EQ(range(app_.add_option("--h", number_)), "");
  const CLI::IsMember names({"plane", "paper", "gicp"});
  EXPECT_EQ(range(app_.add_option("--i", text_)->check(names)), "plane, paper or gicp");
}

TEST_F(OptionTextTest, ExplanationStatesRangeDefaultAndRelatedOptions) {
  CLI::Option* global = app_.add_flag("--global", flag_, "search");
  CLI::Option* guess = app_.add_option("--guess", text_, "guess");
  const CLI::Option* radius = app_.add_option("--radius", number_, "largest error [m]")
                                  ->check(CLI::Range(0.0, 100.0))
                                  ->capture_default_str()
                                  ->needs(global)
                                  ->excludes(guess);
  EXPECT_EQ(explained(option_text(*radius)),
            "largest error [m] (0 to 100; default: 10; requires --global; not with --guess)");
  const CLI::Option* out = app_.add_option("-o,--out", text_, "output log")->required();
  EXPECT_EQ(explained(option_text(*out)), "output log (required)");
  EXPECT_EQ(option_text(*out).names, "-o, --out");
}

TEST_F(OptionTextTest, ExplanationRepeatsNothingThatTheMeaningStates) {
  const CLI::Option* jobs =
      app_.add_option("--jobs", count_, "parallel runs; default: one per core")
          ->check(CLI::Range(1, 256))
          ->capture_default_str();
  EXPECT_EQ(explained(option_text(*jobs)), "parallel runs; default: one per core (1 to 256)");
  const CLI::IsMember names({"kitti", "tum"});
  const CLI::Option* both =
      app_.add_option("--format", text_, "kitti: rows; tum: stamps")->check(names);
  EXPECT_EQ(explained(option_text(*both)), "kitti: rows; tum: stamps");
  const CLI::Option* part = app_.add_option("--kind", text_, "tumbling kitti")->check(names);
  EXPECT_EQ(explained(option_text(*part)), "tumbling kitti (kitti or tum)");
}

TEST_F(OptionTextTest, DefaultOfAListIsWrittenAsOnTheCommandLine) {
  const CLI::Option* list =
      app_.add_option("--cell", numbers_)->delimiter(',')->capture_default_str();
  EXPECT_EQ(option_text(*list).standard, "0.5,5");
  const CLI::Option* repeated = app_.add_option("--scenario", words_)->capture_default_str();
  EXPECT_EQ(option_text(*repeated).standard, "a.toml, b.toml");
}

TEST_F(OptionTextTest, SynopsisHasWhatIsRequired) {
  EXPECT_EQ(synopsis_of(app_, "drive"), "drive");
  app_.add_option("LOG", text_)->required();
  app_.add_option("MAP", words_);
  app_.add_option("-o,--out", text_)->type_name("FILE")->required();
  app_.add_option("--sigma", number_)->required();
  EXPECT_EQ(synopsis_of(app_, "drive"), "drive LOG [MAP...] -o FILE --sigma NUMBER");
  app_.add_flag("--json", flag_);
  EXPECT_EQ(synopsis_of(app_, "a drive"), "a drive LOG [MAP...] -o FILE --sigma NUMBER [OPTIONS]");
  app_.add_subcommand("info");
  EXPECT_EQ(synopsis_of(app_, "drive"), "drive COMMAND");
}

TEST_F(OptionTextTest, RelatedOptionsAreInAlphabeticalOrder) {
  CLI::Option* to = app_.add_option("--to", number_);
  CLI::Option* from = app_.add_option("--from", number_);
  const CLI::Option* around = app_.add_option("--around", text_)->excludes(to)->excludes(from);
  EXPECT_THAT(option_text(*around).excludes, ElementsAre("--from", "--to"));
}

}  // namespace
}  // namespace rcs::command_line
