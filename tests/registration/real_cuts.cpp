#include "tests/registration/real_cuts.h"

#include <fmt/format.h>

#include <algorithm>

#include "rcs/base/check.h"
#include "tests/replay/real_data.h"
#include "tools/base/statistics.h"

namespace rcs::test {
namespace {

double median(std::vector<double> values) { return tools::summarize(std::move(values)).p50; }

importers::Sweep sweep_of(const studies::KittiDrive& drive, int number) {
  Result<importers::Sweep> sweep = drive.sweep(number);
  RCS_CHECK(sweep.ok());
  return std::move(sweep).value();
}

}  // namespace

std::vector<studies::KittiDrive> open_drive() {
  std::vector<studies::KittiDrive> drives;
  const std::string folder = data_path(std::string(studies::kKittiDrive));
  if (folder.empty()) return drives;
  Result<studies::KittiDrive> drive = studies::KittiDrive::open(folder);
  RCS_CHECK(drive.ok());
  drives.push_back(std::move(drive).value());
  return drives;
}

std::vector<studies::ScanPair> consecutive(const std::vector<studies::ScanPair>& pairs) {
  std::vector<studies::ScanPair> out;
  for (const studies::ScanPair& pair : pairs) {
    if (pair.data == pair.model + 1) out.push_back(pair);
  }
  return out;
}

Motions motions_of(const std::vector<studies::ScanPair>& pairs) {
  Motions motions;
  for (const studies::ScanPair& p : pairs) motions[{p.model, p.data}] = p.T_model_data;
  return motions;
}

Motions motions_of(const Registrations& registrations) {
  Motions motions;
  for (const auto& [pair, r] : registrations) motions[pair] = r.T_target_vehicle;
  return motions;
}

Registrations register_whole_sweeps(const studies::KittiDrive& drive,
                                    const std::vector<studies::ScanPair>& pairs, bool deskew) {
  std::map<int, Points> clouds;
  const auto cloud = [&](int number) -> const Points& {
    const auto known = clouds.find(number);
    if (known != clouds.end()) return known->second;
    if (!deskew) return clouds[number] = sweep_of(drive, number).points_ladar;
    Result<Points> points = drive.deskewed(number, pairs);
    RCS_CHECK(points.ok());
    return clouds[number] = std::move(points).value();
  };
  registration::CloudParams params;
  params.points = 40000;  // a reference may take longer
  Registrations registrations;
  for (const auto& [pair, guess] : motions_of(pairs)) {
    registrations[pair] =
        registration::register_clouds(cloud(pair.first), cloud(pair.second), guess, params).best;
    RCS_CHECK(registration::usable(registrations[pair].stop));
  }
  return registrations;
}

std::vector<TrialRun> run_production(const studies::ScanSet& set,
                                     const std::vector<studies::Trial>& trials, Search search) {
  const auto method = search == Search::kGlobal ? studies::match_globally : studies::match_planes;
  std::vector<TrialRun> runs;
  runs.reserve(trials.size());
  for (const studies::Trial& t : trials) {
    runs.push_back({t, method(set.scans.at(t.pair.model), set.scans.at(t.pair.data), t.guess,
                              registration::CloudParams{})});
  }
  return runs;
}

Metrics metrics_of(const std::vector<TrialRun>& runs, const Motions& truth) {
  Metrics f;
  std::vector<double> errors_m;
  std::vector<double> errors_deg;
  for (const TrialRun& run : runs) {
    const studies::ScanPair& pair = run.trial.pair;
    const studies::Offset error =
        studies::error_of(truth.at({pair.model, pair.data}), run.match.T_model_data);
    ++f.trials;
    if (studies::is_success(error)) {
      ++f.successes;
    } else {
      ++f.failures[pair.model];
      f.falsely_accepted += run.match.good ? 1 : 0;
    }
    f.refused += run.match.good ? 0 : 1;
    errors_m.push_back(error.m);
    errors_deg.push_back(degrees(error.rad));
  }
  f.median_m = median(std::move(errors_m));
  f.median_deg = median(std::move(errors_deg));
  return f;
}

std::string cpu_text(const std::vector<TrialRun>& runs) {
  if (runs.empty()) return "no trial";
  const auto median_ms = [&runs](const auto& ms_of) {
    std::vector<double> values(runs.size());
    std::transform(runs.begin(), runs.end(), values.begin(), ms_of);
    return median(std::move(values));
  };
  std::string text;
  for (std::size_t stage = 0; stage < runs.front().match.cpu_ms.size(); ++stage) {
    text += fmt::format(
        "{}{} {:.2f}", stage == 0 ? "" : " + ", runs.front().match.cpu_ms[stage].first,
        median_ms([stage](const TrialRun& run) { return run.match.cpu_ms[stage].second; }));
  }
  return text + fmt::format(" = {:.2f} ms",
                            median_ms([](const TrialRun& run) { return run.match.total_ms(); }));
}

}  // namespace rcs::test
