#include "tools/drills/drill_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "rcs/node/params/params.h"
#include "tools/base/files.h"
#include "tools/drills/drill_limits.h"

namespace rcs::drills {
namespace {

struct KindName {
  StimulusKind kind;
  const char* name;
  bool gps_only;
};
constexpr KindName kKinds[] = {{StimulusKind::kDropout, "dropout", false},
                               {StimulusKind::kFlapping, "flapping", false},
                               {StimulusKind::kOffset, "offset", true},
                               {StimulusKind::kRamp, "ramp", true},
                               {StimulusKind::kHeight, "height", true},
                               {StimulusKind::kSigma, "sigma", true},
                               {StimulusKind::kFrozen, "frozen", true},
                               {StimulusKind::kStale, "stale", true},
                               {StimulusKind::kNullIsland, "null_island", true},
                               {StimulusKind::kNan, "nan", true},
                               {StimulusKind::kEmptyFacets, "empty_facets", false},
                               {StimulusKind::kDust, "dust", false},
                               {StimulusKind::kClock, "clock", false},
                               {StimulusKind::kDelay, "delay", false},
                               {StimulusKind::kReorder, "reorder", false},
                               {StimulusKind::kRepeat, "repeat", false}};
constexpr const char* kSources[] = {"gps", "ladar", "ins", "odometry", "all"};

const KindName& kind_of(std::string_view name) {
  return *std::find_if(std::begin(kKinds), std::end(kKinds),
                       [&](const KindName& k) { return k.name == name; });
}

DrillSource source_of(std::string_view name) {
  const auto* at = std::find(std::begin(kSources), std::end(kSources), name);
  return static_cast<DrillSource>(at - std::begin(kSources));
}

void read_bearing(ParamTable* table, Stimulus* s) {
  table->get_deg("bearing_deg", &s->bearing_rad, {0, 360});
}

/// What only this kind has; another kind's keys stay unknown.
void read_strength(ParamTable* table, Stimulus* s) {
  switch (s->kind) {
    case StimulusKind::kFlapping:
      table->get("on_s", &s->on_s, {0.1, 1000});
      table->get("off_s", &s->off_s, {0.1, 1000});
      s->count = 1;
      table->get("count", &s->count, {1, 1000});
      s->length_s = (s->on_s + s->off_s) * s->count;
      return;
    case StimulusKind::kOffset:
      table->get("offset_m", &s->offset_m, {0, 1e5});
      read_bearing(table, s);
      table->get("decay_s", &s->decay_s, {0, 1e5});
      table->get("fixes", &s->count, {0, 1e6});
      if (s->count > 0 && !table->has("length_s")) s->length_s = 2.0;
      return;
    case StimulusKind::kRamp:
      table->get("rate_mps", &s->rate_mps, {0, 100});
      read_bearing(table, s);
      table->get("with_velocity", &s->with_velocity);
      return;
    case StimulusKind::kHeight:
      table->get("height_m", &s->height_m, {-1000, 1000});
      return;
    case StimulusKind::kSigma:
      s->sigma_m = 0.02;
      table->get("sigma_m", &s->sigma_m, {0.001, 1000});
      return;
    case StimulusKind::kStale:
      s->age_s = 1.0;
      table->get("age_s", &s->age_s, {0.01, 1000});
      return;
    case StimulusKind::kEmptyFacets:
    case StimulusKind::kDust:
      table->get("share", &s->share, {0, 1});
      return;
    case StimulusKind::kClock:
      table->get("jump_s", &s->jump_s, {-1e5, 1e5});
      return;
    case StimulusKind::kDelay:
    case StimulusKind::kRepeat:
      s->delay_ms = 200.0;
      table->get("delay_ms", &s->delay_ms, {1, 1e5});
      return;
    default:
      return;
  }
}

Stimulus read_stimulus(ParamTable table) {
  Stimulus s;
  std::vector<std::string> kinds;
  for (const KindName& k : kKinds) kinds.emplace_back(k.name);
  std::string name = kKinds[0].name;
  if (!table.has("kind")) table.fail("kind", "is missing");
  table.get("kind", &name, kinds);
  const bool known = std::find(kinds.begin(), kinds.end(), name) != kinds.end();
  const KindName& kind = known ? kind_of(name) : kKinds[0];
  s.kind = kind.kind;
  const bool ladar = s.kind == StimulusKind::kEmptyFacets || s.kind == StimulusKind::kDust;
  const std::vector<std::string> sources =
      kind.gps_only ? std::vector<std::string>{"gps"}
      : ladar       ? std::vector<std::string>{"ladar"}
                    : std::vector<std::string>(std::begin(kSources), std::end(kSources));
  std::string source = sources.front();
  table.get("source", &source, sources);
  if (std::find(sources.begin(), sources.end(), source) != sources.end()) {
    s.source = source_of(source);
  }
  table.get("begin_s", &s.begin_s, {0, 1e5});
  if (s.kind != StimulusKind::kFlapping) {
    s.length_s = kForGood_s;
    table.get("length_s", &s.length_s, {0.01, kForGood_s});
  }
  read_strength(&table, &s);
  return s;
}

void read_run(ParamTable table, const ParamFile& file, DrillRun* run) {
  table.get("length_s", &run->length_s, {0, 1e5});
  table.get("scenario", &run->scenario);
  if (!run->scenario.empty()) run->scenario = file.resolve(run->scenario);
  table.get("ins", &run->ins, {"", "tactical", "industrial", "consumer"});
  table.get("prior_map", &run->prior_map);
  table.get("map_cell_m", &run->map_cell_m, {0.2, 100});
  table.get("map_shift_m", &run->map_shift_m, {-1000, 1000});
  table.get_deg("map_turn_deg", &run->map_turn_rad, {-180, 180});
  table.get("grant_share", &run->grant_share, {0.001, 1});
  table.get("ladar_rows", &run->ladar_rows, {0, 1024});
  table.get("ladar_cols", &run->ladar_cols, {0, 4096});
}

Result<Drill> read(const ParamFile& file) {
  Drill d;
  d.id = std::filesystem::path(file.name()).stem().string();
  ParamTable root = file.root();
  d.name = d.id;
  root.get("name", &d.name);
  root.get("about", &d.about);
  std::string needs;
  root.get("needs", &needs, {"", "simulator"});
  d.needs_simulator = needs == "simulator";
  root.get("full", &d.full);
  root.get("seeds", &d.seeds, {1, 1000});
  root.get("seeds_full", &d.seeds_full, {1, 1000});
  read_run(root.table("run"), file, &d.run);
  const bool simulated = !d.run.scenario.empty() || !d.run.ins.empty() || d.run.prior_map;
  if (simulated && !d.needs_simulator) {
    root.fail("needs", "must be \"simulator\": [run] names what only it has");
  }
  for (ParamTable table : root.tables("stimulus")) d.stimuli.push_back(read_stimulus(table));
  ParamTable marks = root.table("marks");
  for (const MarkKind& kind : kMarks) {
    if (!marks.has(kind.key)) continue;
    marks.get(kind.key, &d.marks[std::string(kind.key)], kind.range);
  }
  if (Outcome finished = file.finish({}); !finished) return finished.error();
  return d;
}

}  // namespace

Stimulus dropout(DrillSource source, double begin_s, double length_s) {
  Stimulus s;
  s.kind = StimulusKind::kDropout;
  s.source = source;
  s.begin_s = begin_s;
  s.length_s = length_s;
  return s;
}

double Drill::begin_s() const {
  constexpr double kWithout_s = 20.0;
  double first_s = stimuli.empty() ? kWithout_s : stimuli.front().begin_s;
  for (const Stimulus& s : stimuli) first_s = std::min(first_s, s.begin_s);
  return first_s;
}

double Drill::end_s() const {
  double last_s = stimuli.empty() ? kForGood_s : begin_s();
  for (const Stimulus& s : stimuli) last_s = std::max(last_s, s.end_s());
  return std::min(last_s, kForGood_s);
}

Result<Drill> load_drill(const std::string& path) {
  const Result<ParamFile> file = ParamFile::load(path);
  if (!file) return file.error();
  return read(*file);
}

Result<Drill> parse_drill(std::string_view text, const std::string& path) {
  const Result<ParamFile> file = ParamFile::parse(text, path);
  if (!file) return file.error();
  return read(*file);
}

std::string_view kind_name(StimulusKind kind) {
  return std::find_if(std::begin(kKinds), std::end(kKinds),
                      [&](const KindName& k) { return k.kind == kind; })
      ->name;
}

std::string_view source_name(DrillSource source) {
  return kSources[static_cast<std::size_t>(source)];
}

std::string describe(const Stimulus& s) {
  std::string how;
  switch (s.kind) {
    case StimulusKind::kOffset:
      how = fmt::format(" {:g} m", s.offset_m);
      break;
    case StimulusKind::kRamp:
      how = fmt::format(" {:g} m/s", s.rate_mps);
      break;
    case StimulusKind::kHeight:
      how = fmt::format(" {:g} m", s.height_m);
      break;
    case StimulusKind::kSigma:
      how = fmt::format(" {:g} m", s.sigma_m);
      break;
    case StimulusKind::kStale:
      how = fmt::format(" {:g} s", s.age_s);
      break;
    case StimulusKind::kEmptyFacets:
    case StimulusKind::kDust:
      how = fmt::format(" {:.0f} %", 100.0 * s.share);
      break;
    case StimulusKind::kClock:
      how = fmt::format(" {:+g} s", s.jump_s);
      break;
    case StimulusKind::kDelay:
    case StimulusKind::kRepeat:
      how = fmt::format(" {:g} ms", s.delay_ms);
      break;
    default:
      break;
  }
  return fmt::format("{} {}{}", source_name(s.source), kind_name(s.kind), how);
}

}  // namespace rcs::drills
