#include "tools/report/svg_plot.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tools/report/colour_map.h"
#include "tools/report/plot_area.h"
#include "tools/report/series_path.h"

namespace rcs::report {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Series line(const std::string& label, std::vector<double> x, std::vector<double> y) {
  return {label, Colour::kBlue, SeriesStyle::kLine, std::move(x), std::move(y), {}};
}

std::vector<std::string> texts(const std::vector<double>& ticks) {
  std::vector<std::string> out;
  for (const double tick : ticks) out.push_back(axis_number(tick));
  return out;
}

TEST(Ticks, AreRound) {
  EXPECT_THAT(texts(round_ticks(0.3, 9.7, 5)), ElementsAre("2", "4", "6", "8"));
  EXPECT_THAT(texts(round_ticks(-0.11, 0.12, 4)), ElementsAre("-0.1", "0", "0.1"));
}

TEST(Ticks, OfALogarithmicScaleAreOneTwoAndFive) {
  EXPECT_THAT(texts(log_ticks(0.04, 0.6, 8)), ElementsAre("0.05", "0.1", "0.2", "0.5"));
  EXPECT_THAT(texts(log_ticks(0.1, 10.0, 7)),
              ElementsAre("0.1", "0.2", "0.5", "1", "2", "5", "10"));
}

TEST(Ticks, OfManyDecadesArePowersOfTen) {
  EXPECT_THAT(texts(log_ticks(0.05, 2000.0, 5)), ElementsAre("0.1", "1", "10", "100", "1000"));
  EXPECT_LE(log_ticks(1e-9, 1e9, 5).size(), 5U);
}

TEST(Ticks, OfANarrowLogarithmicScaleAreLinear) {
  EXPECT_THAT(texts(log_ticks(1.1, 1.9, 4)), ElementsAre("1.2", "1.4", "1.6", "1.8"));
}

TEST(SvgPlot, StatesItsAxesForTheScript) {
  Plot plot;
  plot.x_label = "time [s]";
  plot.y_label = "a < b [m]";
  plot.log_y = true;
  plot.window = Window{0.0, 206.5, -3.0, 2.0};
  plot.series.push_back(line("error", {0.0, 206.5}, {0.1, 10.0}));
  const std::string svg = render(plot, false);
  EXPECT_THAT(svg, HasSubstr("data-x=\"0 206.5\" data-y=\"-3 2\" data-x-label=\"time [s]\" "
                             "data-y-label=\"a &lt; b [m]\" data-log-y=\"1\""));
  EXPECT_THAT(svg, HasSubstr("data-frame=\"68.00 30.00 862.00 254.00\""));
  EXPECT_THAT(svg, HasSubstr("class=\"line c-blue\" data-label=\"error\" d=\"M68.00 "));
  EXPECT_THAT(svg, Not(HasSubstr("data-equal")));
  EXPECT_THAT(svg, Not(HasSubstr("data-lanes")));
}

TEST(SvgPlot, AViewFromAboveAndLanesAreMarked) {
  EXPECT_THAT(render(view_from_above("", true, 300), false), HasSubstr(" data-equal=\"1\""));
  Plot lanes;
  lanes.y_names = {"GPS", "LADAR"};
  EXPECT_THAT(render(lanes, false), HasSubstr(" data-lanes=\"1\""));
}

TEST(SvgPlot, PathsHoldTheirValues) {
  Plot plot;
  plot.window = Window{0.0, 100.0, 0.0, 5.0};
  const PlotArea area = area_of(plot);
  const Series s = line("", {12.34}, {3.21});
  double x = 0.0;
  double y = 0.0;
  ASSERT_EQ(std::sscanf(path_of(s, area).c_str(), "M%lf %lf", &x, &y), 2);
  const double at_x = area.x.low + (x - area.left) / (area.right - area.left) * area.x.span();
  const double at_y = area.y.low + (area.bottom - y) / (area.bottom - area.top) * area.y.span();
  EXPECT_NEAR(at_x, 12.34, 0.001);
  EXPECT_NEAR(at_y, 3.21, 0.001);
}

TEST(SvgPlot, AGapInterruptsABand) {
  Plot plot;
  plot.window = Window{0.0, 3.0, 0.0, 1.0};
  Series band{"", Colour::kBlue, SeriesStyle::kBand, {0, 1, 2, 3}, {1, kNone, 1, 1}, {0, 0, 0, 0}};
  const std::string path = path_of(band, area_of(plot));
  EXPECT_EQ(std::count(path.begin(), path.end(), 'M'), 2);
  EXPECT_EQ(std::count(path.begin(), path.end(), 'Z'), 2);
  EXPECT_THAT(path, Not(HasSubstr("nan")));
}

TEST(SvgPlot, ABandToZeroReachesTheFootOfALogarithmicAxis) {
  Plot plot;
  plot.log_y = true;
  plot.window = Window{0.0, 1.0, -1.0, 1.0};
  const PlotArea area = area_of(plot);
  Series band{"", Colour::kBlue, SeriesStyle::kBand, {0, 1}, {10, 10}, {0, 0}};
  EXPECT_THAT(path_of(band, area), HasSubstr("L862.00 254.00L68.00 254.00Z"));
}

TEST(SvgPlot, ALabelOfANarrowIntervalIsHidden) {
  Plot plot;
  plot.window = Window{0.0, 100.0, 0.0, 1.0};
  plot.shades = {{10.0, 11.0, "no GPS"}};
  EXPECT_THAT(render(plot, false), HasSubstr("visibility=\"hidden\">no GPS<"));
  plot.shades = {{10.0, 60.0, "no GPS"}};
  EXPECT_THAT(render(plot, false), Not(HasSubstr("hidden")));
}

CellMap map_of(const std::vector<double>& values, bool log) {
  CellMap map{1.0, {}, "sigma [m]", log};
  for (std::size_t k = 0; k < values.size(); ++k) {
    map.cells.push_back({static_cast<int>(k), 0, values[k]});
  }
  return map;
}

TEST(ColourMap, TheBarOfALogarithmicScaleIsInMetres) {
  const CellMap map = map_of({0.04, 0.3, 10.0}, true);
  EXPECT_THAT(texts(ColourScale(map).ticks(5)), ElementsAre("0.1", "1", "10"));
  EXPECT_THAT(texts(ColourScale(map).ticks(9)),
              ElementsAre("0.05", "0.1", "0.2", "0.5", "1", "2", "5", "10"));
  const std::string bar = colour_bar_svg(map, area_of(Plot{}));
  EXPECT_THAT(bar, HasSubstr(">sigma [m]<"));
  EXPECT_THAT(bar, HasSubstr(">0.1<"));
  EXPECT_THAT(bar, Not(HasSubstr("log")));
}

TEST(ColourMap, TheBarOfALinearScaleHasRoundValues) {
  EXPECT_THAT(texts(ColourScale(map_of({-1.37, 2.61}, false)).ticks(5)),
              ElementsAre("-1", "0", "1", "2"));
}

TEST(ColourMap, EqualRatiosAreEqualSteps) {
  const ColourScale scale(map_of({0.01, 100.0}, true));
  EXPECT_EQ(scale.step_of(0.01), 0U);
  EXPECT_EQ(scale.step_of(0.99), 3U);
  EXPECT_EQ(scale.step_of(1.01), 4U);
  EXPECT_EQ(scale.step_of(1e9), 7U);
  EXPECT_EQ(scale.step_of(0.0), 0U);
  EXPECT_THAT(scale.edge(4), DoubleEq(1.0));
}

TEST(ColourMap, CellsStateTheRangeOfTheirColour) {
  Plot plot = view_from_above("", true, 300);
  plot.map = map_of({0.01, 100.0}, true);
  const std::string svg = render(plot, false);
  EXPECT_THAT(svg, HasSubstr("data-value=\"0.01 to 0.0316\""));
  EXPECT_THAT(svg, HasSubstr("data-value=\"31.6 to 100\""));
  EXPECT_THAT(svg, HasSubstr("data-map-label=\"sigma [m]\""));
}

}  // namespace
}  // namespace rcs::report
