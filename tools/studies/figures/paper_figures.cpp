#include "tools/studies/figures/paper_figures.h"

#include <fmt/format.h>

#include <utility>

#include "tools/studies/figures/figure_pair.h"
#include "tools/studies/figures/figure_panels.h"
#include "tools/studies/kitti_drive.h"

namespace rcs::studies {
namespace {

using report::Plot;

std::string methods_text(const FigurePair& pair) {
  std::string text = fmt::format("Before: mean distance {:.1f} cm.", pair.before.mean_cm());
  for (const MethodResult& m : pair.methods) text += fmt::format(" {}.", m.text());
  return text;
}

std::string scan_text(const Points& points, int number) {
  return fmt::format(
      "Scan {}, {} points. The colours of the range images 2 (a) and 2 (b) have the same limits; a "
      "cell without a return is blank.",
      number, points.size());
}

PaperFigure distance_figure(const char* number, const FigurePanels& panels,
                            const FigurePair& pair) {
  return {
      number,
      "",
      "closest-point distances",
      "The distances of the closest points, before and after registration.",
      "Before, and after each method, with one scale. What only one of the scans has seen stays "
      "without a close point. A small mean distance does not prove that the pose is right: "
      "compare the errors. " +
          methods_text(pair),
      panels.distances('d')};
}

void add_figure_2(const FigureSource& source, const FigurePair& pair,
                  std::vector<PaperFigure>* out) {
  const FigurePanels panels(source.name + ", 2", source.image, source.vehicle, pair);
  out->push_back({"2 (a)", "", "the model scan",
                  "The LADAR range image of the model M, with the vehicle that acquired it.",
                  scan_text(pair.model, pair.trial.pair.model), panels.model('a')});
  out->push_back({"2 (b)", "", "the data scan",
                  "The range image of the data D, the next scan, with the vehicle.",
                  scan_text(pair.data, pair.trial.pair.data), panels.data('b')});
  std::vector<Plot> after;
  for (const MethodResult& m : pair.methods) after.push_back(panels.above('c', m.after));
  after.push_back(panels.detail('c', pair.before));
  for (const MethodResult& m : pair.methods) after.push_back(panels.detail('c', m.after));
  out->push_back(
      {"2 (c)", "", "after registration", "Both range images after registration.",
       "Both scans after each method, and a part of them, magnified, before and after. " +
           methods_text(pair),
       std::move(after)});
  out->push_back(distance_figure("2 (d)", panels, pair));
}

void add_figure_3(const FigureSource& source, const FigurePair& pair,
                  std::vector<PaperFigure>* out) {
  const FigurePanels panels(source.name + ", 3", source.image, source.vehicle, pair);
  const PlacedData& before = pair.before;
  out->push_back(
      {"3 (a)",
       "",
       "before registration",
       "The range images before registration. D is the scan 20 scans after M, and is moved by "
       "another 1 m along each axis.",
       fmt::format(
           "Scans {} and {}, {:.1f} m apart. D is at the initial pose: the true one with an "
           "error typical of navigation, 0.3 m and 1 deg, and 1 m along each axis. Mean "
           "distance {:.1f} cm.",
           pair.trial.pair.model, pair.trial.pair.data, pair.trial.pair.T_model_data.p.norm(),
           before.mean_cm()),
       {panels.above('a', before), panels.side('a', before), panels.detail('a', before)}});
  std::vector<Plot> after;
  for (const MethodResult& m : pair.methods) {
    after.push_back(panels.above('b', m.after));
    after.push_back(panels.side('b', m.after));
    after.push_back(panels.detail('b', m.after));
  }
  out->push_back({"3 (b)", "", "after registration", "The range images after registration.",
                  "With the windows and scales of 3 (a). " + methods_text(pair), std::move(after)});
  if (const MidwaySearch search = search_midway(pair); search.iterations > 0) {
    FigurePanels::Pairs pairs = panels.pairs('c', search);
    out->push_back(
        {"3 (c)", "", "the search for closest points",
         "A magnified view of the search for the nearest points in three dimensions, from which "
         "the correspondences follow, midway through the registration.",
         fmt::format(
             "After {} of {} iterations of the paper's method, corrected. A line joins each "
             "point of D with the closest point of M. This iteration accepts pairs up to "
             "D_max = {:.2f} m: in this part {}, and {} are rejected.",
             search.iteration, search.iterations, search.d_max_m, pairs.accepted, pairs.rejected),
         std::move(pairs.plots)});
  }
  out->push_back(distance_figure("3 (d)", panels, pair));
}

void add_rows(const char* set, const FigurePair& pair, report::Table* table) {
  table->rows.push_back({set, "", "", "", "", "", ""});
  for (const MethodResult& m : pair.methods) {
    table->rows.push_back(
        {m.method, fmt::format("{}/{}", pair.model.size(), pair.data.size()),
         fmt::format("{:.1f}", pair.before.mean_cm()), fmt::format("{:.1f}", m.after.mean_cm()),
         fmt::format("{}", m.match.iterations),
         fmt::format("{:.3f} m, {:.2f} deg", m.error.m, degrees(m.error.rad)), m.verdict()});
  }
}

/// "kitti_figure_2a.svg".
std::string file_name(const FigureSource& source, const std::string& number) {
  return fmt::format("{}_figure_{}{}.svg", source.file, number.front(), number[3]);
}

}  // namespace

FigureSource kitti_source() {
  FigureSource source;
  source.name = "KITTI";
  source.file = "kitti";
  source.about =
      "Sweeps of KITTI's drive 0005, cut to the 32 x 180 cells of the paper's range image. The "
      "true motion is that of the whole sweeps, deskewed, by generalized ICP. The frame is that "
      "of the LADAR of M; the vehicle is drawn with its nominal size.";
  source.image = real_cut_shape();
  VehicleShape& v = source.vehicle;  // a station wagon with the LADAR on its roof
  v.front = 2.8;
  v.rear = -1.97;
  v.half_width = 0.91;
  v.ground = -1.73;
  v.roof = -0.25;
  v.front_axle = 1.85;
  v.rear_axle = -0.86;
  return source;
}

FigureSource simulation_source(const sim::Scenario& scenario, const std::string& scenario_name) {
  constexpr double kOverhang_m = 0.3;
  constexpr double kHull_m = 0.3;  // above the origin of the vehicle
  FigureSource source;
  source.name = "simulation";
  source.file = "simulation";
  source.about = fmt::format(
      "Scans of the simulated range imager, {} x {} cells, of {}. The true motion is known "
      "exactly. The frame is that of the LADAR mount of M. In vegetation the next scan hits other "
      "leaves and other grass, so that one scan determines the motion poorly.",
      scenario.imager.rows, scenario.imager.cols, scenario_name);
  const sim::ImagerParams& imager = scenario.imager;
  source.image = {imager.rows,
                  imager.cols,
                  0.5 * imager.fov_h_rad,
                  imager.fov_h_rad,
                  imager.tilt_rad - 0.5 * imager.fov_v_rad,
                  imager.fov_v_rad};
  VehicleShape& v = source.vehicle;
  v.T_ladar_vehicle = scenario.mount.T_vehicle_mount.inverse();
  v.front_axle = 0.5 * scenario.vehicle.wheelbase_m;
  v.rear_axle = -v.front_axle;
  v.front = v.front_axle + kOverhang_m;
  v.rear = -v.front;
  v.half_width = 0.5 * scenario.vehicle.track_m;
  v.ground = -scenario.vehicle.imu_height_m;
  v.roof = kHull_m;
  return source;
}

FigureSet paper_figures(FigureSource source, const ScanSet& scans, const Trial& consecutive,
                        const Trial& distant) {
  FigureSet set;
  set.source = std::move(source);
  const FigurePair two = register_for_figures(scans, consecutive);
  const FigurePair three = register_for_figures(scans, distant);
  set.table.header = {"data set",   "points M/D", "before [cm]", "after [cm]",
                      "iterations", "error",      "result is"};
  add_rows("#1, figure 2", two, &set.table);
  add_rows("#3, figure 3", three, &set.table);
  set.table.note =
      "before, after: mean distance of the data points to the closest model points; error: of the "
      "pose of D, against the true motion; accepted: by the check of the result, which does not "
      "know the truth; a rejected result is not used. The paper has 5.77 cm after 6 iterations for "
      "#1 and 4.64 cm after 38 for "
      "#3, of its own scans, and no error of the pose.";
  add_figure_2(set.source, two, &set.figures);
  add_figure_3(set.source, three, &set.figures);
  for (PaperFigure& figure : set.figures) figure.file = file_name(set.source, figure.number);
  return set;
}

std::string paper_figures_page(const std::vector<FigureSet>& sets,
                               const report::PageOrigin& origin) {
  report::HtmlPage page("Figures 2 and 3 of the paper", origin);
  page.paragraph(
      "The figures of Madhavan and Messina, \"Iterative Registration of 3D LADAR Data for "
      "Autonomous Navigation\", from other scans: the scan D (data) is registered to the scan M "
      "(model). Figure 2 has consecutive scans (data set #1 of the paper's Table 1), figure 3 "
      "scans that are 20 apart, moved by another 1 m along each axis (#3).");
  page.paragraph(fmt::format(
      "Each registration is shown by two methods: \"{}\" is the paper's method without the errors "
      "of its printed equations, \"{}\" the method of rcs register: a search by occupancy, then "
      "point to plane.",
      kPaperMethod, kPlaneMethod));
  for (const FigureSet& set : sets) {
    page.heading(fmt::format("{}: values", set.source.name));
    page.paragraph(set.source.about);
    page.table(set.table);
    for (const PaperFigure& figure : set.figures) {
      page.heading(fmt::format("{}, figure {}: {}", set.source.name, figure.number, figure.title));
      page.paragraph("In the paper: " + figure.in_paper);
      page.paragraph("Here: " + figure.here + " File: " + figure.file + ".");
      for (const Plot& plot : figure.plots) page.plot(plot);
    }
  }
  return page.finish();
}

}  // namespace rcs::studies
