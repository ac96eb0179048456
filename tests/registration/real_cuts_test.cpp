// Real sweeps cut to the paper's size: the rows of its Table 1 that need no search, and a part of
// the basin of convergence. real_cuts_slow_test.cpp has all of it.

#include "tests/registration/real_cuts.h"

#include <gtest/gtest.h>

#include "tests/replay/real_data.h"

namespace rcs::test {
namespace {

using studies::DataSet;

// One test: CTest runs each test in a process of its own, which would unpack the sweeps again.
TEST(RealCuts, RegistersConsecutiveScansFromADistantGuess) {
  const std::vector<studies::KittiDrive> drive = open_drive();
  if (drive.empty()) GTEST_SKIP() << kNoData;
  const std::vector<studies::ScanPair> pairs = consecutive(drive[0].references());
  const Result<studies::ScanSet> set = drive[0].real_cuts(pairs);
  ASSERT_TRUE(set) << set.error().message;
  for (const auto& [number, scan] : set->scans) {
    EXPECT_GT(scan.size(), 5000U) << number;
    EXPECT_LE(scan.size(), 5760U) << number;
  }

  const Motions references = motions_of(pairs);
  const auto judged = [&](const std::vector<studies::Trial>& trials) {
    const std::vector<TrialRun> runs = run_production(*set, trials, Search::kFromGuess);
    // The result of the command and that of the library are equal.
    const studies::Trial& t = trials.front();
    const registration::Registration library =
        registration::register_clouds(set->scans.at(t.pair.model), set->scans.at(t.pair.data),
                                      t.guess, registration::CloudParams{})
            .best;
    EXPECT_EQ(library.T_target_vehicle.p, runs.front().match.T_model_data.p);
    return metrics_of(runs, references);
  };
  EXPECT_EQ(judged(studies::trials_of(studies::DataSet::kConsecutive, pairs, 1)).successes, 8);
  for (const std::vector<studies::Trial>& trials :
       {studies::trials_of(studies::DataSet::kTurnedAndMovedBy3m, pairs, 4),
        studies::basin_trials(pairs, {3.0, radians(20.0)}, 8)}) {
    const Metrics of = judged(trials);
    EXPECT_GE(of.share(), 0.95);
    // Weaker optima next to the result, and hypotheses on their way to it, are not other results.
    EXPECT_LE(of.refused, of.trials / 50);
    EXPECT_EQ(of.falsely_accepted, 0);
  }
}

}  // namespace
}  // namespace rcs::test
