// The paper (Madhavan and Messina, section 4) calls its method robust to gross outliers, to
// occlusions, and to data that is not a subset of the model, and gives no numbers. This test
// measures them for its method and for ours. `ctest -L slow -R OutlierSweep -V` prints the tables;
// the pictures go to $RCS_OUT_DIR/outliers (default: out/outliers in the working folder). RCS_SEEDS
// sets the guesses of each pair of scans (default 2: 40 trials a point).

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "modules/registration/cloud_registration.h"
#include "modules/registration/gicp.h"
#include "modules/registration/madhavan_messina_icp.h"
#include "rcs/base/check.h"
#include "sim/scenario_file.h"
#include "tests/sp/scan_defects.h"
#include "tools/base/files.h"
#include "tools/base/statistics.h"
#include "tools/report/svg_plot.h"
#include "tools/report/table.h"
#include "tools/studies/scan_pairs.h"

namespace rcs::test {
namespace {

using report::Colour;
using report::SeriesStyle;

constexpr int kPairs = 10;  // of scans, of each terrain
constexpr double kApart_m = 1.0;
constexpr studies::Offset kGuess = {0.3, radians(2.0)};

struct Answer {
  Pose T_model_data;
  bool claimed = false;  ///< the method reports success
};

Answer as_in_paper(const KnownPair& pair, const Pose& guess,
                   const registration::PaperParams& params) {
  const registration::PaperResult r =
      registration::register_as_in_paper(pair.model, pair.data, guess, params);
  return {r.T_model_data, r.stop == registration::PaperStop::kRelativeChange ||
                              r.stop == registration::PaperStop::kMeanDistance ||
                              r.stop == registration::PaperStop::kLimitCycle};
}

Answer answer_of(const registration::Registration& r) {
  return {r.T_target_vehicle, registration::usable(r.stop)};
}

struct Method {
  const char* name;
  report::Colour colour;
  report::SeriesStyle style;
  Answer (*run)(const KnownPair& pair, const Pose& guess);
};
constexpr std::array<Method, 5> kMethods = {{
    {"paper, literal", report::Colour::kGrey, report::SeriesStyle::kLine,
     [](const KnownPair& p, const Pose& guess) {
       return as_in_paper(p, guess, registration::PaperParams::literal());
     }},
    {"paper, corrected", report::Colour::kOrange, report::SeriesStyle::kLine,
     [](const KnownPair& p, const Pose& guess) { return as_in_paper(p, guess, {}); }},
    {"production", report::Colour::kBlue, report::SeriesStyle::kLine,
     [](const KnownPair& p, const Pose& guess) {
       const registration::CloudRegistration r =
           registration::register_clouds(p.model, p.data, guess, {});
       return Answer{r.best.T_target_vehicle, r.accepted};
     }},
    {"production, refine only", report::Colour::kBlue, report::SeriesStyle::kDashed,
     [](const KnownPair& p, const Pose& guess) {
       return answer_of(registration::CloudMatcher(p.model, p.data, {}).refine(guess));
     }},
    {"gicp", report::Colour::kGreen, report::SeriesStyle::kLine,
     [](const KnownPair& p, const Pose& guess) {
       return answer_of(registration::register_gicp(p.model, p.data, guess, {}));
     }},
}};
constexpr std::size_t kProduction = 2;
constexpr std::size_t kRefineOnly = 3;

/// Statistics of a method over all trials of a point of a sweep.
struct Metrics {
  std::vector<double> error_m;
  std::vector<double> error_deg;
  int successes = 0;
  int unnoticed = 0;  ///< failures that the method does not report

  [[nodiscard]] double success() const {
    return successes / static_cast<double>(std::max<std::size_t>(1, error_m.size()));
  }
};
double share_of(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return tools::percentile(values, share);
}

using Point = std::array<Metrics, kMethods.size()>;  // by method
using Spoil = std::function<void(double share, std::mt19937* rng, KnownPair* pair)>;

int seeds() {
  const char* const value = std::getenv("RCS_SEEDS");
  return value == nullptr ? 2 : std::max(1, std::atoi(value));
}

Point run_point(const std::vector<KnownPair>& pairs, double share, const Spoil& spoil) {
  Point point;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    for (int seed = 0; seed < seeds(); ++seed) {
      // The same guess and outliers for all methods, and the same guess for all shares.
      std::mt19937 rng(1000U * static_cast<unsigned>(k) + static_cast<unsigned>(seed));
      const Pose guess = pairs[k].T_model_data * studies::random_offset(kGuess, &rng);
      KnownPair spoilt = pairs[k];
      if (share > 0.0) spoil(share, &rng, &spoilt);
      for (std::size_t m = 0; m < kMethods.size(); ++m) {
        const Answer answer = kMethods.at(m).run(spoilt, guess);
        const studies::Offset error = studies::error_of(spoilt.T_model_data, answer.T_model_data);
        Metrics& f = point.at(m);
        f.error_m.push_back(error.m);
        f.error_deg.push_back(degrees(error.rad));
        f.successes += studies::is_success(error) ? 1 : 0;
        f.unnoticed += !studies::is_success(error) && answer.claimed ? 1 : 0;
      }
    }
  }
  return point;
}

void add_rows(const std::string& name, const Point& point, report::Table* table) {
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    const Metrics& f = point.at(m);
    table->rows.push_back({m == 0 ? name : "", kMethods.at(m).name,
                           fmt::format("{} of {}", f.successes, f.error_m.size()),
                           fmt::format("{}", f.unnoticed),
                           fmt::format("{:.3f}", share_of(f.error_m, 0.5)),
                           fmt::format("{:.3f}", share_of(f.error_m, 0.9)),
                           fmt::format("{:.2f}", share_of(f.error_deg, 0.5)),
                           fmt::format("{:.2f}", share_of(f.error_deg, 0.9))});
  }
}
report::Table table_of(const std::string& what) {
  return {{what, "method", "success", "unnoticed", "error [m] 50 %", "90 %", "[deg] 50 %", "90 %"},
          {}};
}

struct Trouble {
  const char* name;  ///< of the output file
  const char* title;
  const char* share_label;
  std::vector<double> shares;  ///< without 0
  Spoil spoil;
};
const std::vector<Trouble>& troubles() {
  static const std::vector<Trouble> all = {
      {"outliers",
       "Gross outliers anywhere in the scan's box",
       "of the data are outliers [%]",
       {0.1, 0.2, 0.3, 0.4, 0.5, 0.6},
       add_outliers},
      {"occlusion",
       "One side of the data is hidden",
       "of the data are missing [%]",
       {0.25, 0.5, 0.75},
       occlude},
      {"moving",
       "Objects have moved by 0.5 to 2 m",
       "of the data have moved [%]",
       {0.1, 0.2, 0.3, 0.4, 0.5, 0.6},
       move_objects},
      {"uncovered",
       "The model ends at an azimuth",
       "of the data are outside of the model [%]",
       {0.1, 0.2, 0.3, 0.4, 0.5, 0.6},
       crop_model},
  };
  return all;
}

struct Sweep {
  std::vector<double> percent;
  std::vector<Point> points;

  [[nodiscard]] double success(std::size_t method, double percent_wanted) const {
    const auto near = [percent_wanted](double p) { return std::abs(p - percent_wanted) < 0.1; };
    const auto at = std::find_if(percent.begin(), percent.end(), near);
    RCS_CHECK(at != percent.end());
    return points[static_cast<std::size_t>(at - percent.begin())].at(method).success();
  }
};

report::Plot plot_of(const Sweep& sweep, const std::string& title, const std::string& x_label,
                     const std::string& y_label, double (*value)(const Metrics&)) {
  report::Plot plot;
  plot.title = title;
  plot.x_label = x_label;
  plot.y_label = y_label;
  for (std::size_t m = 0; m < kMethods.size(); ++m) {
    report::Series s;
    s.label = kMethods.at(m).name;
    s.colour = kMethods.at(m).colour;
    s.style = kMethods.at(m).style;
    s.x = sweep.percent;
    for (const Point& p : sweep.points) s.y.push_back(value(p.at(m)));
    plot.series.push_back(s);
  }
  return plot;
}

std::string picture(const Sweep& sweep, const Trouble& trouble, const std::string& scanner) {
  const std::string title = fmt::format("{}: {}", trouble.title, scanner);
  report::Plot success = plot_of(sweep, title, trouble.share_label, "below 0.1 m and 0.5 deg [%]",
                                 [](const Metrics& f) { return 100.0 * f.success(); });
  success.window = report::Window{0.0, sweep.percent.back(), -4.0, 104.0};
  report::Plot median = plot_of(sweep, "Error, median", trouble.share_label, "[m]",
                                [](const Metrics& f) { return share_of(f.error_m, 0.5); });
  report::Plot worst = plot_of(sweep, "Error, 90 % of the trials", trouble.share_label, "[m]",
                               [](const Metrics& f) { return share_of(f.error_m, 0.9); });
  median.log_y = worst.log_y = true;
  for (report::Plot* const plot : {&median, &worst}) {
    plot->series.push_back({"0.1 m",
                            report::Colour::kPurple,
                            report::SeriesStyle::kHair,
                            {0.0, sweep.percent.back()},
                            {0.1, 0.1},
                            {}});
  }
  return report::render_stacked({success, median, worst});
}

std::string out_folder() {
  const char* const folder = std::getenv("RCS_OUT_DIR");
  return std::string(folder == nullptr ? "out" : folder) + "/outliers";
}

class OutlierSweep : public testing::Test {
 protected:
  void SetUp() override {
    const char* const root = std::getenv("RCS_SOURCE_DIR");
    const Result<sim::Scenario> scenario = sim::load_scenario(
        std::string(root == nullptr ? "." : root) + "/config/sim/reference.toml", {});
    ASSERT_TRUE(scenario.ok());
    reference_ = *scenario;
  }

  /// All terrains on which a scan of this scanner can be registered to another, together.
  std::vector<Sweep> run(Scanner scanner, const std::string& name) {
    std::vector<KnownPair> pairs;
    report::Table table = table_of(name);
    for (const ScanPlace& place : scan_places(reference_)) {
      if (place.scanner != scanner) continue;
      const std::vector<KnownPair> here = known_pairs(place, reference_, kApart_m, kPairs);
      add_rows(place.name, run_point(here, 0.0, {}), &table);
      if (place.name == "wooded hills") continue;
      pairs.insert(pairs.end(), here.begin(), here.end());
    }
    fmt::print("untroubled\n{}\n", to_text(table));
    const Point untroubled = run_point(pairs, 0.0, {});
    std::vector<Sweep> sweeps;
    for (const Trouble& trouble : troubles()) {
      Sweep sweep;
      sweep.percent = {0.0};
      sweep.points = {untroubled};
      table = table_of("");
      add_rows("0 %", untroubled, &table);
      for (const double share : trouble.shares) {
        sweep.percent.push_back(100.0 * share);
        sweep.points.push_back(run_point(pairs, share, trouble.spoil));
        add_rows(fmt::format("{:.0f} %", 100.0 * share), sweep.points.back(), &table);
      }
      fmt::print("{}: {}, {}\n{}\n", name, trouble.title, trouble.share_label, to_text(table));
      std::fflush(stdout);
      const std::string path = fmt::format("{}/{}_{}.svg", out_folder(), trouble.name,
                                           scanner == Scanner::kImager ? "imager" : "spinning");
      EXPECT_TRUE(tools::write_text(path, picture(sweep, trouble, name)).ok()) << path;
      sweeps.push_back(std::move(sweep));
    }
    return sweeps;
  }

  sim::Scenario reference_;
};

// The fine stage alone, from a guess as accurate as navigation; and the production method, whose
// coarse search can diverge because of surfaces that only one scan has seen, but whose result is
// then rejected.
TEST_F(OutlierSweep, ScansAllAround) {
  const std::vector<Sweep> sweeps = run(Scanner::kSpinning, "scans all around");
  ASSERT_EQ(sweeps.size(), 4U);
  const auto& [outliers, occlusion, moving, uncovered] =
      std::tie(sweeps[0], sweeps[1], sweeps[2], sweeps[3]);
  // The measured rate is 100 % of 40 in all of these; with a true rate of 99 %, two or more of 40
  // trials fail with a probability of 1/16.
  EXPECT_GE(outliers.success(kRefineOnly, 0.0), 0.95);
  EXPECT_GE(outliers.success(kRefineOnly, 30.0), 0.95);
  EXPECT_GE(outliers.success(kRefineOnly, 60.0), 0.9);
  EXPECT_GE(occlusion.success(kRefineOnly, 50.0), 0.95);
  EXPECT_GE(moving.success(kRefineOnly, 30.0), 0.95);
  EXPECT_GE(uncovered.success(kRefineOnly, 30.0), 0.95);
  EXPECT_GE(uncovered.success(kRefineOnly, 60.0), 0.9);
  EXPECT_GE(outliers.success(kProduction, 0.0), 0.95);
  EXPECT_GE(outliers.success(kProduction, 30.0), 0.9);
  EXPECT_GE(occlusion.success(kProduction, 50.0), 0.8);
  EXPECT_GE(uncovered.success(kProduction, 30.0), 0.9);
}

// One scan of 5,760 cells ahead is a poor model: half of the trials without defects fail already.
TEST_F(OutlierSweep, ScansOfTheImager) {
  const std::vector<Sweep> sweeps = run(Scanner::kImager, "scans of the imager");
  ASSERT_EQ(sweeps.size(), 4U);
  EXPECT_GE(sweeps[0].success(kRefineOnly, 0.0), 0.45);
  EXPECT_GE(sweeps[0].success(kRefineOnly, 30.0), 0.3);
}

}  // namespace
}  // namespace rcs::test
