// The file of results of `rcs faults`.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

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
}

}  // namespace
