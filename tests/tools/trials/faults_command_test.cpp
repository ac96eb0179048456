// The file of results of `rcs faults`.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace {

class FaultsCommand : public rcs::test::RcsCommand {};

TEST_F(FaultsCommand, AnInterruptedSeriesIsContinued) {
  const std::string source = rcs::test::variable("RCS_SOURCE_DIR");
  const std::string runs = folder_ + "/series/runs.jsonl";
  std::ofstream(folder_ + "/short.toml")
      << "based_on = \"" << source << "/config/sim/drill.toml\"\nduration_s = 47\n";
  const std::string command = "faults --runs 2 --jobs 1 --only 'wheels silence' --config " +
                              source + "/config/demo3.toml --scenario " + folder_ +
                              "/short.toml --out " + folder_ + "/series";
  EXPECT_LE(rcs(command), 1) << messages();
  const std::string two = rcs::test::text_of(runs);
  ASSERT_EQ(std::count(two.begin(), two.end(), '\n'), 3);
  // Interrupted in the second run.
  std::ofstream(runs) << two.substr(0, two.rfind('\n', two.size() - 2) + 1);
  EXPECT_LE(rcs(command), 1) << messages();
  EXPECT_EQ(rcs::test::text_of(runs), two);
  EXPECT_EQ(rcs(command + " --first-seed 9"), 3) << "another series";
  EXPECT_EQ(rcs::test::text_of(runs), two);

  // One of them again, with its log; the series stays as it is.
  EXPECT_LE(rcs(command + " --run 1 --json"), 1) << messages();
  const auto again = nlohmann::json::parse(out()).at("runs");
  ASSERT_EQ(again.size(), 1U);
  const std::string line = two.substr(two.rfind('\n', two.size() - 2) + 1);
  EXPECT_EQ(again[0].at("hash"), nlohmann::json::parse(line).at("hash"));
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/series/f0001.log"));
  EXPECT_EQ(rcs::test::text_of(runs), two);
}

}  // namespace
