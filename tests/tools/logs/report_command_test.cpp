// `rcs report` and `rcs eval --report` on the command line, with and without a truth.

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// A few seconds of the reference drive with an outage, made once: run.log, and bare.log, which is
/// the same without a truth.
class ReportCommand : public RcsCommand {
 protected:
  static void SetUpTestSuite() {
    drive_ = (std::filesystem::temp_directory_path() / "rcs_report_XXXXXX").string();
    RCS_CHECK(mkdtemp(drive_.data()) != nullptr);
    const std::string program = variable("RCS_BIN_DIR") + "/rcs ";
    const std::string source = variable("RCS_SOURCE_DIR") + "/config/";
    const auto run = [&](const std::string& arguments) {
      const std::string command =
          "cd " + drive_ + " && " + program + arguments + " >/dev/null 2>&1";
      RCS_CHECK(std::system(command.c_str()) == 0);  // NOLINT(cert-env33-c)
    };
    run("sim " + source + "sim/drill.toml --duration 14 --gps-outage 6,5 -o drive.log");
    run("log cut drive.log --sensors -o sensors.log");
    run("replay " + source + "demo3.toml drive.log -o run.log");
    run("replay " + source + "demo3.toml sensors.log -o bare.log");
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(drive_); }

  int report(const std::string& log, const std::string& options = "") {
    return rcs("report " + drive_ + "/" + log + " -o " + folder_ + "/page.html " + options);
  }
  [[nodiscard]] std::string page() const { return text_of(folder_ + "/page.html"); }

  static std::string drive_;
};
std::string ReportCommand::drive_;

constexpr char kLeftOut[] =
    "Errors and the comparison by errors are left out: the log has no ground truth (SIM_TRUTH); "
    "--truth-log names a log with it.";

TEST_F(ReportCommand, WithoutATruthShowsWhatIsKnown) {
  ASSERT_EQ(report("bare.log", "--svg " + folder_ + "/plot.svg"), 0) << messages();
  EXPECT_THAT(page(), HasSubstr(kLeftOut));
  for (const char* part :
       {"<h2>Course</h2>", "<h2>Speed</h2>", "<h2>Uncertainty</h2>", "<h2>Map</h2>",
        "<h2>Registrations</h2>", "data-label=\"protection level\"", "GPS denied from 6 s",
        "No limit was set; --min-factor judges.", "configuration not recorded in the log"}) {
    EXPECT_THAT(page(), HasSubstr(part));
  }
  EXPECT_THAT(page(), Not(HasSubstr("<h2>Error</h2>")));
  EXPECT_THAT(page(), Not(HasSubstr("data-label=\"truth\"")));
  EXPECT_THAT(out(), HasSubstr("Errors and the comparison by errors are left out"));
  EXPECT_THAT(text_of(folder_ + "/plot.svg"), HasSubstr("Course from above"));
}

TEST_F(ReportCommand, WithoutATruthTheJsonHasNoErrors) {
  ASSERT_EQ(report("bare.log", "--json"), 0) << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["note"], kLeftOut);
  EXPECT_TRUE(j["runs"][0]["world"].is_null());
  ASSERT_EQ(j["runs"][0]["outages"].size(), 1U);
  EXPECT_TRUE(j["runs"][0]["outages"][0]["horizontal_m"].is_null());
  EXPECT_GT(j["runs"][0]["outages"][0]["driven_m"], 5.0);
}

TEST_F(ReportCommand, ALimitNeedsATruth) {
  EXPECT_EQ(report("bare.log", "--min-factor 2"), 3);
  EXPECT_THAT(messages(), HasSubstr("--min-factor needs the errors."));
  EXPECT_THAT(messages(), HasSubstr("--truth-log names a log with it"));
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/page.html"));
}

TEST_F(ReportCommand, TheTruthOfAnotherLogGivesTheErrors) {
  ASSERT_EQ(report("bare.log", "--truth-log " + drive_ + "/drive.log --json"), 0) << messages();
  const json from_log = json::parse(out());
  EXPECT_FALSE(from_log.contains("note"));
  EXPECT_THAT(page(), HasSubstr("<h2>Error</h2>"));
  EXPECT_THAT(page(), HasSubstr("data-label=\"error\""));
  ASSERT_EQ(report("run.log", "--json"), 0) << messages();
  EXPECT_EQ(json::parse(out())["runs"][0]["world"], from_log["runs"][0]["world"]);
  EXPECT_EQ(report("bare.log", "--truth-log " + drive_ + "/bare.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("no SIM_TRUTH"));
}

TEST_F(ReportCommand, ALogOfSensorsIsAnError) {
  EXPECT_EQ(report("sensors.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("run `rcs replay` first"));
}

TEST_F(ReportCommand, ThePageOfEvalStatesThatNothingWasJudged) {
  for (const char* log : {"run.log", "bare.log"}) {
    ASSERT_EQ(rcs("eval " + drive_ + "/" + log + " --report " + folder_ + "/page.html"), 0)
        << messages();
    EXPECT_THAT(page(), HasSubstr("class=\"verdict none\">No limit was set;"));
    EXPECT_THAT(page(), HasSubstr("configuration not recorded in the log, rcs "));
  }
  EXPECT_THAT(page(), HasSubstr("Errors are left out"));
}

}  // namespace
}  // namespace rcs::test
