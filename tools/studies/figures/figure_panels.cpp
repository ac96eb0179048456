#include "tools/studies/figures/figure_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/base/statistics.h"

namespace rcs::studies {
namespace {

using report::Colour;
using report::Plot;
using report::Projection;
using report::Series;
using report::SeriesStyle;
using report::Window;

constexpr Colour kModel = Colour::kOrange;
constexpr Colour kData = Colour::kBlue;
constexpr double kFrame_px = 100.0;        // title, legend and axis of a plot
constexpr double kInner_px = 794.0;        // width between the axes
constexpr std::size_t kMaxBigDots = 1000;  // of a cloud: more would hide one another
constexpr double kShownShare = 0.98;       // of the distances
constexpr double kShownMedians = 5.0;      // of the largest median

void include(double value, double margin, double* low, double* high) {
  *low = std::min(*low, value - margin);
  *high = std::max(*high, value + margin);
}

/// Extends a window to the finite points of a series.
void include(const Series& s, double margin, Window* window) {
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    if (!std::isfinite(s.x[i])) continue;
    include(s.x[i], margin, &window->x_low, &window->x_high);
    include(s.y[i], margin, &window->y_low, &window->y_high);
  }
}

int height_px(const Window& w) {
  const double aspect = (w.y_high - w.y_low) / (w.x_high - w.x_low);
  return static_cast<int>(std::clamp(kFrame_px + kInner_px * aspect, 240.0, 640.0));
}

/// Every point with its distance, and their mean.
/// @param max_cm  the upper end of the axis
Plot point_by_point(const std::string& title, const PlacedData& placed, double max_cm) {
  const auto n = static_cast<double>(placed.distance_m.size());
  Series dots{"", placed.colour, SeriesStyle::kDots, {}, {}, {}};
  for (std::size_t i = 0; i < placed.distance_m.size(); ++i) {
    dots.x.push_back(static_cast<double>(i) + 0.5);
    dots.y.push_back(100.0 * double{placed.distance_m[i]});
  }
  const auto above =
      std::count_if(dots.y.begin(), dots.y.end(), [max_cm](double d_cm) { return d_cm > max_cm; });
  dots.label = fmt::format("each data point; {:.0f} % are above the axis",
                           100.0 * static_cast<double>(above) / n);
  const double mean_cm = placed.mean_cm();
  Series mean{fmt::format("mean {:.1f} cm; median {:.1f} cm", mean_cm, placed.median_cm()),
              Colour::kGrey,
              SeriesStyle::kThickLine,
              {0.0, n},
              {mean_cm, mean_cm},
              {}};
  Plot plot;
  plot.title = title;
  plot.x_label = "number of the data point, in the order of the scan";
  plot.y_label = "distance [cm]";
  plot.height_px = 240;
  plot.window = Window{0.0, n, 0.0, max_cm};
  plot.series = {std::move(dots), std::move(mean)};
  return plot;
}

}  // namespace

FigurePanels::FigurePanels(std::string name, const ImageShape& image, const VehicleShape& vehicle,
                           const FigurePair& pair)
    : name_(std::move(name)), image_(image), vehicle_(vehicle), pair_(pair), view_(pair.view) {
  constexpr double kMargin_m = 0.5;
  for (const Pose& T : {Pose{}, pair.trial.guess, pair.trial.pair.T_model_data}) {
    include(vehicle_outline("", kModel, vehicle, T, Projection::kAbove), kMargin_m, &view_.above);
    include(vehicle_outline("", kModel, vehicle, T, Projection::kSide), kMargin_m, &view_.side);
  }
}

std::vector<Plot> FigurePanels::model(char letter) const {
  return scan(letter, "model M", kModel, pair_.model);
}

std::vector<Plot> FigurePanels::data(char letter) const {
  return scan(letter, "data D", kData, pair_.data);
}

std::vector<Plot> FigurePanels::scan(char letter, const char* label, Colour colour,
                                     const Points& points_ladar) const {
  const std::string what = label;
  const std::vector<Layer> one = {{label, colour, points_ladar, Pose{}}};
  Plot from_above =
      scene(title(letter, what + ", from above"), one, Projection::kAbove, view_.above);
  from_above.equal_scales = true;
  from_above.height_px = height_px(view_.above);
  Plot from_side = scene(title(letter, what + ", from the side, heights exaggerated"), one,
                         Projection::kSide, view_.side);
  from_side.height_px = 240;
  return {range_image(title(letter, what + ", as a range image"), points_ladar, image_,
                      common_limits(pair_.model, pair_.data, image_)),
          std::move(from_above), std::move(from_side)};
}

Plot FigurePanels::above(char letter, const PlacedData& placed) const {
  Plot plot = scene(title(letter, placed.name + ", from above"), layers(placed), Projection::kAbove,
                    view_.above);
  plot.equal_scales = true;
  plot.height_px = height_px(view_.above);
  return plot;
}

Plot FigurePanels::side(char letter, const PlacedData& placed) const {
  Plot plot = scene(title(letter, placed.name + ", from the side, heights exaggerated"),
                    layers(placed), Projection::kSide, view_.side);
  plot.height_px = 240;
  return plot;
}

Plot FigurePanels::detail(char letter, const PlacedData& placed) const {
  const Window& w = view_.detail;
  Plot plot = scene(title(letter, placed.name + ", from above, magnified"), layers(placed),
                    Projection::kAbove, w);
  plot.equal_scales = true;
  plot.height_px = height_px(w);
  const Points model_part = inside(w, pair_.model);
  const Points data_part = inside(w, placed.data_model);
  if (std::max(model_part.size(), data_part.size()) <= kMaxBigDots) {
    plot.series.push_back(big_dots(kModel, model_part, Projection::kAbove));
    plot.series.push_back(big_dots(kData, data_part, Projection::kAbove));
  }
  return plot;
}

std::vector<Plot> FigurePanels::distances(char letter) const {
  std::vector<const PlacedData*> all = {&pair_.before};
  for (const MethodResult& m : pair_.methods) all.push_back(&m.after);
  // Points without a counterpart in the other scan are far from it at any pose.
  double share_cm = 0.0;
  double median_cm = 0.0;
  for (const PlacedData* p : all) {
    std::vector<double> sorted(p->distance_m.begin(), p->distance_m.end());
    std::sort(sorted.begin(), sorted.end());
    share_cm = std::max(share_cm, 100.0 * tools::percentile(sorted, kShownShare));
    median_cm = std::max(median_cm, p->median_cm());
  }
  const double max_cm = std::max(0.1, std::min(share_cm, kShownMedians * median_cm));
  std::vector<Plot> plots;
  std::vector<report::NamedDistances> named;
  for (const PlacedData* p : all) {
    plots.push_back(
        point_by_point(title(letter, "closest-point distances " + p->name), *p, max_cm));
    named.push_back({p->name, p->colour, p->distance_m});
  }
  Plot histogram = report::distance_histogram(named, 0.01 * max_cm);
  histogram.title = title(letter, "histogram of these distances");
  plots.push_back(std::move(histogram));
  return plots;
}

FigurePanels::Pairs FigurePanels::pairs(char letter, const MidwaySearch& search) const {
  const Window& w = pair_.pairs_window;
  Points from[2];  // accepted, rejected
  Points to[2];
  for (std::size_t i = 0; i < search.data_model.size(); ++i) {
    const Vec3f p = search.data_model[i];
    if (!inside(w, p)) continue;
    const int kind = double{search.distance_m[i]} <= search.d_max_m ? 0 : 1;
    from[kind].push_back(p);
    to[kind].push_back(pair_.model[search.closest[i]]);
  }
  const Points model_part = inside(w, pair_.model);
  const Points data_part = inside(w, search.data_model);
  Pairs out;
  out.accepted = from[0].size();
  out.rejected = from[1].size();
  for (const Projection projection : {Projection::kAbove, Projection::kSide}) {
    const bool from_above = projection == Projection::kAbove;
    Plot plot;
    plot.title = title(letter, from_above ? "pairs of closest points, from above"
                                          : "the same pairs, from the side");
    plot.x_label = "x [m], forward";
    plot.y_label = from_above ? "y [m], to the left" : "z [m], up";
    plot.equal_scales = true;
    Series accepted = pair_lines("accepted pair", Colour::kGrey, from[0], to[0], projection);
    Series rejected = pair_lines("rejected pair", Colour::kPurple, from[1], to[1], projection);
    rejected.style = SeriesStyle::kDashed;
    // The legend shows the dots of the clouds, which the larger ones cover.
    plot.series = {std::move(accepted),
                   std::move(rejected),
                   report::cloud_dots("model M", kModel, model_part, Pose{}, projection),
                   report::cloud_dots("data D", kData, data_part, Pose{}, projection),
                   big_dots(kData, data_part, projection),
                   big_dots(kModel, model_part, projection),
                   big_dots(kModel, to[0], projection),  // also beyond the window
                   big_dots(kModel, to[1], projection)};
    Window window = w;
    if (!from_above && !data_part.empty()) {
      window.y_low = window.y_high = double{data_part.z.front()};
      for (const Points* points : {&model_part, &data_part}) {
        for (const float z : points->z) include(double{z}, 0.2, &window.y_low, &window.y_high);
      }
    }
    plot.window = window;
    plot.height_px = height_px(window);
    out.plots.push_back(std::move(plot));
  }
  return out;
}

std::string FigurePanels::title(char letter, const std::string& what) const {
  return fmt::format("{} ({}): {}", name_, letter, what);
}

std::vector<FigurePanels::Layer> FigurePanels::layers(const PlacedData& placed) const {
  return {{"model M", kModel, pair_.model, Pose{}},
          {"data D", kData, placed.data_model, placed.T_model_data}};
}

Plot FigurePanels::scene(const std::string& title, const std::vector<Layer>& layers,
                         Projection projection, const Window& window) const {
  Plot plot;
  plot.title = title;
  plot.x_label = "x [m], forward";
  plot.y_label = projection == Projection::kAbove ? "y [m], to the left" : "z [m], up";
  plot.window = window;
  for (const Layer& layer : layers) {
    plot.series.push_back(
        report::cloud_dots(layer.label, layer.colour, layer.points_picture, Pose{}, projection));
  }
  for (const Layer& layer : layers) {
    plot.series.push_back(vehicle_outline(
        layers.size() == 1 ? "vehicle" : "vehicle at " + layer.label.substr(layer.label.size() - 1),
        layer.colour, vehicle_, layer.T_picture_ladar, projection));
  }
  return plot;
}

}  // namespace rcs::studies
