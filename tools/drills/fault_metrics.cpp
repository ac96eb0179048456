#include "tools/drills/fault_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "tools/base/statistics.h"
#include "tools/drills/drill_fault_detection.h"

namespace rcs::drills {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLimit_m = 2.0;
constexpr double kShareOfDistance = 0.01;
constexpr double kWithin = 0.999;
constexpr double kEnd_s = 5.0;

/// The sources that the texts of the events of fault detection begin with.
constexpr std::pair<std::string_view, DrillSource> kNames[] = {
    {"GPS", DrillSource::kGps},
    {"LADAR", DrillSource::kLadar},
    {"INS", DrillSource::kIns},
    {"odometry", DrillSource::kOdometry}};

bool disturbs(const Stimulus& s, DrillSource source) {
  return s.source == source || s.source == DrillSource::kAll;
}

/// The faults of the run, without the loss of GPS.
std::vector<Stimulus> faults_of(const RandomFault& f) {
  return {f.drill.stimuli.begin(),
          f.drill.stimuli.begin() + static_cast<std::ptrdiff_t>(f.classes.size())};
}

/// Exclusions and readmissions, by the events.
void find_exclusions(const RandomFault& f, const DrillRecord& record, const DrillErrors& errors,
                     FaultRun* run) {
  const std::vector<Stimulus> faults = faults_of(f);
  for (const DrillEvent& e : record.events) {
    if (e.code != "fde") continue;
    const double t_s = errors.time_s(e.time);
    const std::string_view text = e.text;
    const bool excluded = text.find(" excluded") != std::string_view::npos;
    if (excluded && text.rfind("a priori map", 0) == 0) run->wrongly_excluded.emplace_back("map");
    for (const auto& [name, source] : kNames) {
      if (text.substr(0, name.size()) != name) continue;
      double begin_s = kForGood_s;
      double end_s = 0.0;
      for (const Stimulus& s : faults) {
        if (!disturbs(s, source)) continue;
        begin_s = std::min(begin_s, s.begin_s);
        end_s = std::max(end_s, s.end_s());
      }
      if (excluded && t_s < begin_s) {
        run->wrongly_excluded.emplace_back(source_name(source));
      } else if (excluded) {
        if (!run->excluded_after_s) run->excluded_after_s = t_s - begin_s;
        run->readmitted_after_s.reset();
      } else if (t_s >= begin_s) {
        run->readmitted_after_s = std::max(0.0, t_s - end_s);
      }
    }
  }
}

std::optional<double> number(const Json& json, const char* key) {
  const Json& value = json.at(key);
  return value.is_null() ? std::nullopt : std::optional<double>(value.get<double>());
}

Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(); }

std::optional<double> finite_median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return std::isfinite(*middle) ? std::optional<double>(*middle) : std::nullopt;
}

std::string percent(double share) { return fmt::format("{:.1f}", 100.0 * share); }

std::string median(const std::vector<double>& values) {
  return values.empty() ? "-" : fmt::format("{:.1f}", tools::summarize(values).p50);
}

bool outside(const FaultRun& r) {
  return !r.error.empty() || r.horizontal_max_m > r.limit_m() || r.within_horizontal < kWithin ||
         r.within_vertical < kWithin || r.missed_alerts > 0 || !r.wrongly_excluded.empty();
}

/// What the runs of one class have in common.
struct Group {
  int runs = 0, failed = 0, above_limit = 0, outside_level = 0, missed = 0, wrongly_excluded = 0;
  double with_gps_m = 0.0, without_gps_m = 0.0, vertical_m = 0.0;
  double within_horizontal = 0.0, within_vertical = 0.0;  // sums
  std::vector<double> levels_m, excluded_s, readmitted_s;

  void add(const FaultRun& r) {
    ++runs;
    if (!r.error.empty()) {
      ++failed;
      return;
    }
    double& largest_m = r.gps_lost ? without_gps_m : with_gps_m;
    largest_m = std::max(largest_m, r.horizontal_max_m);
    vertical_m = std::max(vertical_m, r.vertical_max_m);
    above_limit += r.horizontal_max_m > r.limit_m() ? 1 : 0;
    outside_level += std::min(r.within_horizontal, r.within_vertical) < kWithin ? 1 : 0;
    missed += r.missed_alerts;
    wrongly_excluded += r.wrongly_excluded.empty() ? 0 : 1;
    within_horizontal += r.within_horizontal;
    within_vertical += r.within_vertical;
    if (r.level_horizontal_m) levels_m.push_back(*r.level_horizontal_m);
    if (r.excluded_after_s) excluded_s.push_back(*r.excluded_after_s);
    if (r.readmitted_after_s) readmitted_s.push_back(*r.readmitted_after_s);
  }
  [[nodiscard]] double share(double sum) const {
    return runs > failed ? sum / (runs - failed) : 1.0;
  }
};

}  // namespace

double FaultRun::limit_m() const {
  return gps_lost ? std::max(kLimit_m, kShareOfDistance * driven_m) : kLimit_m;
}

FaultRun fault_run(const RandomFault& fault, int index, const DrillRecord& record) {
  const DrillErrors errors(record);
  FaultRun run;
  run.index = index;
  run.seed = fault.seed;
  run.scenario = std::filesystem::path(fault.drill.run.scenario).stem().string();
  for (std::size_t c : fault.classes) run.faults.emplace_back(fault_classes()[c].name);
  run.description = fault.drill.name;
  run.gps_lost = fault.gps_lost;
  run.hash = record.hash;
  run.begin_s = kForGood_s;
  for (const Stimulus& s : faults_of(fault)) {
    run.begin_s = std::min(run.begin_s, s.begin_s);
    run.end_s = std::max(run.end_s, s.end_s());
  }
  const double last_s = errors.time_s(record.end);
  double worst_s = run.begin_s;
  for (const DrillError& e : errors.sampled()) {
    if (e.t_s < run.begin_s) continue;
    if (e.horizontal_m() > run.horizontal_max_m) worst_s = e.t_s;
    run.horizontal_max_m = std::max(run.horizontal_max_m, e.horizontal_m());
    run.vertical_max_m = std::max(run.vertical_max_m, e.vertical_m());
    if (e.t_s < last_s - kEnd_s) continue;
    run.horizontal_end_m = std::max(run.horizontal_end_m, e.horizontal_m());
    run.vertical_end_m = std::max(run.vertical_end_m, e.vertical_m());
  }
  run.driven_m = errors.driven_m(errors.stamp_at(run.begin_s), errors.stamp_at(worst_s));
  std::size_t samples = 0, horizontal = 0, vertical = 0, bounded = 0;
  std::vector<double> levels_horizontal_m, levels_vertical_m;
  for (const DrillIntegrity& i : record.integrity) {
    const std::optional<DrillError> e = errors.at(i.stamp);
    if (errors.time_s(i.stamp) < run.begin_s || !e) continue;
    ++samples;
    levels_horizontal_m.push_back(i.horizontal_m);
    levels_vertical_m.push_back(i.vertical_m);
    horizontal += e->horizontal_m() <= i.horizontal_m ? 1 : 0;
    vertical += e->vertical_m() <= i.vertical_m ? 1 : 0;
    bounded += std::isfinite(i.horizontal_m) ? 1 : 0;
  }
  if (samples > 0) {
    const auto n = static_cast<double>(samples);
    run.within_horizontal = static_cast<double>(horizontal) / n;
    run.within_vertical = static_cast<double>(vertical) / n;
    run.bounded = static_cast<double>(bounded) / n;
    run.level_horizontal_m = finite_median(&levels_horizontal_m);
    run.level_vertical_m = finite_median(&levels_vertical_m);
  }
  if (const auto integrity = integrity_metrics(fault.drill, record, errors)) {
    run.missed_alerts = integrity->missed_alerts;
  }
  run.smooth_step_m = largest_smooth_step(fault.drill, record).m;
  find_exclusions(fault, record, errors, &run);
  const std::vector<GpsReturn> returns = gps_returns(fault.drill, record, errors);
  for (const GpsReturn& r : returns) run.gps_after_s = r.accepted_after_s.value_or(kForGood_s);
  return run;
}

std::string to_json_line(const FaultRun& r) {
  const Json json = {{"index", r.index},
                     {"seed", r.seed},
                     {"scenario", r.scenario},
                     {"faults", r.faults},
                     {"description", r.description},
                     {"gps_lost", r.gps_lost},
                     {"begin_s", r.begin_s},
                     {"end_s", r.end_s},
                     {"horizontal_max_m", r.horizontal_max_m},
                     {"vertical_max_m", r.vertical_max_m},
                     {"horizontal_end_m", r.horizontal_end_m},
                     {"vertical_end_m", r.vertical_end_m},
                     {"driven_m", r.driven_m},
                     {"within_horizontal", r.within_horizontal},
                     {"within_vertical", r.within_vertical},
                     {"level_horizontal_m", optional(r.level_horizontal_m)},
                     {"level_vertical_m", optional(r.level_vertical_m)},
                     {"bounded", r.bounded},
                     {"missed_alerts", r.missed_alerts},
                     {"smooth_step_m", r.smooth_step_m},
                     {"wrongly_excluded", r.wrongly_excluded},
                     {"excluded_after_s", optional(r.excluded_after_s)},
                     {"readmitted_after_s", optional(r.readmitted_after_s)},
                     {"gps_after_s", optional(r.gps_after_s)},
                     {"hash", fmt::format("{:016x}", r.hash)},
                     {"error", r.error}};
  return json.dump();
}

Result<FaultRun> parse_json_line(const std::string& line) {
  try {
    const Json json = Json::parse(line);
    FaultRun r;
    r.index = json.at("index");
    r.seed = json.at("seed");
    r.scenario = json.at("scenario");
    r.faults = json.at("faults").get<std::vector<std::string>>();
    r.description = json.at("description");
    r.gps_lost = json.at("gps_lost");
    r.begin_s = json.at("begin_s");
    r.end_s = json.at("end_s");
    r.horizontal_max_m = json.at("horizontal_max_m");
    r.vertical_max_m = json.at("vertical_max_m");
    r.horizontal_end_m = json.at("horizontal_end_m");
    r.vertical_end_m = json.at("vertical_end_m");
    r.driven_m = json.at("driven_m");
    r.within_horizontal = json.at("within_horizontal");
    r.within_vertical = json.at("within_vertical");
    r.level_horizontal_m = number(json, "level_horizontal_m");
    r.level_vertical_m = number(json, "level_vertical_m");
    r.bounded = json.at("bounded");
    r.missed_alerts = json.at("missed_alerts");
    r.smooth_step_m = json.at("smooth_step_m");
    r.wrongly_excluded = json.at("wrongly_excluded").get<std::vector<std::string>>();
    r.excluded_after_s = number(json, "excluded_after_s");
    r.readmitted_after_s = number(json, "readmitted_after_s");
    r.gps_after_s = number(json, "gps_after_s");
    r.hash = std::stoull(json.at("hash").get<std::string>(), nullptr, 16);
    r.error = json.at("error");
    return r;
  } catch (const std::exception& e) {
    return Error{std::string("not a result of rcs faults: ") + e.what()};
  }
}

report::Table fault_table(const std::vector<FaultRun>& runs) {
  report::Table t{
      {"fault", "runs", "GPS [m]", "no GPS [m]", "height [m]", "> limit", "within %", "height %",
       "level [m]", "outside", "missed", "wrong", "excluded [s]", "back [s]"},
      {},
      "Largest horizontal error with and without GPS, largest vertical error; runs above "
      "the limit (2 m, without GPS 1 % of the distance since the fault began if that is "
      "more); mean share of the time within the protection levels, median of the horizontal "
      "level, runs below 99.9 % of the time; missed alerts; runs in which a source without a "
      "fault was excluded (wrong); medians "
      "of the time to exclusion and from the end of the fault to readmission."};
  const auto row = [&t](std::string_view name, const Group& g) {
    t.rows.push_back({std::string(name), std::to_string(g.runs),
                      fmt::format("{:.1f}", g.with_gps_m), fmt::format("{:.1f}", g.without_gps_m),
                      fmt::format("{:.1f}", g.vertical_m), std::to_string(g.above_limit + g.failed),
                      percent(g.share(g.within_horizontal)), percent(g.share(g.within_vertical)),
                      median(g.levels_m), std::to_string(g.outside_level), std::to_string(g.missed),
                      std::to_string(g.wrongly_excluded), median(g.excluded_s),
                      median(g.readmitted_s)});
  };
  for (const FaultClass& c : fault_classes()) {
    Group g;
    for (const FaultRun& r : runs) {
      if (std::find(r.faults.begin(), r.faults.end(), c.name) != r.faults.end()) g.add(r);
    }
    if (g.runs > 0) row(c.name, g);
  }
  Group all;
  for (const FaultRun& r : runs) all.add(r);
  row("all", all);
  return t;
}

report::Table violation_table(const std::vector<FaultRun>& runs, std::size_t most) {
  report::Table t{{"run", "scenario", "fault", "GPS", "error [m]", "height [m]", "within %",
                   "missed", "wrongly excluded"},
                  {},
                  ""};
  std::vector<FaultRun> worst;
  std::copy_if(runs.begin(), runs.end(), std::back_inserter(worst), outside);
  std::stable_sort(worst.begin(), worst.end(), [](const FaultRun& a, const FaultRun& b) {
    return a.horizontal_max_m / a.limit_m() > b.horizontal_max_m / b.limit_m();
  });
  for (const FaultRun& r : worst) {
    if (t.rows.size() == most) {
      t.note = fmt::format("{} further runs are not shown.", worst.size() - most);
      break;
    }
    std::string wrongly_excluded = r.error;
    for (const std::string& s : r.wrongly_excluded) {
      wrongly_excluded += (wrongly_excluded.empty() ? "" : ", ") + s;
    }
    t.rows.push_back({std::to_string(r.index), r.scenario, r.description,
                      r.gps_lost ? "lost" : "yes", fmt::format("{:.1f}", r.horizontal_max_m),
                      fmt::format("{:.1f}", r.vertical_max_m),
                      percent(std::min(r.within_horizontal, r.within_vertical)),
                      std::to_string(r.missed_alerts), wrongly_excluded});
  }
  return t;
}

Json fault_summary(const std::vector<FaultRun>& runs) {
  Group all;
  double step_m = 0.0;
  for (const FaultRun& r : runs) {
    all.add(r);
    step_m = std::max(step_m, r.smooth_step_m);
  }
  return {{"runs", all.runs},
          {"failed", all.failed},
          {"above_limit", all.above_limit},
          {"outside_level", all.outside_level},
          {"missed_alerts", all.missed},
          {"wrongly_excluded", all.wrongly_excluded},
          {"within_horizontal", all.share(all.within_horizontal)},
          {"within_vertical", all.share(all.within_vertical)},
          {"horizontal_max_m", std::max(all.with_gps_m, all.without_gps_m)},
          {"smooth_step_m", step_m}};
}

}  // namespace rcs::drills
