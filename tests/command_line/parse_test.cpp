// Version, help and errors of a command line.
#include "rcs/command_line/parse.h"

#include <gmock/gmock.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "rcs/base/exit_status.h"

namespace rcs::command_line {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// A program without commands.
class Node : public testing::Test {
 protected:
  Node() {
    app_.add_option("CONFIG", config_, "configuration")->required();
    app_.add_option("--method", method_)->check(CLI::IsMember({"plane", "paper", "gicp"}));
    app_.add_option("--radius", radius_)->check(CLI::Range(0.0, 100.0));
    app_.add_option("--seeds", seeds_)->check(CLI::PositiveNumber);
    app_.add_option("--outage", outage_)->delimiter(',')->expected(2)->type_name("BEGIN,LENGTH");
    app_.add_option("-o,--out", out_)->type_name("FILE");
    app_.add_option("--record", record_)->expected(0, 1)->type_name("[FOLDER]");
    app_.add_option("--seed", seed_);
    app_.add_option("--first", first_);
    CLI::Option* check = app_.add_flag("--check", check_);
    app_.add_flag("--json", json_)->needs(check);
  }
  std::optional<Ending> parsed(std::vector<const char*> words, const FolderAdvice& advice = {}) {
    words.insert(words.begin(), "wm");
    return parse(&app_, static_cast<int>(words.size()), words.data(), advice);
  }
  /// The message of an invalid command line, without its end, which names the help.
  std::string error(const std::vector<const char*>& words) {
    const std::optional<Ending> ended = parsed(words);
    if (!ended) return "no error";
    EXPECT_EQ(ended->status, kExitUsage);
    const std::size_t end = ended->text.find("; see `wm --help`\n");
    EXPECT_NE(end, std::string::npos) << ended->text;
    return ended->text.substr(0, end);
  }

  CLI::App app_{"Node wm", "wm"};
  std::string config_;
  std::string method_;
  std::string out_;
  std::string record_;
  double radius_ = 0.0;
  int seeds_ = 1;
  std::optional<std::int64_t> seed_;
  std::optional<std::size_t> first_;
  std::vector<double> outage_;
  bool check_ = false;
  bool json_ = false;
};

TEST_F(Node, AValidCommandLineSetsTheVariables) {
  EXPECT_EQ(parsed({"a.toml", "--radius", "5", "--outage", "1,2"}), std::nullopt);
  EXPECT_EQ(config_, "a.toml");
  EXPECT_EQ(radius_, 5.0);
  EXPECT_THAT(outage_, testing::ElementsAre(1.0, 2.0));
}

TEST_F(Node, VersionNamesTheSystem) {
  const std::optional<Ending> ended = parsed({"--version"});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->status, kExitOk);
  EXPECT_THAT(ended->text, testing::MatchesRegex("wm \\(rcs\\) [0-9.]+\n"));
}

TEST_F(Node, HelpNeedsNoArgument) {
  const std::optional<Ending> ended = parsed({"--help"});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->status, kExitOk);
  EXPECT_THAT(ended->text, HasSubstr("Usage: wm CONFIG [OPTIONS]\n"));
}

TEST_F(Node, AnUnknownOptionIsNamedWithASuggestion) {
  EXPECT_EQ(parsed({"--bogus"})->text, "wm: unknown option --bogus (see `wm --help`)\n");
  EXPECT_EQ(parsed({"--bogus"})->status, kExitUsage);
  EXPECT_THAT(parsed({"a.toml", "--chek"})->text, HasSubstr("--chek; did you mean --check?"));
  EXPECT_THAT(parsed({"--raduis=3", "a.toml"})->text,
              HasSubstr("--raduis; did you mean --radius?"));
  EXPECT_THAT(parsed({"-v"})->text, HasSubstr("-v; did you mean --version?"));
  EXPECT_THAT(parsed({"-check"})->text, HasSubstr("-check; did you mean --check?"));
}

TEST_F(Node, AMissingArgumentIsNamed) {
  EXPECT_EQ(parsed({})->text, "wm: CONFIG is required; see `wm --help`\n");
  EXPECT_EQ(error({"-oa.log"}), "wm: CONFIG is required")
      << "-o with its value is no unknown option";
  EXPECT_EQ(error({"a.toml", "--radius"}),
            "wm: --radius: a value is required (a number, 0 to 100)");
  EXPECT_EQ(error({"a.toml", "b.toml"}), "wm: unexpected argument b.toml");
}

TEST_F(Node, ARejectedValueIsNamedWithThePermittedOnes) {
  EXPECT_EQ(error({"a", "--radius", "200"}), "wm: --radius: expected 0 to 100, not 200");
  EXPECT_EQ(error({"a", "--radius", "-1"}), "wm: --radius: expected 0 to 100, not -1");
  EXPECT_EQ(error({"a", "--seeds", "0"}), "wm: --seeds: expected more than 0, not 0");
  EXPECT_EQ(error({"a", "--method", "icp"}),
            "wm: --method: expected plane, paper or gicp, not icp");
  EXPECT_EQ(error({"a", "--seeds", "1.5"}),
            "wm: --seeds: expected an integer, more than 0, not 1.5");
  EXPECT_EQ(error({"a", "--outage", "1,x"}), "wm: --outage: expected BEGIN,LENGTH, not 1,x");
  EXPECT_EQ(error({"a", "--json"}), "wm: --json requires --check");
}

TEST_F(Node, ANumberIsFinite) {
  EXPECT_EQ(error({"a", "--radius", "nan"}), "wm: --radius: nan is not a finite number");
  EXPECT_EQ(error({"a", "--outage", "0,inf"}), "wm: --outage: inf is not a finite number");
  EXPECT_EQ(parsed({"nan", "-o", "inf"}), std::nullopt) << "names of files";
}

TEST_F(Node, AnIntegerIsDecimalAndFitsItsType) {
  EXPECT_EQ(parsed({"a", "--seed", "-9223372036854775808"}), std::nullopt);
  EXPECT_EQ(*seed_, std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(parsed({"a", "--first", "18446744073709551615"}), std::nullopt);
  EXPECT_EQ(*first_, std::numeric_limits<std::size_t>::max());
  EXPECT_EQ(parsed({"a", "--seed", "+8", "--first", "0"}), std::nullopt);
  EXPECT_EQ(*seed_, 8);
  EXPECT_EQ(error({"a", "--seed", "99999999999999999999"}),
            "wm: --seed: 99999999999999999999 is not in the range of an integer of 64 bits");
  EXPECT_EQ(error({"a", "--seed", "-9223372036854775809"}),
            "wm: --seed: -9223372036854775809 is not in the range of an integer of 64 bits");
  EXPECT_EQ(error({"a", "--first", "18446744073709551616"}),
            "wm: --first: 18446744073709551616 is not in the range of an integer of 64 bits");
  EXPECT_THAT(error({"a", "--seed", "010"}),
              HasSubstr("in decimal without leading zeros, not 010"));
  EXPECT_THAT(error({"a", "--seed", "-010"}), HasSubstr("not -010"));
  EXPECT_THAT(error({"a", "--seed", "0x10"}), HasSubstr("--seed: expected an integer"));
  EXPECT_THAT(error({"a", "--first", "-1"}), HasSubstr("--first: expected an integer, at least 0"));
  EXPECT_THAT(error({"a", "--seeds", "4294967297"}), HasSubstr("--seeds: expected an integer"));
}

TEST_F(Node, AnOptionalValueMayBeMissing) {
  EXPECT_EQ(parsed({"a", "--record"}), std::nullopt);
  EXPECT_EQ(parsed({"a", "--record", "--check"}), std::nullopt);
  EXPECT_EQ(parsed({"a", "--record", "folder"}), std::nullopt);
  EXPECT_EQ(record_, "folder");
}

TEST_F(Node, TheNextOptionIsNoValue) {
  EXPECT_EQ(error({"a", "--out", "--json"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "-o", "--json"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "--out=", "--json"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "--out=", "x"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "-o", "-x"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "-o", "--"}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(parsed({"a", "--out=-x", "--seed", "-5", "--check"}), std::nullopt);
  EXPECT_EQ(out_, "-x");
  EXPECT_EQ(*seed_, -5);
  EXPECT_TRUE(check_);
  EXPECT_EQ(parsed({"a", "-o", "-"}), std::nullopt) << "the name of a stream";
}

TEST_F(Node, AnEmptyValueIsNoValue) {
  EXPECT_EQ(error({"a", "--out", ""}), "wm: --out: a value is required (FILE)");
  EXPECT_EQ(error({"a", "--seed", ""}), "wm: --seed: a value is required (an integer)");
  EXPECT_EQ(error({"a", "--method="}), "wm: --method: a value is required (NAME)");
  EXPECT_EQ(error({"", "--check"}), "wm: CONFIG: a value is required (TEXT)");
}

TEST_F(Node, AMissingFileIsAnInput) {
  app_.get_option("CONFIG")->check(CLI::ExistingFile);
  const std::optional<Ending> ended = parsed({"/nonexistent.toml"});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->status, kExitInput);
  EXPECT_EQ(ended->text, "wm: /nonexistent.toml: file does not exist\n");
  EXPECT_EQ(parsed({"/"})->text, "wm: /: file is actually a directory\n");
  const std::string name(300, 'x');  // the system rejects it, as it does a file in a closed folder
  EXPECT_EQ(parsed({name.c_str()})->text, "wm: " + name + ": File name too long\n");
  const auto advice = [](const std::string& folder) { return folder + " is not one"; };
  EXPECT_EQ(parsed({"/"}, advice)->text, "wm: /: / is not one\n");
}

/// A program with commands.
class Program : public testing::Test {
 protected:
  Program() {
    app_.require_subcommand(1);
    CLI::App* log = app_.add_subcommand("log", "Logs");
    log->require_subcommand(1);
    log->add_subcommand("cut", "Copy")->add_option("LOG", log_)->required();
    app_.add_subcommand("register", "Register");
  }
  std::string text(std::vector<const char*> words) {
    words.insert(words.begin(), "rcs");
    const std::optional<Ending> ended = parse(&app_, static_cast<int>(words.size()), words.data());
    return ended ? ended->text : "";
  }

  CLI::App app_{"All", "rcs"};
  std::string log_;
};

TEST_F(Program, ErrorsNameTheCommand) {
  EXPECT_EQ(text({"regster"}),
            "rcs: unknown command regster; did you mean register? (see `rcs --help`)\n");
  EXPECT_EQ(text({"log", "cut"}), "rcs log cut: LOG is required; see `rcs log cut --help`\n");
  EXPECT_EQ(text({"log", "cut", "--x"}),
            "rcs log cut: unknown option --x (see `rcs log cut --help`)\n");
  EXPECT_EQ(text({"log"}), "rcs log: a command is required: cut; see `rcs log --help`\n");
}

TEST_F(Program, HelpAndVersionOfEveryCommand) {
  EXPECT_THAT(text({"log", "cut", "--help"}), StartsWith("Copy.\n\nUsage: rcs log cut LOG\n"));
  EXPECT_THAT(text({"log", "cut", "--version"}), testing::MatchesRegex("rcs [0-9.]+\n"));
  EXPECT_THAT(text({"log", "ct", "--help"}), HasSubstr("unknown command ct; did you mean cut?"));
  EXPECT_EQ(text({"log", "cut", "a.log"}), "");
  EXPECT_EQ(chosen_name(app_), "rcs log cut");
}

}  // namespace
}  // namespace rcs::command_line
