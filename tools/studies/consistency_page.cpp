#include "tools/studies/consistency_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "tools/report/html_page.h"

namespace rcs::studies {
namespace {

constexpr report::Colour kColours[] = {report::Colour::kBlue, report::Colour::kGreen,
                                       report::Colour::kOrange, report::Colour::kPurple,
                                       report::Colour::kGrey};
/// 95 % interval of the value for a consistent filter.
constexpr double kBand_sigma = 1.96;

using Blocks = std::vector<const ConsistencyBlock*>;

report::Colour colour_of(std::size_t block) { return kColours[block % std::size(kColours)]; }

report::Series level(std::string label, double x_low, double x_high, double y) {
  return {std::move(label),
          report::Colour::kGrey,
          report::SeriesStyle::kDashed,
          {x_low, x_high},
          {y, y},
          {}};
}

/// A horizontal bar, the `k`-th of `n` in its lane.
void add_bar(double lane, std::size_t k, std::size_t n, double from, double to, report::Series* s) {
  constexpr double kShare = 0.7;  // of the height of the lane
  const double y = lane + kShare * ((static_cast<double>(k) + 0.5) / static_cast<double>(n) - 0.5);
  const double x[] = {from, to, to};
  const double at[] = {y, y, std::numeric_limits<double>::quiet_NaN()};
  s->x.insert(s->x.end(), std::begin(x), std::end(x));
  s->y.insert(s->y.end(), std::begin(at), std::end(at));
}

/// NEES of one part over time, one line per INS grade.
report::Plot nees_plot(const ConsistencyPlan& plan, const Blocks& blocks, StatePart part) {
  report::Plot plot;
  plot.title =
      fmt::format("{}: NEES of the {}", scenario_name(blocks.front()->scenario), part_name(part));
  plot.x_label = "time [s]";
  plot.y_label = "per dof (log scale)";
  plot.height_px = 250;
  plot.log_y = true;
  const double end_s = plan.times_s.back();
  plot.shades = {{plan.outage_begin_s, end_s, "without GPS"}};
  const double dof = kPartDof * static_cast<double>(blocks.front()->runs.size());
  const ValueInterval chance = chance_of_mean(dof, kBand_sigma);
  plot.series.push_back({"consistent filter, 95 %",
                         report::Colour::kGrey,
                         report::SeriesStyle::kBand,
                         {0.0, end_s},
                         {chance.high, chance.high},
                         {chance.low, chance.low}});
  plot.series.push_back(level("limit", 0.0, end_s, kNeesLimit.low));
  plot.series.push_back(level("", 0.0, end_s, kNeesLimit.high));
  double most = 1.0;  // decades
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    report::Series s{blocks[b]->ins, colour_of(b), report::SeriesStyle::kLine, {}, {}, {}};
    for (std::size_t second = 0; second < blocks[b]->runs.front().curve.size(); ++second) {
      const PartMetrics f = metrics_at_second(*blocks[b], second, part);
      s.x.push_back(static_cast<double>(second));
      s.y.push_back(f.count == 0 ? std::numeric_limits<double>::quiet_NaN() : f.nees_per_dof);
      if (f.count > 0) most = std::max(most, std::log10(std::max(1.0, f.nees_per_dof)));
    }
    plot.series.push_back(std::move(s));
  }
  plot.window = report::Window{0.0, end_s, -1.0, most};
  return plot;
}

report::Plot inside_plot(const Blocks& blocks) {
  report::Plot plot;
  plot.title = scenario_name(blocks.front()->scenario) + ": true states inside the 95 % ellipsoid";
  plot.x_label = "share, all fixed times [%] (shaded: the limit)";
  plot.height_px = 190;
  plot.shades = {{100.0 * kInsideLimit.low, 100.0 * kInsideLimit.high, ""}};
  constexpr double kFoot = 0.0;
  plot.window = report::Window{kFoot, 100.0, -0.5, static_cast<double>(kStateParts.size()) - 0.5};
  for (const StatePart part : kStateParts) plot.y_names.emplace_back(part_name(part));
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    report::Series s{blocks[b]->ins, colour_of(b), report::SeriesStyle::kThickLine, {}, {}, {}};
    for (const StatePart part : kStateParts) {
      add_bar(static_cast<double>(part), b, blocks.size(), kFoot,
              100.0 * metrics_of_all(*blocks[b], part).inside, &s);
    }
    plot.series.push_back(std::move(s));
  }
  return plot;
}

report::Plot nis_plot(const Blocks& blocks) {
  std::set<std::string> sources;
  std::vector<Innovations> pooled;
  double most = kNisLimit.high;
  for (const ConsistencyBlock* block : blocks) {
    pooled.push_back(pooled_innovations(*block));
    for (const auto& [source, sums] : pooled.back()) {
      sources.insert(source);
      most = std::max(most, sums.mean_nis_per_dof());
    }
  }
  report::Plot plot;
  plot.title = scenario_name(blocks.front()->scenario) + ": NIS before gating";
  plot.x_label = "mean per dof (shaded: the limit)";
  plot.height_px = 110 + 32 * static_cast<int>(sources.size());
  plot.y_names.assign(sources.begin(), sources.end());
  plot.shades = {{kNisLimit.low, kNisLimit.high, ""}};
  plot.window = report::Window{0.0, 1.05 * most, -0.5, static_cast<double>(sources.size()) - 0.5};
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    report::Series s{blocks[b]->ins, colour_of(b), report::SeriesStyle::kThickLine, {}, {}, {}};
    double lane = 0.0;
    for (const std::string& source : sources) {
      const auto found = pooled[b].find(source);
      if (found != pooled[b].end()) {
        add_bar(lane, b, blocks.size(), 0.0, found->second.mean_nis_per_dof(), &s);
      }
      lane += 1.0;
    }
    plot.series.push_back(std::move(s));
  }
  return plot;
}

std::string summary(const ConsistencyReport& report) {
  std::size_t passed = 0;
  std::size_t runs = 0;
  for (const ConsistencyBlock& block : report.blocks) {
    passed += verdict_of(report.plan, block) == drills::Verdict::kPass ? 1 : 0;
    runs += block.runs.size();
  }
  return fmt::format("{} of {} blocks (scenario and INS) meet all limits: {} drives.", passed,
                     report.blocks.size(), runs);
}

}  // namespace

std::string consistency_page(const ConsistencyReport& report, const report::PageOrigin& origin) {
  report::HtmlPage page("Filter consistency", origin);
  page.verdict(report.passed(), summary(report));
  page.paragraph(limits_text());
  page.paragraph(fmt::format(
      "NEES: squared error normalized by the published covariance; per degree of freedom 1 for a "
      "consistent filter, above 1 for an overconfident one. GPS is cut at {:g} s. A value with ! "
      "violates its limit; with ? there are too few drives for a verdict (inconclusive). Lag 1: "
      "correlation of successive normalized innovations, 0 for white innovations.",
      report.plan.outage_begin_s));
  page.table(nees_table(report));
  page.table(nis_table(report));
  page.table(error_table(report));
  page.table(protection_table(report));
  std::vector<std::pair<std::string, Blocks>> by_scenario;
  for (const ConsistencyBlock& block : report.blocks) {
    if (!block.was_run()) {
      page.paragraph(block.scenario + ", " + block.ins + ": " + block.error);
      continue;
    }
    const auto known = std::find_if(by_scenario.begin(), by_scenario.end(),
                                    [&](const auto& s) { return s.first == block.scenario; });
    if (known != by_scenario.end()) {
      known->second.push_back(&block);
    } else {
      by_scenario.push_back({block.scenario, {&block}});
    }
  }
  for (const auto& [scenario, blocks] : by_scenario) {
    page.heading(scenario_name(scenario));
    for (const StatePart part : kStateParts) page.plot(nees_plot(report.plan, blocks, part));
    page.plot(inside_plot(blocks));
    page.plot(nis_plot(blocks));
  }
  return page.finish();
}

}  // namespace rcs::studies
