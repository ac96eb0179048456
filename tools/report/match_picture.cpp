#include "tools/report/match_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/base/statistics.h"

namespace rcs::report {
namespace {

constexpr std::size_t kMaxDots = 8000;   // of a cloud
constexpr std::size_t kMaxHairs = 2000;  // pairs
constexpr double kStray = 0.005;         // share of the points on either side
constexpr double kDetail_m = 16.0;       // width

std::size_t stride(std::size_t size, std::size_t most) { return 1 + (size - 1) / most; }

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

/// Extends the range to a cloud at T along an axis, without its strays.
void widen(const Points& points, const Pose& T, int axis, Extent* range) {
  std::vector<double> values;
  const std::size_t step = stride(points.size(), kMaxDots);
  values.reserve(points.size() / step + 1);
  for (std::size_t i = 0; i < points.size(); i += step) {
    values.push_back((T * points[i].cast<double>())[axis]);
  }
  std::sort(values.begin(), values.end());
  range->low = std::min(range->low, tools::percentile(values, kStray));
  range->high = std::max(range->high, tools::percentile(values, 1.0 - kStray));
}

bool inside(const Window& w, double x, double y) {
  return x >= w.x_low && x <= w.x_high && y >= w.y_low && y <= w.y_high;
}

Series pairs(const Points& model, const Points& data, const Pose& T,
             const std::vector<std::uint32_t>& closest, Projection projection,
             const Window& window) {
  const int up = static_cast<int>(projection);
  Series s{"closest points", Colour::kOrange, SeriesStyle::kHair, {}, {}, {}};
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Vec3 p = T * data[i].cast<double>();
    if (inside(window, p.x(), p[up])) seen.push_back(i);
  }
  if (seen.empty()) return s;
  for (std::size_t k = 0; k < seen.size(); k += stride(seen.size(), kMaxHairs)) {
    const Vec3 p = T * data[seen[k]].cast<double>();
    const Vec3 q = model[closest[seen[k]]].cast<double>();
    for (const Vec3& end : {p, q}) {
      s.x.push_back(end.x());
      s.y.push_back(end[up]);
    }
    s.x.push_back(std::nan(""));
    s.y.push_back(std::nan(""));
  }
  return s;
}

/// Counts by bins of equal width from 0, as a staircase.
Series staircase(const std::string& label, Colour colour, const std::vector<float>& distances_m,
                 double bin_m, std::size_t bins) {
  std::vector<double> counts(bins, 0.0);
  for (const float d : distances_m) {
    const auto bin = static_cast<std::size_t>(d / bin_m);
    if (bin < bins) counts[bin] += 1.0;
  }
  Series s{label, colour, SeriesStyle::kLine, {}, {}, {}};
  for (std::size_t bin = 0; bin < bins; ++bin) {
    for (const std::size_t edge : {bin, bin + 1}) {
      s.x.push_back(100.0 * bin_m * static_cast<double>(edge));
      s.y.push_back(counts[bin]);
    }
  }
  return s;
}

}  // namespace

Series cloud_dots(const std::string& label, Colour colour, const Points& points,
                  const Pose& T_picture_cloud, Projection projection) {
  Series s{label, colour, SeriesStyle::kDots, {}, {}, {}};
  if (points.empty()) return s;
  const std::size_t step = stride(points.size(), kMaxDots);
  for (std::size_t i = 0; i < points.size(); i += step) {
    const Vec3 p = T_picture_cloud * points[i].cast<double>();
    s.x.push_back(p.x());
    s.y.push_back(p[static_cast<int>(projection)]);
  }
  return s;
}

MatchView view_of(const Points& model, const Points& data, const Pose& guess, const Pose& answer) {
  Extent range[3];
  for (int axis = 0; axis < 3; ++axis) {
    widen(model, Pose{}, axis, &range[axis]);
    widen(data, guess, axis, &range[axis]);
    widen(data, answer, axis, &range[axis]);
  }
  for (Extent& r : range) {
    const double margin = 0.03 * (r.high - r.low) + 0.1;
    r = {r.low - margin, r.high + margin};
  }
  const auto window = [&range](int up) {
    return Window{range[0].low, range[0].high, range[up].low, range[up].high};
  };
  Points at_answer;
  for (std::size_t i = 0; i < data.size(); ++i) {
    at_answer.push_back((answer * data[i].cast<double>()).cast<float>());
  }
  const auto middle = [](std::vector<float> v) {
    const auto at = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), at, v.end());
    return static_cast<double>(*at);
  };
  const double x = middle(at_answer.x);
  const double y = middle(at_answer.y);
  return {window(1),
          window(2),
          {x - 0.5 * kDetail_m, x + 0.5 * kDetail_m, y - 0.2 * kDetail_m, y + 0.2 * kDetail_m}};
}

std::string match_picture(const std::string& title, const Points& model, const Points& data,
                          const Pose& T_model_data, const std::vector<std::uint32_t>& closest,
                          const MatchView& view) {
  const auto panel = [&](const std::string& name, const char* y_label, Projection projection,
                         int height_px, const Window& window) {
    Plot plot;
    plot.title = name;
    plot.x_label = "x [m]";
    plot.y_label = y_label;
    plot.height_px = height_px;
    plot.window = window;
    plot.series = {cloud_dots("model", Colour::kGrey, model, Pose{}, projection),
                   pairs(model, data, T_model_data, closest, projection, window),
                   cloud_dots("data", Colour::kBlue, data, T_model_data, projection)};
    return plot;
  };
  const double aspect =
      (view.above.y_high - view.above.y_low) / (view.above.x_high - view.above.x_low);
  const int height_px = static_cast<int>(std::clamp(100.0 + 800.0 * aspect, 300.0, 800.0));
  Plot above = panel(title + ": from above", "y [m]", Projection::kAbove, height_px, view.above);
  above.equal_scales = true;
  const Plot side =
      panel("From the side, heights exaggerated", "z [m]", Projection::kSide, 260, view.side);
  Plot detail = panel("From above, magnified", "y [m] ", Projection::kAbove, 440, view.detail);
  detail.equal_scales = true;
  return render_stacked({above, side, detail});
}

Plot distance_histogram(const std::vector<NamedDistances>& poses, double max_m) {
  constexpr std::size_t kBins = 60;
  const double bin_m = std::max(0.001, max_m / static_cast<double>(kBins));
  Plot plot;
  plot.title = "Distance of each data point to the closest model point";
  plot.x_label = "distance [cm]";
  plot.y_label = fmt::format("points per {:.2g} cm", 100.0 * bin_m);
  plot.y_from_zero = true;
  for (const NamedDistances& p : poses) {
    Series line = staircase(p.name, p.colour, p.distance_m, bin_m, kBins);
    if (poses.size() > 2) {  // their fills would hide one another
      plot.series.push_back(std::move(line));
      continue;
    }
    Series fill = line;
    fill.label.clear();
    fill.style = SeriesStyle::kBand;
    fill.y_low.assign(fill.y.size(), 0.0);
    plot.series.push_back(std::move(fill));
    plot.series.push_back(std::move(line));
  }
  return plot;
}

Plot distance_histogram(const std::vector<float>& before_m, const std::vector<float>& after_m) {
  std::vector<double> all(before_m.begin(), before_m.end());
  all.insert(all.end(), after_m.begin(), after_m.end());
  std::sort(all.begin(), all.end());
  const auto named = [](const char* when, Colour colour, const std::vector<float>& distance_m) {
    const tools::Summary s = tools::summarize({distance_m.begin(), distance_m.end()});
    return NamedDistances{
        fmt::format("{}: mean {:.1f} cm, median {:.1f} cm", when, 100.0 * s.mean, 100.0 * s.p50),
        colour, distance_m};
  };
  return distance_histogram(
      {named("before", Colour::kOrange, before_m), named("after", Colour::kBlue, after_m)},
      tools::percentile(all, 0.95));
}

}  // namespace rcs::report
