// Generalized ICP on real scans: consecutive sweeps cut to the paper's size, and two whole scans.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/registration/real_cuts.h"
#include "tests/replay/real_data.h"
#include "tools/base/files.h"
#include "tools/base/trajectory.h"
#include "tools/clouds/cloud_file.h"

namespace rcs::test {
namespace {

TEST(GicpReal, RegistersConsecutiveCuts) {
  const std::vector<studies::KittiDrive> drive = open_drive();
  if (drive.empty()) GTEST_SKIP() << kNoData;
  const std::vector<studies::ScanPair> pairs = consecutive(drive[0].references());
  const Result<studies::ScanSet> set = drive[0].real_cuts(pairs);
  ASSERT_TRUE(set) << set.error().message;
  const auto judged = [&](const char* name, const std::vector<studies::Trial>& trials) {
    std::vector<TrialRun> runs;
    runs.reserve(trials.size());
    for (const studies::Trial& t : trials) {
      runs.push_back(
          {t, studies::match_gicp(set->scans.at(t.pair.model), set->scans.at(t.pair.data), t.guess,
                                  registration::GicpParams{})});
    }
    const Metrics f = metrics_of(runs, motions_of(pairs));
    fmt::print("{}: {} of {}, median {:.3f} m {:.2f} deg, CPU {}\n", name, f.successes, f.trials,
               f.median_m, f.median_deg, cpu_text(runs));
    return f.share();
  };
  EXPECT_EQ(judged("#1", studies::trials_of(studies::DataSet::kConsecutive, pairs, 1)), 1.0);
  // The range of guesses that the help states.
  EXPECT_GE(judged("2 m, 10 deg", studies::basin_trials(pairs, {2.0, radians(10.0)}, 8)), 0.95);
  EXPECT_GE(judged("#4", studies::trials_of(studies::DataSet::kTurnedAndMovedBy3m, pairs, 4)),
            0.75);
}

TEST(GicpReal, RegistersTwoWholeScans) {
  const std::string folder = data_path("koide_velodyne_pair");
  if (folder.empty()) GTEST_SKIP() << kNoData;
  const Result<clouds::Cloud> model = clouds::read_cloud(folder + "/251370668.pcd", {});
  const Result<clouds::Cloud> data = clouds::read_cloud(folder + "/251371071.pcd", {});
  const Result<std::string> rows = tools::read_text(folder + "/relative.txt");
  ASSERT_TRUE(model && data && rows);
  std::string line = *rows;
  std::replace(line.begin(), line.end(), '\n', ' ');
  const std::optional<std::vector<double>> v = tools::parse_numbers(line);
  ASSERT_TRUE(v && v->size() == 16);
  const Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix4d>(v->data()).transpose();
  const Pose truth{Quat(Mat3(T.topLeftCorner<3, 3>())).normalized(), T.topRightCorner<3, 1>()};
  const studies::CloudMatch m =
      studies::match_gicp(model->points, data->points, Pose{}, registration::GicpParams{});
  EXPECT_EQ(m.stop, "converged");
  EXPECT_TRUE(studies::is_success(studies::error_of(truth, m.T_model_data)));
  const studies::CloudMatch back =
      studies::match_gicp(data->points, model->points, Pose{}, registration::GicpParams{});
  const studies::Offset off = studies::error_of(Pose{}, m.T_model_data * back.T_model_data);
  // The scans differ by more than noise: moving objects and surfaces that only one of them has
  // seen.
  EXPECT_LT(off.m, 0.02);
  EXPECT_LT(degrees(off.rad), 0.1);
}

}  // namespace
}  // namespace rcs::test
