#include "tools/drills/drill_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "tools/drills/drill_output.h"
#include "tools/drills/drill_pictures.h"
#include "tools/report/html_page.h"

namespace rcs::drills {
namespace {

constexpr std::size_t kEventsShown = 15;

std::string summary(const std::vector<DrillResult>& results) {
  std::size_t passed = 0;
  std::size_t failed = 0;
  double simulated_s = 0.0;
  std::size_t runs = 0;
  for (const DrillResult& r : results) {
    passed += verdict_text(r) == "pass" ? 1 : 0;
    failed += r.verdict() == Verdict::kFail ? 1 : 0;
    runs += r.runs.size();
    for (const DrillRunMetrics& run : r.runs) simulated_s += run.simulated_s;
  }
  return fmt::format(
      "{} of {} drills passed, {} failed, {} inconclusive or skipped. {} runs, {:.0f} s.", passed,
      results.size(), failed, results.size() - passed - failed, runs, simulated_s);
}

std::string stimuli_text(const Drill& drill) {
  std::string text;
  for (const Stimulus& s : drill.stimuli) {
    text += text.empty() ? "Stimuli: " : "; ";
    text += describe(s);
    text += s.length_s < 5e4 ? fmt::format(" from {:g} to {:g} s", s.begin_s, s.end_s())
                             : fmt::format(" from {:g} s on", s.begin_s);
  }
  return text.empty() ? "No stimuli." : text + ".";
}

/// A repeated event is shown once.
report::Table event_table(const DrillRecord& record, const Drill& drill) {
  report::Table t{{"event", "time [s]", "node", "code"}, {}};
  std::map<std::string, std::string> last_code;
  for (const DrillEvent& e : record.events) {
    const double t_s = seconds(e.time - record.begin.value_or(Stamp()));
    if (t_s < drill.begin_s() - 1.0 || t.rows.size() >= kEventsShown) continue;
    const bool again = std::exchange(last_code[e.node], e.code) == e.code;
    if (!again) t.rows.push_back({e.text, fmt::format("{:.1f}", t_s), e.node, e.code});
  }
  return t;
}

report::Table baseline_table(const DrillResult& r) {
  report::Table t{{"baseline: WM's filter", "WM, RMS [m]", "baseline, RMS [m]", "ratio"}, {}};
  const Baselines sums = pooled_baselines(r.runs);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (sums[k].samples == 0) continue;
    t.rows.push_back({std::string(subfilter_name(static_cast<int>(k))),
                      fmt::format("{:.2f}", sums[k].fused_rms_m()),
                      fmt::format("{:.2f}", sums[k].baseline_rms_m()),
                      fmt::format("{:.2f}", sums[k].ratio())});
  }
  return t;
}

/// In the log of the shown run, which begins with it.
std::vector<report::Moment> moments_of(const DrillResult& r) {
  std::vector<report::Moment> moments;
  for (const Stimulus& s : r.drill.stimuli) {
    if (moments.size() < 4) moments.push_back({describe(s), s.begin_s});
  }
  return moments;
}

void add_drill(const DrillResult& r, const std::string& logs_folder, report::HtmlPage* page) {
  page->heading(fmt::format("{}: {}", r.drill.name, verdict_text(r)));
  if (!r.drill.about.empty()) page->paragraph(r.drill.about);
  if (!r.error.empty() || !r.skipped.empty()) {
    page->paragraph(r.error.empty() ? r.skipped : r.error);
    return;
  }
  page->paragraph(stimuli_text(r.drill));
  if (!logs_folder.empty()) {
    page->moments(logs_folder + "/" + r.drill.id + ".log", moments_of(r));
  }
  page->table(limit_table(r));
  page->table(run_table(r));
  if (const report::Table baselines = baseline_table(r); !baselines.rows.empty()) {
    page->table(baselines);
  }
  if (!r.shown) return;
  for (const report::Plot& plot : drill_error_plots(r.drill, *r.shown)) page->plot(plot);
  page->plot(drill_time_line(r.drill, *r.shown));
  if (const report::Table events = event_table(*r.shown, r.drill); !events.rows.empty()) {
    page->table(events);
  }
  page->plot(drill_course(r.drill, *r.shown));
}

}  // namespace

std::string drill_page(const std::vector<DrillResult>& results, const std::string& drive,
                       const std::string& logs_folder, const report::PageOrigin& origin) {
  report::HtmlPage page("Fault-injection tests (drills)", origin);
  const bool failed = std::any_of(results.begin(), results.end(), [](const DrillResult& r) {
    return !r.error.empty() || r.verdict() == Verdict::kFail;
  });
  const bool ran = std::any_of(results.begin(), results.end(),
                               [](const DrillResult& r) { return r.skipped.empty(); });
  page.verdict(ran && !failed, summary(results));
  page.paragraph("Drive: " + drive + ".");
  page.paragraph(
      "Each drill disturbs the sensor messages of a drive and compares the results of SP and WM "
      "with the truth. A value with ! violates its limit; with ? there were too few seeds for a "
      "verdict (inconclusive).");
  page.table(drill_table(results));
  page.paragraph(
      "Protection level: bound that the error exceeds at most at one moment in a thousand. "
      "Sub-filters: filters of WM that exclude some source since the last healthy moment. False "
      "fix: a fix with an error of more than 6 total sigma. Smooth step: step of the local pose "
      "that controllers use, beyond the motion predicted from the cycle before. Plots show the "
      "first seed; shaded: time of the stimuli.");
  for (const DrillResult& r : results) add_drill(r, logs_folder, &page);
  return page.finish();
}

}  // namespace rcs::drills
