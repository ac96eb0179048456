#include "tools/studies/figures/figure_pair.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "rcs/base/check.h"
#include "tools/base/statistics.h"
#include "tools/studies/figures/scan_picture.h"

namespace rcs::studies {
namespace {

constexpr double kDetailWidth_m = 10.0;
constexpr double kDetailHeight_m = 5.0;
constexpr double kPairsWidth_m = 4.0;
constexpr double kPairsHeight_m = 2.0;
constexpr double kSparse = 0.02;  // share of the points on either side of a window
constexpr double kMargin_m = 0.5;

/// The window of an axis, without the sparse ends of the clouds.
std::pair<double, double> dense(const std::vector<const std::vector<float>*>& coordinates) {
  std::pair<double, double> range{1e9, -1e9};
  for (const std::vector<float>* c : coordinates) {
    std::vector<double> sorted(c->begin(), c->end());
    std::sort(sorted.begin(), sorted.end());
    range.first = std::min(range.first, tools::percentile(sorted, kSparse) - kMargin_m);
    range.second = std::max(range.second, tools::percentile(sorted, 1.0 - kSparse) + kMargin_m);
  }
  return range;
}

report::MatchView view_of(const std::vector<const Points*>& clouds) {
  std::vector<const std::vector<float>*> x;
  std::vector<const std::vector<float>*> y;
  std::vector<const std::vector<float>*> z;
  for (const Points* points : clouds) {
    x.push_back(&points->x);
    y.push_back(&points->y);
    z.push_back(&points->z);
  }
  const auto [x_low, x_high] = dense(x);
  const auto [y_low, y_high] = dense(y);
  const auto [z_low, z_high] = dense(z);
  return {{x_low, x_high, y_low, y_high}, {x_low, x_high, z_low, z_high}, {}};
}

}  // namespace

double PlacedData::mean_cm() const {
  const double sum = std::accumulate(distance_m.begin(), distance_m.end(), 0.0);
  return 100.0 * sum / static_cast<double>(distance_m.size());
}

double PlacedData::median_cm() const {
  return 100.0 * tools::summarize({distance_m.begin(), distance_m.end()}).p50;
}

std::string MethodResult::text() const {
  return fmt::format(
      "{}: mean distance {:.1f} cm after {} iterations, error of the pose {:.3f} m and {:.2f} deg, "
      "{} by the check of the result",
      method, after.mean_cm(), match.iterations, error.m, degrees(error.rad), verdict());
}

FigurePair register_for_figures(const ScanSet& scans, const Trial& trial) {
  FigurePair pair;
  pair.trial = trial;
  pair.model = scans.scans.at(trial.pair.model);
  pair.data = scans.scans.at(trial.pair.data);
  RCS_CHECK(!pair.model.empty() && !pair.data.empty());
  const KdTree tree(pair.model);
  const auto place = [&](std::string name, report::Colour colour, const Pose& T_model_data) {
    return PlacedData{std::move(name), colour, T_model_data, moved(pair.data, T_model_data),
                      closest_points(tree, pair.data, T_model_data).distance_m};
  };
  const auto add = [&](const char* method, report::Colour colour, CloudMatch match) {
    const Pose T_model_data = match.T_model_data;
    pair.methods.push_back({method, std::move(match),
                            error_of(trial.pair.T_model_data, T_model_data),
                            place(fmt::format("after ({})", method), colour, T_model_data)});
  };
  pair.before = place("before", report::Colour::kOrange, trial.guess);
  add(kPaperMethod, report::Colour::kBlue,
      match_as_in_paper(pair.model, pair.data, trial.guess, registration::PaperParams{}));
  add(kPlaneMethod, report::Colour::kGreen,
      match_planes(pair.model, pair.data, trial.guess, registration::CloudParams{}));
  // The windows are those of the true pose, because a method may end elsewhere.
  const Points data_model = moved(pair.data, trial.pair.T_model_data);
  pair.view = view_of({&pair.model, &pair.data, &pair.before.data_model, &data_model});
  pair.view.detail = detail_window(pair.model, data_model, kDetailWidth_m, kDetailHeight_m);
  pair.pairs_window = detail_window(pair.model, data_model, kPairsWidth_m, kPairsHeight_m);
  return pair;
}

MidwaySearch search_midway(const FigurePair& pair) {
  const std::vector<registration::PaperIteration>& history =
      pair.methods.front().match.paper->history;
  MidwaySearch out;
  out.iterations = history.size();
  if (history.empty()) return out;
  out.iteration = history.size() / 2;
  // The first half of the same iterations, because the method is deterministic.
  registration::PaperParams params;
  params.max_iterations = static_cast<int>(out.iteration);
  registration::PaperResult at =
      registration::register_as_in_paper(pair.model, pair.data, pair.trial.guess, params);
  out.d_max_m = history[out.iteration].d_max_m;
  out.data_model = moved(pair.data, at.T_model_data);
  out.closest = std::move(at.closest);
  out.distance_m = std::move(at.distance_after_m);
  return out;
}

}  // namespace rcs::studies
