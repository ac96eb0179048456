// `rcs register` on the command line.

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "rcs/base/pose.h"
#include "tests/replay/real_data.h"
#include "tests/support/point_scenes.h"
#include "tests/support/rcs_command.h"
#include "tools/studies/cloud_match.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class RegisterCommand : public RcsCommand {
 protected:
  RegisterCommand() {
    std::mt19937 rng(7);
    const Points model = test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3::Zero(), &rng);
    // Other points of the same surfaces, seen from another pose.
    const Points data =
        test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3(1.0, -1.0, 0.0), &rng);
    write(model_, model);
    write(data_, test::moved(T_true_.inverse(), data));
  }

  static void write(const std::string& path, const Points& points) {
    std::ofstream out(path);
    for (std::size_t i = 0; i < points.size(); ++i) out << points[i].transpose() << '\n';
  }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
    return folder_ + "/" + name;
  }
  int run(const std::string& options) { return rcs("register " + model_ + " " + data_ + options); }

  void expect_truth(const json& j, double m, double deg) const {
    ASSERT_EQ(j["T_model_data"].size(), 16U);
    const auto at = [&j](int k) { return j["T_model_data"][static_cast<std::size_t>(k)]; };
    Mat3 R;
    Vec3 p;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) R(i, k) = at(4 * i + k).get<double>();
      p[i] = at(4 * i + 3).get<double>();
    }
    EXPECT_EQ(at(15).get<double>(), 1.0);
    EXPECT_LT((p - T_true_.p).norm(), m);
    EXPECT_LT(degrees(log_so3(T_true_.q.conjugate() * Quat(R)).norm()), deg);
  }

  std::string model_ = folder_ + "/model.xyz";
  std::string data_ = folder_ + "/data.xyz";
  Pose T_true_ = test::pose(1.5, 0.8, 0.2, 0.02, -0.01, 0.1);
};

TEST_F(RegisterCommand, ReportsMotionInformationAndTimeAndDraws) {
  EXPECT_EQ(run(" --json --plot " + folder_ + "/new/pictures"), 0) << messages();
  const json j = json::parse(out());
  expect_truth(j, 0.03, 0.1);
  EXPECT_EQ(j["method"], "plane");
  EXPECT_EQ(j["stop"], "converged");
  EXPECT_EQ(j["model_points"], 4000);
  EXPECT_EQ(j["information"].size(), 36U);
  EXPECT_EQ(j["observability"].size(), 6U);
  EXPECT_GT(j["information"][0].get<double>(), 0.0);
  EXPECT_GT(j["pairs"].get<int>(), 1000);
  EXPECT_GT(j["overlap"].get<double>(), 0.5);
  EXPECT_GT(j["iterations"].get<int>(), 1);
  EXPECT_LT(j["mean_distance_after_m"].get<double>(), j["mean_distance_before_m"].get<double>());
  for (const char* stage : {"prepare", "search", "refine", "total"}) {
    EXPECT_GE(j["cpu_ms"][stage].get<double>(), 0.0) << stage;
  }
  for (const char* name : {"before", "after", "histogram"}) {
    const std::string svg = text_of(folder_ + "/new/pictures/" + name + ".svg");
    EXPECT_THAT(svg, HasSubstr("</svg>")) << name;
    EXPECT_THAT(svg, testing::Not(HasSubstr("nan"))) << name;
  }
}

TEST_F(RegisterCommand, ReportsEveryIterationOfThePaperMethod) {
  EXPECT_EQ(run(" --method paper --json --guess '1 0 0 1.4 0 1 0 0.7 0 0 1 0.2 0 0 0 1'"), 0)
      << messages();
  const json j = json::parse(out());
  expect_truth(j, 0.1, 0.5);
  ASSERT_EQ(j["history"].size(), j["iterations"].get<std::size_t>());
  for (const char* key : {"branch", "mu_m", "sigma_m", "d_max_m", "pairs", "mean_distance_m"}) {
    EXPECT_TRUE(j["history"][0].contains(key)) << key;
  }
  EXPECT_EQ(run(" --method paper --as-printed --max-iterations 5"), 1);
  EXPECT_THAT(messages(), HasSubstr("not converged"));
}

TEST_F(RegisterCommand, ReportsTheResultOfGeneralizedIcp) {
  EXPECT_EQ(run(" --method gicp --json --plot " + folder_ +
                " --guess '1 0 0 1.2 0 1 0 0.5 0 0 1 0.2 0 0 0 1'"),
            0)
      << messages();
  json j = json::parse(out());
  expect_truth(j, 0.03, 0.1);
  EXPECT_EQ(j["method"], "gicp");
  EXPECT_EQ(j["stop"], "converged");
  EXPECT_EQ(j["information"].size(), 36U);
  EXPECT_GT(j["information"][0].get<double>(), 0.0);
  for (const char* stage : {"surfaces", "refine", "total"}) {
    EXPECT_GE(j["cpu_ms"][stage].get<double>(), 0.0) << stage;
  }
  EXPECT_THAT(text_of(folder_ + "/after.svg"), HasSubstr("</svg>"));
  // A guess half a turn away.
  const std::string turned = " --global --guess '-1 0 0 5 0 -1 0 -4 0 0 1 0 0 0 0 1'";
  EXPECT_EQ(run(" --method gicp --json" + turned), 0) << messages();
  j = json::parse(out());
  expect_truth(j, 0.03, 0.1);
  EXPECT_TRUE(j["accepted"].get<bool>());
  for (const char* stage : {"prepare", "search", "surfaces", "refine"}) {
    EXPECT_TRUE(j["cpu_ms"].contains(stage)) << stage;
  }
  EXPECT_EQ(run(" --method gicp --organized 40,100"), 0) << messages();
  // No surface is near.
  EXPECT_EQ(run(" --method gicp --guess '1 0 0 200 0 1 0 0 0 0 1 0 0 0 0 1'"), 1);
  EXPECT_THAT(messages(), HasSubstr("not converged: too"));
}

TEST_F(RegisterCommand, FindsAnyHeadingOrRejects) {
  // A guess half a turn away.
  EXPECT_EQ(run(" --global --json --guess '-1 0 0 5 0 -1 0 -4 0 0 1 0 0 0 0 1'"), 0) << messages();
  const json j = json::parse(out());
  expect_truth(j, 0.03, 0.1);
  EXPECT_TRUE(j["accepted"].get<bool>());
  EXPECT_LT(j["ambiguity"].get<double>(), 1.0);
  EXPECT_GE(j["hypotheses"].size(), 1U);
  // All positions on a plain are equivalent.
  std::mt19937 rng(8);
  write(model_, test::scene(test::Ground::kFlat, false, 4000, 0.01, Vec3::Zero(), &rng));
  write(data_, test::scene(test::Ground::kFlat, false, 4000, 0.01, Vec3::Zero(), &rng));
  for (const char* method : {"plane", "gicp"}) {
    EXPECT_EQ(run(std::string(" --global --method ") + method), 1);
    EXPECT_THAT(messages(), HasSubstr("rejected")) << method;
  }
}

TEST_F(RegisterCommand, PlainOutputHasMotionAndSigma) {
  EXPECT_EQ(run(""), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("translation 1."));
  EXPECT_THAT(out(), HasSubstr("roll pitch yaw"));
  EXPECT_THAT(out(), HasSubstr("one sigma: x 0.0"));
  EXPECT_THAT(out(), testing::Not(HasSubstr("unobserved")));
}

TEST_F(RegisterCommand, CloudsOfDifferentSitesAreRejected) {
  // Flat ground in both, and a wall each, at right angles to the other's.
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> u(-25.0, 25.0);
  Points model;
  Points data;
  for (int k = 0; k < 8000; ++k) {
    const double x = u(rng);
    const double y = u(rng);
    const double up = 0.06 * (u(rng) + 25.0);
    const bool wall = k % 4 == 0;
    model.push_back(Vec3(wall ? 12.0 : x, y, wall ? up : 0.0).cast<float>());
    data.push_back(Vec3(x, wall ? -9.0 : y, wall ? up : 0.0).cast<float>());
  }
  write(model_, model);
  write(data_, data);
  for (const char* method : {"plane", "gicp", "paper"}) {
    EXPECT_EQ(run(std::string(" --json --method ") + method), 1) << method;
    EXPECT_THAT(messages(), HasSubstr("re")) << method;
    EXPECT_FALSE(json::parse(out())["accepted"].get<bool>()) << method;
  }
  EXPECT_EQ(run(""), 1);
  EXPECT_THAT(messages(), HasSubstr("rejected: "));
}

TEST_F(RegisterCommand, APlainIsRejected) {
  for (const int n : {6000, 20'000}) {
    std::mt19937 rng(11);
    write(model_, test::scene(test::Ground::kFlat, false, n, 0.02, Vec3::Zero(), &rng));
    write(data_, test::scene(test::Ground::kFlat, false, n, 0.02, Vec3::Zero(), &rng));
    for (const char* method : {"plane", "gicp"}) {
      EXPECT_EQ(run(std::string(" --method ") + method), 1) << method << ", " << n;
      EXPECT_THAT(messages(), HasSubstr("rejected: translation along (")) << method << ", " << n;
      EXPECT_THAT(messages(), HasSubstr(") is undetermined")) << method << ", " << n;
    }
  }
}

TEST_F(RegisterCommand, TheUnobservedLengthOfATunnelIsReported) {
  std::mt19937 rng(12);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.02);
  const auto tunnel = [&] {
    Points points;
    for (int k = 0; k < 8000; ++k) {
      const double side = k % 4 == 1 ? 3.0 : -3.0;
      const Vec3 p = k % 2 == 0 ? Vec3(30.0 * u(rng), 3.0 * u(rng), noise(rng))
                                : Vec3(30.0 * u(rng), side + noise(rng), 1.5 + 1.5 * u(rng));
      points.push_back(p.cast<float>());
    }
    return points;
  };
  write(model_, tunnel());
  write(data_, tunnel());
  EXPECT_EQ(run(" --json"), 1);
  EXPECT_THAT(messages(), HasSubstr("is undetermined"));
  const json j = json::parse(out());
  EXPECT_FALSE(j["accepted"].get<bool>());
  EXPECT_GT(j["agreement"]["min_direction"].get<double>(), 0.5) << "of the other directions";
  EXPECT_GT(std::abs(j["agreement"]["undetermined_direction"][0].get<double>()), 0.99);
}

TEST_F(RegisterCommand, AResultAtTheIterationLimitIsRejected) {
  std::mt19937 rng(13);
  const Points model = test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3::Zero(), &rng);
  const Points data = test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3::Zero(), &rng);
  EXPECT_TRUE(studies::match_gicp(model, data, Pose{}, registration::GicpParams{}).good);
  registration::GicpParams short_search;
  short_search.max_iterations = 3;
  const studies::CloudMatch match = studies::match_gicp(model, data, Pose{}, short_search);
  EXPECT_EQ(match.stop, "max iterations");
  EXPECT_FALSE(match.good) << "although the clouds agree at the guess";
}

TEST_F(RegisterCommand, CoincidentPointsAreOmitted) {
  std::ofstream data(data_, std::ios::app);
  for (int k = 0; k < 20'000; ++k) data << "0 0 0\n5 4 3\n";
  data.close();
  EXPECT_EQ(run(" --json"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("data.xyz: 19999 coincident points dropped"));
  EXPECT_THAT(messages(), testing::Not(HasSubstr("model.xyz")));
  const json j = json::parse(out());
  EXPECT_EQ(j["data_points"], 4001);
  EXPECT_EQ(j["dropped_points"]["data"], 20'000) << "at the origin";
  expect_truth(j, 0.03, 0.1);
}

TEST_F(RegisterCommand, AMethodThatStopsBeforeConvergenceIsRejected) {
  // As printed, the paper's method moves DATA by a part of the motion and reports convergence.
  std::mt19937 rng(10);
  const Points data = test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3::Zero(), &rng);
  write(data_, test::moved(test::pose(-0.5, -0.5, 0.0, 0, 0, 0), data));
  const int status = run(" --method paper --max-iterations 2 --json");
  const json j = json::parse(out());
  EXPECT_EQ(status, 1) << j["translation_m"].dump();
  EXPECT_FALSE(j["accepted"].get<bool>());
}

TEST_F(RegisterCommand, ScansOfDifferentStreetsAreRejected) {
  const std::string a = unpacked("kitti_2011_09_26_drive_0005/velodyne_bin_000-079.tar.xz");
  const std::string b = unpacked("kitti_2011_09_26_drive_0048/velodyne_bin_000-021.tar.xz");
  const std::string koide = data_path("koide_velodyne_pair/251370668.pcd");
  if (a.empty() || b.empty() || koide.empty()) GTEST_SKIP() << kNoData;
  const std::string street = " " + a + "/0000000020.bin";
  EXPECT_EQ(rcs("register" + street + " " + b + "/0000000005.bin"), 1) << out();
  EXPECT_THAT(messages(), testing::AnyOf(HasSubstr("rejected"), HasSubstr("not converged")));
  EXPECT_EQ(rcs("register" + street + " " + koide), 1) << out();
  EXPECT_EQ(rcs("register" + street + " " + a + "/0000000021.bin"), 0) << messages();
  EXPECT_EQ(rcs("register" + street + " " + a + "/0000000021.bin --method paper"), 0) << messages();
  EXPECT_EQ(rcs("register " + koide + " " + data_path("koide_velodyne_pair/251371071.pcd")), 0)
      << messages();
  std::filesystem::remove_all(a);
  std::filesystem::remove_all(b);
}

TEST_F(RegisterCommand, AWrongCommandLineExitsWithTwo) {
  EXPECT_EQ(rcs("register"), 2);
  EXPECT_EQ(rcs("register " + model_), 2);
  EXPECT_EQ(rcs("register " + model_ + " nothing.xyz"), 3);
  EXPECT_EQ(run(" --method magic"), 2);
  EXPECT_EQ(run(" --guess '1 2 3'"), 2);
  EXPECT_THAT(messages(), HasSubstr("16 numbers"));
  EXPECT_EQ(run(" --guess '2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1'"), 2);
  EXPECT_THAT(messages(), HasSubstr("not a rigid motion"));
  EXPECT_EQ(run(" --guess '1e308 0 0 0 0 1e308 0 0 0 0 1e308 0 0 0 0 1'"), 2) << "no finite error";
  EXPECT_THAT(messages(), HasSubstr("not a rigid motion"));
  for (const char* far : {"1e9", "-1e308"}) {
    EXPECT_EQ(run(std::string(" --guess '1 0 0 ") + far + " 0 1 0 0 0 0 1 0 0 0 0 1'"), 2) << far;
    EXPECT_THAT(messages(), HasSubstr("expected a translation of -1e+06 to 1e+06 m"));
  }
  for (const char* shape : {"32", "32x", "x180", "0x180", "32x180x2", "-1x5"}) {
    EXPECT_EQ(run(std::string(" --organized ") + shape), 2) << shape;
    EXPECT_THAT(messages(), HasSubstr("ROWS,COLS")) << shape;
  }
  EXPECT_EQ(run(" --method paper --global"), 2);
  EXPECT_EQ(run(" --radius 20"), 2);
  EXPECT_EQ(run(" --global --radius 200"), 2);
}

TEST_F(RegisterCommand, UnreadableInputExitsWithThreeAndIsNamed) {
  const auto complaint = [this](const std::string& arguments) {
    EXPECT_EQ(rcs("register " + arguments), 3) << arguments;
    return messages();
  };
  EXPECT_THAT(complaint(model_ + " " + write("bad.xyz", "1 2\n")), HasSubstr("bad.xyz:1"));
  EXPECT_THAT(complaint(write("bad.ply", "plx\n") + " " + data_), HasSubstr("not a PLY"));
  EXPECT_THAT(complaint(write("cut.bin", "12345") + " " + data_),
              HasSubstr("cut.bin: the file is text"));
  EXPECT_THAT(complaint(model_ + " " + write("empty.xyz", "# nothing\n")), HasSubstr("no points"));
  EXPECT_THAT(complaint(model_ + " " + data_ + " --organized 32,180"),
              HasSubstr("4000 records are not 32 x 180 cells"));
  EXPECT_EQ(rcs("register " + model_ + " " + write("few.xyz", "1 2 3\n3 4 5\n")), 1);
  EXPECT_THAT(messages(), HasSubstr("no pose was found"));
  EXPECT_THAT(complaint(model_ + " " + data_ + " --plot " + model_), HasSubstr("model.xyz"));
}

TEST_F(RegisterCommand, ARangeImageIsReadByItsShape) {
  EXPECT_EQ(run(" --organized 40,100"), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("model 4000 points"));
}

}  // namespace
}  // namespace rcs::test
