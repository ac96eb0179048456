// The statistics of `rcs consistency` on synthetic drives with known results.

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "tests/support/rcs_command.h"
#include "tests/tools/drills/drill_fixture.h"
#include "tools/studies/consistency_output.h"
#include "tools/studies/consistency_page.h"

namespace rcs::test {
namespace {

const studies::ConsistencyPlan kPlan = {20.0, {10, 30, 50}};
constexpr std::size_t kRuns = 30;

/// A covariance that is not diagonal, of about `sigma`.
Mat3 root_of_covariance(double sigma) {
  Mat3 A;
  A << 1.0, 0.3, 0.0, -0.2, 1.4, 0.1, 0.1, 0.2, 0.7;
  return sigma * A;
}

Vec3 normal3(std::mt19937* random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  const double x = normal(*random);
  const double y = normal(*random);
  return {x, y, normal(*random)};
}

/// A drive with errors of the beliefs that are drawn from their covariances.
/// @param predicted  factor of the published covariances over the true ones
drills::DrillRecord consistent_record(double predicted, std::mt19937* random) {
  const Mat3 position = root_of_covariance(0.4);
  const Mat3 velocity = root_of_covariance(0.05);
  const Mat3 attitude = root_of_covariance(0.003);
  drills::DrillRecord r = right_record();
  r.v_truth_world.assign(r.truth.size(), Vec3(10.0, 0.0, 0.0));
  for (drills::DrillBelief& b : r.beliefs) {
    Vec6 xi;
    xi << position * normal3(random), attitude * normal3(random);
    b.T_world_vehicle = b.T_world_vehicle * exp_se3(xi).inverse();
    b.v_world = Vec3(10.0, 0.0, 0.0) + velocity * normal3(random);
    b.cov_world_pose.setZero();
    b.cov_world_pose.topLeftCorner<3, 3>() = predicted * position * position.transpose();
    b.cov_world_pose.bottomRightCorner<3, 3>() = predicted * attitude * attitude.transpose();
    b.cov_v_world = predicted * velocity * velocity.transpose();
  }
  return r;
}

studies::ConsistencyBlock block_of(double predicted, std::size_t runs) {
  std::mt19937 random(7);
  studies::ConsistencyBlock block{"sim/made_up.toml", "tactical", {}, {}};
  for (std::size_t k = 0; k < runs; ++k) {
    block.runs.push_back(studies::consistency_run(kPlan, static_cast<std::int64_t>(k),
                                                  consistent_record(predicted, &random)));
  }
  return block;
}

/// z[k+1] = rho z[k] + ..., of unit variance, four a second.
std::vector<drills::DrillInnovation> correlated(double rho, double sigma, std::size_t n) {
  std::mt19937 random(11);
  std::vector<drills::DrillInnovation> out;
  Vec3 z = normal3(&random);
  for (std::size_t k = 0; k < n; ++k) {
    drills::DrillInnovation i;
    i.stamp = kBegin + from_seconds(0.25 * static_cast<double>(k));
    i.source = innovation_t::SOURCE_GPS_VELOCITY;
    i.accepted = true;
    i.dof = 3;
    i.normalized.head<3>() = sigma * z;
    i.nis = i.normalized.squaredNorm();
    out.push_back(i);
    z = rho * z + std::sqrt(1.0 - rho * rho) * normal3(&random);
  }
  return out;
}

TEST(Consistency, AConsistentFilterIsWithinTheLimits) {
  const studies::ConsistencyBlock block = block_of(1.0, kRuns);
  for (const studies::StatePart part :
       {studies::StatePart::kPosition, studies::StatePart::kVelocity,
        studies::StatePart::kAttitude}) {
    const studies::PartMetrics all = studies::metrics_of_all(block, part);
    EXPECT_EQ(all.count, 90U);
    EXPECT_EQ(all.missing, 0U);
    // The mean of 90 chi-square values of 3 degrees has sigma sqrt(2 / 270) per degree: 4 sigma.
    EXPECT_NEAR(all.nees_per_dof, 1.0, 0.35) << studies::part_name(part);
    EXPECT_NEAR(all.rms_error, all.rms_predicted, 0.2 * all.rms_predicted)
        << studies::part_name(part);
  }
  EXPECT_EQ(studies::verdict_of(kPlan, block), drills::Verdict::kPass);
  EXPECT_TRUE((studies::ConsistencyReport{kPlan, {block}}.passed()));
}

TEST(Consistency, CovariancesFourTimesTooLargeOrTooSmallFail) {
  for (const double predicted : {4.0, 0.25}) {
    const studies::ConsistencyBlock block = block_of(predicted, kRuns);
    for (const studies::StatePart part :
         {studies::StatePart::kPosition, studies::StatePart::kVelocity,
          studies::StatePart::kAttitude}) {
      for (std::size_t k = 0; k < kPlan.times_s.size(); ++k) {
        const studies::PartMetrics f = studies::metrics_at(block, k, part);
        EXPECT_NEAR(f.nees_per_dof * predicted, 1.0, 0.6) << studies::part_name(part);
        EXPECT_EQ(studies::nees_verdict(f), drills::Verdict::kFail)
            << predicted << ", " << studies::part_name(part);
      }
      const studies::PartMetrics all = studies::metrics_of_all(block, part);
      EXPECT_EQ(studies::inside_verdict(all, kRuns), drills::Verdict::kFail)
          << predicted << ", " << studies::part_name(part);
    }
    EXPECT_EQ(studies::verdict_of(kPlan, block), drills::Verdict::kFail);
  }
}

TEST(Consistency, FewRunsFailOnlyBeyondTheirConfidenceInterval) {
  // Three values of three degrees: the 95 % interval of the mean is 0.11 to 3.1.
  studies::PartMetrics f;
  f.count = 3;
  f.nees_per_dof = 2.5;
  EXPECT_EQ(studies::nees_verdict(f), drills::Verdict::kInconclusive);
  f.nees_per_dof = 20.0;
  EXPECT_EQ(studies::nees_verdict(f), drills::Verdict::kFail);
  f.nees_per_dof = 1.2;
  EXPECT_EQ(studies::nees_verdict(f), drills::Verdict::kPass);
  f.inside = 1.0;
  EXPECT_EQ(studies::inside_verdict(f, 3), drills::Verdict::kInconclusive);
  f.inside = 0.2;
  EXPECT_EQ(studies::inside_verdict(f, 3), drills::Verdict::kFail);
  studies::InnovationSums sums;
  sums.count = 10;
  sums.nis_per_dof = 50.0;
  EXPECT_EQ(studies::nis_verdict(sums), drills::Verdict::kInconclusive);
}

TEST(Consistency, ARunWithMissingCovariancesFails) {
  studies::ConsistencyBlock block = block_of(1.0, kRuns);
  block.runs[4].at[1] = {};
  EXPECT_EQ(studies::metrics_at(block, 1, studies::StatePart::kVelocity).missing, 1U);
  EXPECT_EQ(studies::verdict_of(kPlan, block), drills::Verdict::kFail);
  EXPECT_THAT(to_text(studies::nees_table({kPlan, {block}})), testing::HasSubstr("(1 missing) !"));
  std::mt19937 random(1);
  drills::DrillRecord r = consistent_record(1.0, &random);
  r.beliefs[10].cov_v_world(1, 1) = -1.0;
  const studies::PartErrors e =
      studies::part_errors(r.beliefs[10], r.beliefs[10].T_world_vehicle, Vec3(10.0, 0.0, 0.0));
  EXPECT_FALSE(e[static_cast<std::size_t>(studies::StatePart::kVelocity)].has_value());
  EXPECT_TRUE(e[static_cast<std::size_t>(studies::StatePart::kPosition)].has_value());
}

TEST(Consistency, ErrorsAreComputedAtThePublishedStamp) {
  drills::DrillRecord r = right_record();
  mislead(25.0, 35.0, Vec3(0.1, 0.2, 0.3), &r);
  const studies::ConsistencyRun run = studies::consistency_run(kPlan, 1, r);
  EXPECT_EQ(run.curve.size(), 51U);
  const auto position = static_cast<std::size_t>(studies::StatePart::kPosition);
  EXPECT_NEAR(run.at[0][position]->nees, 0.0, 1e-9);
  EXPECT_NEAR(run.at[1][position]->nees, 14.0, 1e-6);  // sigma 0.1 m
  EXPECT_NEAR(run.at[1][position]->error, std::sqrt(0.14), 1e-6);
  EXPECT_NEAR(run.at[1][position]->predicted, std::sqrt(0.03), 1e-9);
  EXPECT_NEAR(run.curve[34][position]->nees, 14.0, 1e-6);
  EXPECT_NEAR(run.curve[36][position]->nees, 0.0, 1e-9);
  // Without velocities of the ground truth.
  EXPECT_FALSE(run.at[0][static_cast<std::size_t>(studies::StatePart::kVelocity)].has_value());
}

TEST(Consistency, LagOneIsTheCorrelationOfSuccessiveInnovations) {
  for (const double rho : {0.0, 0.6, -0.4}) {
    const studies::Innovations sums = studies::innovation_sums(correlated(rho, 1.3, 3000));
    const studies::InnovationSums& gps = sums.at("gps velocity");
    EXPECT_EQ(gps.count, 3000U);
    // 9000 pairs: sigma below 0.02.
    EXPECT_NEAR(gps.lag1().value(), rho, 0.06);
    EXPECT_NEAR(gps.mean_nis_per_dof(), 1.69, 0.2);
    EXPECT_EQ(studies::nis_verdict(gps), drills::Verdict::kFail);
  }
  EXPECT_EQ(
      studies::nis_verdict(studies::innovation_sums(correlated(0.0, 1.0, 3000)).at("gps velocity")),
      drills::Verdict::kPass);
}

TEST(Consistency, GatedInnovationsCountAndUngatedOnesDoNot) {
  std::vector<drills::DrillInnovation> all = correlated(0.0, 1.0, 4);
  all[1].accepted = false;
  all[1].reason = innovation_t::REASON_GATE;
  all[2].accepted = false;
  all[2].reason = innovation_t::REASON_QUARANTINE;
  all[3].stamp += std::chrono::seconds(10);
  const studies::InnovationSums sums = studies::innovation_sums(all).at("gps velocity");
  EXPECT_EQ(sums.count, 3U);
  EXPECT_EQ(sums.refused, 1U);
  EXPECT_NEAR(sums.nis_per_dof, (all[0].nis + all[1].nis + all[3].nis) / 3.0, 1e-12);
  // Only the first two are successive: the others are too far apart.
  EXPECT_NEAR(sums.lagged, all[0].normalized.dot(all[1].normalized), 1e-12);
}

// Table of the chi-square distribution: 90 degrees, 2.5 and 97.5 %: 65.65 and 118.14.
TEST(Consistency, TheConfidenceIntervalIsThatOfChiSquare) {
  const studies::ValueInterval chance = studies::chance_of_mean(90.0, 1.96);
  EXPECT_NEAR(90.0 * chance.low, 65.65, 0.1);
  EXPECT_NEAR(90.0 * chance.high, 118.14, 0.1);
}

TEST(Consistency, TheReportNamesTheFailedStatistics) {
  studies::ConsistencyBlock good = block_of(1.0, kRuns);
  good.runs.front().innovations = studies::innovation_sums(correlated(0.0, 1.0, 400));
  studies::ConsistencyBlock bad = block_of(0.25, kRuns);
  bad.ins = "consumer";
  studies::ConsistencyBlock none{"x.toml", "tactical", {}, "no such terrain"};
  const studies::ConsistencyReport report{kPlan, {good, bad, none}};
  EXPECT_FALSE(report.passed());
  const auto j = to_json(report);
  EXPECT_EQ(j["blocks"][0]["verdict"], "pass");
  EXPECT_EQ(j["blocks"][0]["position"]["at"][2]["moment"], "30 s without");
  EXPECT_EQ(j["blocks"][0]["position"]["at"][0]["nees_by_run"].size(), kRuns);
  EXPECT_EQ(j["blocks"][1]["velocity"]["inside95_verdict"], "FAIL");
  EXPECT_EQ(j["blocks"][2]["error"], "no such terrain");
  EXPECT_THAT(to_text(studies::nees_table(report)), testing::HasSubstr(" !"));
  EXPECT_THAT(to_text(studies::nis_table(report)), testing::HasSubstr("gps velocity"));
  const std::string page =
      studies::consistency_page(report, {"rcs consistency", "config/demo3.toml", "rcs 1", "today"});
  EXPECT_THAT(page, testing::HasSubstr("made_up: NEES of the attitude"));
  EXPECT_THAT(page, testing::HasSubstr("no such terrain"));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("nan")));
}

class ConsistencyCommand : public rcs::test::RcsCommand {};

TEST_F(ConsistencyCommand, AWrongCommandLineExitsWithTwo) {
  EXPECT_EQ(rcs("consistency --ins best"), 2);
  EXPECT_EQ(rcs("consistency --seeds 0"), 2);
  EXPECT_EQ(rcs("consistency --scenario nothing.toml"), 3);
  EXPECT_EQ(rcs("consistency --help"), 0);
  EXPECT_THAT(out(), testing::HasSubstr("Examples:"));
}

}  // namespace
}  // namespace rcs::test
