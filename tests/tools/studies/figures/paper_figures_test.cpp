// Figures 2 and 3 of the paper from scans of two walls on rolling ground.

#include "tools/studies/figures/paper_figures.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "rcs/base/kd_tree.h"
#include "tests/support/point_scenes.h"
#include "tools/studies/figures/figure_pair.h"
#include "tools/studies/figures/figure_panels.h"

namespace rcs::studies {
namespace {

using report::Plot;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Three scans of two walls on rolling ground, as samples of their own of the surfaces.
struct Drive {
  Drive() {
    set.pairs = {{0, 1, test::pose(0.4, 0.05, 0.0, 0.0, 0.0, 0.01)},
                 {0, 20, test::pose(6.0, 0.5, 0.1, 0.0, 0.0, 0.1)}};
    std::mt19937 rng(7);
    const Vec3 centre(10.0, 0.0, 0.0);
    const auto scan = [&](const Pose& T_model_data) {
      const Points all = test::scene(test::Ground::kRolling, true, 3000, 0.02, centre, &rng);
      return test::moved(T_model_data.inverse(), all);
    };
    set.scans[0] = scan(Pose{});
    set.scans[1] = scan(set.pairs[0].T_model_data);
    set.scans[20] = scan(set.pairs[1].T_model_data);
    consecutive = trials_of(DataSet::kConsecutive, set.pairs, 1).front();
    distant = trials_of(DataSet::kMovedBy1m, set.pairs, 1).front();
  }
  ScanSet set;
  Trial consecutive;
  Trial distant;
};

const FigureSet& figures() {
  static const FigureSet drawn = [] {
    const Drive drive;
    return paper_figures(kitti_source(), drive.set, drive.consecutive, drive.distant);
  }();
  return drawn;
}

const PaperFigure& figure(const std::string& number) {
  const auto& all = figures().figures;
  const auto it = std::find_if(all.begin(), all.end(),
                               [&](const PaperFigure& f) { return f.number == number; });
  RCS_CHECK(it != all.end());
  return *it;
}

bool same(const std::optional<report::Window>& a, const std::optional<report::Window>& b) {
  return a && b && a->x_low == b->x_low && a->x_high == b->x_high && a->y_low == b->y_low &&
         a->y_high == b->y_high;
}

TEST(PaperFigures, AreThoseOfThePaper) {
  std::vector<std::string> numbers;
  std::vector<std::string> files;
  for (const PaperFigure& f : figures().figures) {
    numbers.push_back(f.number);
    files.push_back(f.file);
    EXPECT_FALSE(f.plots.empty()) << f.number;
    EXPECT_FALSE(f.in_paper.empty()) << f.number;
    EXPECT_FALSE(f.here.empty()) << f.number;
  }
  EXPECT_THAT(numbers,
              ElementsAre("2 (a)", "2 (b)", "2 (c)", "2 (d)", "3 (a)", "3 (b)", "3 (c)", "3 (d)"));
  EXPECT_EQ(files.front(), "kitti_figure_2a.svg");
  EXPECT_EQ(std::set<std::string>(files.begin(), files.end()).size(), 8U);
}

TEST(PaperFigures, BeforeAndAfterHaveOneScale) {
  const std::vector<Plot>& before = figure("3 (a)").plots;
  const std::vector<Plot>& after = figure("3 (b)").plots;
  ASSERT_EQ(after.size(), 2 * before.size());  // two methods
  for (std::size_t i = 0; i < after.size(); ++i) {
    const Plot& a = before[i % before.size()];
    EXPECT_TRUE(same(a.window, after[i].window)) << i;
    EXPECT_EQ(a.height_px, after[i].height_px);
  }
  const std::vector<Plot>& model = figure("2 (a)").plots;
  const std::vector<Plot>& data = figure("2 (b)").plots;
  ASSERT_EQ(model.size(), data.size());
  for (std::size_t i = 0; i < model.size(); ++i) {
    EXPECT_TRUE(same(model[i].window, data[i].window)) << i;
  }
  // The colours of the range images, too: both contain the limits.
  const auto limits = [](const Plot& plot) {
    std::pair<double, double> w{1e9, -1e9};
    for (const report::CellMap::Cell& c : plot.map->cells) {
      w = {std::min(w.first, c.value), std::max(w.second, c.value)};
    }
    return w;
  };
  ASSERT_TRUE(model.front().map && data.front().map);
  EXPECT_EQ(limits(model.front()), limits(data.front()));
  for (const char* number : {"2 (d)", "3 (d)"}) {
    const std::vector<Plot>& distances = figure(number).plots;
    ASSERT_EQ(distances.size(), 4U);  // before, two methods, histogram
    EXPECT_TRUE(same(distances[0].window, distances[1].window));
    EXPECT_TRUE(same(distances[0].window, distances[2].window));
  }
}

TEST(PaperFigures, ShowTheVehicleAtBothScans) {
  const Plot& after = figure("2 (c)").plots.front();
  ASSERT_EQ(after.series.size(), 4U);  // model, data, and their vehicles
  const report::Series& at_model = after.series[2];
  const report::Series& at_data = after.series[3];
  ASSERT_EQ(at_model.x.size(), at_data.x.size());
  const Vec2 moved(at_data.x[0] - at_model.x[0], at_data.y[0] - at_model.y[0]);
  EXPECT_NEAR(moved.norm(), 0.4, 0.1);  // the motion, as registered
  EXPECT_EQ(at_data.label, "vehicle at D");
}

TEST(PaperFigures, DistancesAreThoseOfTheClosestPoints) {
  const Drive drive;
  const FigurePair pair = register_for_figures(drive.set, drive.distant);
  const KdTree tree(pair.model);
  const auto expect_distances = [&](const PlacedData& placed) {
    ASSERT_EQ(placed.distance_m.size(), pair.data.size());
    for (std::size_t i = 0; i < pair.data.size(); i += 97) {
      const Vec3f p = (placed.T_model_data * pair.data[i].cast<double>()).cast<float>();
      EXPECT_LT((p - placed.data_model[i]).norm(), 1e-5F);
      EXPECT_NEAR(placed.distance_m[i], std::sqrt(tree.closest(p).distance2_m2), 1e-5F);
    }
  };
  expect_distances(pair.before);
  ASSERT_EQ(pair.methods.size(), 2U);
  for (const MethodResult& m : pair.methods) {
    expect_distances(m.after);
    EXPECT_LT(m.after.mean_cm(), pair.before.mean_cm()) << m.method;
  }
  EXPECT_EQ(pair.methods.front().method, kPaperMethod);
  EXPECT_LT(pair.methods.back().error.m, 0.1);
  const report::Series& dots = figure("3 (d)").plots.front().series.front();
  EXPECT_EQ(dots.y.size(), pair.data.size());
  EXPECT_NEAR(dots.y[5], 100.0 * double{pair.before.distance_m[5]}, 1e-6);
}

TEST(PaperFigures, ThePairsAreThoseOfAnIterationInTheMiddle) {
  const Drive drive;
  const FigurePair pair = register_for_figures(drive.set, drive.distant);
  const MidwaySearch search = search_midway(pair);
  const auto& history = pair.methods.front().match.paper->history;
  ASSERT_GT(history.size(), 2U);
  EXPECT_EQ(search.iteration, history.size() / 2);
  // The pairs that this iteration accepts are those that the method has accepted in it.
  int accepted = 0;
  for (const float d : search.distance_m) accepted += double{d} <= search.d_max_m ? 1 : 0;
  EXPECT_EQ(accepted, history[search.iteration].pairs);
  const FigurePanels panels("test", figures().source.image, VehicleShape{}, pair);
  const FigurePanels::Pairs shown = panels.pairs('c', search);
  ASSERT_EQ(shown.plots.size(), 2U);
  const report::Series& above = shown.plots[0].series.front();
  const report::Series& side = shown.plots[1].series.front();
  ASSERT_EQ(above.x.size(), 3 * shown.accepted);
  const KdTree tree(pair.model);
  for (std::size_t i = 0; i + 2 < above.x.size(); i += 3) {
    const Vec3f p(static_cast<float>(above.x[i]), static_cast<float>(above.y[i]),
                  static_cast<float>(side.y[i]));
    const Vec3f q(static_cast<float>(above.x[i + 1]), static_cast<float>(above.y[i + 1]),
                  static_cast<float>(side.y[i + 1]));
    EXPECT_NEAR((p - q).norm(), std::sqrt(tree.closest(p).distance2_m2), 1e-5F);
    EXPECT_LE((p - q).norm(), search.d_max_m);
  }
}

TEST(PaperFigures, ThePageHasEveryFigureBelowItsCaption) {
  const std::string page =
      paper_figures_page({figures()}, {"rcs table1 --plot f", "", "rcs", "now"});
  for (const PaperFigure& f : figures().figures) {
    EXPECT_THAT(page, HasSubstr("KITTI, figure " + f.number + ": " + f.title));
    EXPECT_THAT(page, HasSubstr(f.file));
    for (const Plot& plot : f.plots) EXPECT_THAT(page, HasSubstr(report::escape_xml(plot.title)));
  }
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_THAT(page, HasSubstr("paper, corrected"));
  // Plots with one title would share their clip paths.
  std::set<std::string> titles;
  std::size_t plots = 0;
  for (const PaperFigure& f : figures().figures) {
    for (const Plot& plot : f.plots) titles.insert(plot.title);
    plots += f.plots.size();
  }
  EXPECT_EQ(titles.size(), plots);
}

TEST(PaperFigures, TheSimulatedImageIsThatOfItsScenario) {
  sim::Scenario scenario;
  scenario.mount.T_vehicle_mount.p = Vec3(0.9, 0.0, 0.9);
  const FigureSource source = simulation_source(scenario, "a.toml");
  EXPECT_EQ(source.image.rows, 32);
  EXPECT_NEAR(degrees(source.image.lowest_rad), -20.0, 1e-9);
  EXPECT_NEAR(degrees(source.image.left_rad), 45.0, 1e-9);
  // The LADAR is 1.8 m above the ground.
  EXPECT_NEAR((source.vehicle.T_ladar_vehicle * Vec3(0.0, 0.0, source.vehicle.ground)).z(), -1.8,
              1e-12);
  EXPECT_THAT(source.about, HasSubstr("a.toml"));
}

}  // namespace
}  // namespace rcs::studies
