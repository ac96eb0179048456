#include "tools/drills/drill_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "rcs/node/params/params.h"
#include "tools/base/files.h"
#include "tools/drills/drill_limits.h"

namespace rcs::drills {
namespace {

constexpr unsigned bit(DrillSource s) { return 1U << static_cast<unsigned>(s); }
constexpr unsigned kGps = bit(DrillSource::kGps);
constexpr unsigned kLadar = bit(DrillSource::kLadar);
constexpr unsigned kIns = bit(DrillSource::kIns);
constexpr unsigned kOdometry = bit(DrillSource::kOdometry);
constexpr unsigned kAny = kGps | kLadar | kIns | kOdometry | bit(DrillSource::kAll);

struct KindName {
  StimulusKind kind;
  const char* name;
  unsigned sources;  ///< that it applies to
};
constexpr KindName kKinds[] = {{StimulusKind::kDropout, "dropout", kAny},
                               {StimulusKind::kFlapping, "flapping", kAny},
                               {StimulusKind::kOffset, "offset", kGps},
                               {StimulusKind::kRamp, "ramp", kGps},
                               {StimulusKind::kHeight, "height", kGps},
                               {StimulusKind::kSigma, "sigma", kGps},
                               {StimulusKind::kFrozen, "frozen", kAny},
                               {StimulusKind::kStale, "stale", kGps},
                               {StimulusKind::kNullIsland, "null_island", kGps},
                               {StimulusKind::kNan, "nan", kGps},
                               {StimulusKind::kEmptyFacets, "empty_facets", kLadar},
                               {StimulusKind::kDust, "dust", kLadar},
                               {StimulusKind::kClock, "clock", kAny},
                               {StimulusKind::kDelay, "delay", kAny},
                               {StimulusKind::kReorder, "reorder", kAny},
                               {StimulusKind::kRepeat, "repeat", kAny},
                               {StimulusKind::kZero, "zero", kIns | kOdometry},
                               {StimulusKind::kBias, "bias", kIns | kOdometry | kLadar},
                               {StimulusKind::kScale, "scale", kIns | kOdometry | kLadar},
                               {StimulusKind::kNoise, "noise", kGps | kLadar | kIns | kOdometry},
                               {StimulusKind::kSaturate, "saturate", kIns},
                               {StimulusKind::kAxes, "axes", kIns},
                               {StimulusKind::kMount, "mount", kLadar}};
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
  table->get_deg("bearing_deg", &s->bearing_rad, {0, 360},
                 "Direction of the offset or ramp, clockwise from north.");
}

/// A key in degrees per second of a triple in radians per second.
void read_rates(ParamTable* table, std::string_view key, Vec3* radps, const Range& range,
                std::string_view meaning) {
  Vec3 dps = Vec3::Zero();
  table->get(key, &dps, range, meaning);
  *radps = radians(1.0) * dps;
}

void read_rise(ParamTable* table, Stimulus* s) {
  table->get(
      "rise_s", &s->rise_s, {0, 1e5},
      "Bias, scale, mount: time in which the error grows linearly to its full size; 0: a step.");
}

/// Keys of bias, noise and saturate.
void read_values(ParamTable* table, Stimulus* s) {
  // A standard deviation or a limit has no sign.
  const auto range = [s](double most) {
    return Range{s->kind == StimulusKind::kBias ? -most : 0.0, most};
  };
  if (s->source == DrillSource::kIns) {
    read_rates(table, "gyro_dps", &s->gyro_radps, range(1e4),
               "INS, by axis: bias, standard deviation of the noise, or limit of the angular rate "
               "(0: none).");
    table->get("accel_mps2", &s->accel_mps2, range(1e4),
               "INS, by axis: the same of the specific force.");
  }
  if (s->source == DrillSource::kOdometry) {
    table->get("speed_mps", &s->speed_mps, range(100),
               "Odometry: bias or standard deviation of the speed.");
    table->get_deg("yaw_rate_deg", &s->yaw_rate_radps, range(360),
                   "Odometry: bias or standard deviation of the yaw rate, per second.");
  }
  if (s->source == DrillSource::kLadar) {
    table->get("range_m", &s->range_m, range(100),
               "LADAR: bias or standard deviation of the ranges.");
  }
  if (s->source == DrillSource::kGps) {
    table->get("position_m", &s->position_m, {0, 1e5},
               "GPS: standard deviation of the noise of each axis.");
  }
}

void read_axes(ParamTable* table, Stimulus* s) {
  const std::vector<std::string> names = {"x", "y", "z", "-x", "-y", "-z"};
  const char* const keys[] = {"axis_x", "axis_y", "axis_z"};
  for (std::size_t i = 0; i < 3; ++i) {
    std::string name = names[i];
    table->get(keys[i], &name, names, "INS: the axis, with its sign, that is published here.");
    const auto at = std::find(names.begin(), names.end(), name) - names.begin();
    s->axes[i] = at < 3 ? static_cast<int>(at) + 1 : 2 - static_cast<int>(at);
  }
}

/// Reads the keys of this kind; keys of other kinds are reported as unknown.
void read_strength(ParamTable* table, Stimulus* s) {
  switch (s->kind) {
    case StimulusKind::kFlapping:
      table->get("on_s", &s->on_s, {0.1, 1000}, "Flapping: time with messages in each cycle.");
      table->get("off_s", &s->off_s, {0.1, 1000}, "Flapping: time without messages in each cycle.");
      s->count = 1;
      table->get("count", &s->count, {1, 1000}, "Flapping: number of cycles of on_s and off_s.");
      s->length_s = (s->on_s + s->off_s) * s->count;
      return;
    case StimulusKind::kOffset:
      table->get("offset_m", &s->offset_m, {0, 1e5},
                 "Horizontal offset of the fixes; their height is unchanged.");
      read_bearing(table, s);
      table->get("decay_s", &s->decay_s, {0, 1e5},
                 "Time in which the offset falls linearly to zero; 0: it stays.");
      table->get("fixes", &s->count, {0, 1e6},
                 "Number of fixes with the offset; 0: all fixes of the window.");
      if (s->count > 0 && !table->has("length_s")) s->length_s = 2.0;
      return;
    case StimulusKind::kRamp:
      table->get("rate_mps", &s->rate_mps, {0, 100}, "Speed at which the fixes drift away.");
      read_bearing(table, s);
      table->get("with_velocity", &s->with_velocity,
                 "Adds the drift to the velocity of the fixes, too.");
      return;
    case StimulusKind::kHeight:
      table->get("height_m", &s->height_m, {-1000, 1000}, "Height offset of the fixes.");
      return;
    case StimulusKind::kSigma:
      s->sigma_m = 0.02;
      table->get("sigma_m", &s->sigma_m, {0.001, 1000},
                 "Standard deviation that the fixes report on all axes, whatever their error.");
      return;
    case StimulusKind::kStale:
      s->age_s = 1.0;
      table->get("age_s", &s->age_s, {0.01, 1000},
                 "Time by which the stamps of the fixes are made older.");
      return;
    case StimulusKind::kEmptyFacets:
    case StimulusKind::kDust:
      table->get("share", &s->share, {0, 1},
                 "Share of the facets that come without returns, or of the cells in which dust "
                 "returns [1].");
      return;
    case StimulusKind::kClock:
      table->get("jump_s", &s->jump_s, {-1e5, 1e5},
                 "Time by which the stamps of the source are shifted; positive: into the future.");
      return;
    case StimulusKind::kDelay:
    case StimulusKind::kRepeat:
      s->delay_ms = 200.0;
      table->get("delay_ms", &s->delay_ms, {1, 1e5},
                 "Delay of the messages, or of their repetition.");
      return;
    case StimulusKind::kBias:
      read_rise(table, s);
      read_values(table, s);
      return;
    case StimulusKind::kNoise:
    case StimulusKind::kSaturate:
      read_values(table, s);
      return;
    case StimulusKind::kScale:
      read_rise(table, s);
      if (s->source == DrillSource::kIns) {
        table->get("gyro_factor", &s->gyro_factor, {-100, 100},
                   "INS: factor of the angular rates.");
        table->get("accel_factor", &s->accel_factor, {-100, 100},
                   "INS: factor of the specific forces.");
        return;
      }
      table->get("factor", &s->factor, {-100, 100},
                 "Factor of the ranges, or of the speed and the yaw rate.");
      return;
    case StimulusKind::kAxes:
      return read_axes(table, s);
    case StimulusKind::kMount:
      read_rise(table, s);
      table->get_deg("tilt_deg", &s->tilt_rad, {-90, 90}, "Turn of the LADAR mount; positive: up.");
      table->get_deg("pan_deg", &s->pan_rad, {-180, 180},
                     "Turn of the LADAR mount; positive: to the left.");
      return;
    default:
      return;
  }
}

/// The keys of which one must be given, since the stimulus changes nothing without; empty: none.
std::string_view missing_size(const Stimulus& s) {
  const bool values = !s.gyro_radps.isZero() || !s.accel_mps2.isZero() || s.speed_mps != 0.0 ||
                      s.yaw_rate_radps != 0.0 || s.range_m != 0.0 || s.position_m != 0.0;
  switch (s.kind) {
    case StimulusKind::kOffset:
      return s.offset_m > 0.0 ? "" : "offset_m";
    case StimulusKind::kRamp:
      return s.rate_mps > 0.0 ? "" : "rate_mps";
    case StimulusKind::kHeight:
      return s.height_m != 0.0 ? "" : "height_m";
    case StimulusKind::kEmptyFacets:
    case StimulusKind::kDust:
      return s.share > 0.0 ? "" : "share";
    case StimulusKind::kClock:
      return s.jump_s != 0.0 ? "" : "jump_s";
    case StimulusKind::kBias:
    case StimulusKind::kNoise:
    case StimulusKind::kSaturate:
      if (values) return "";
      if (s.source == DrillSource::kIns) return "gyro_dps or accel_mps2";
      if (s.source == DrillSource::kOdometry) return "speed_mps or yaw_rate_deg";
      return s.source == DrillSource::kLadar ? "range_m" : "position_m";
    case StimulusKind::kScale:
      if (s.gyro_factor != 1.0 || s.accel_factor != 1.0 || s.factor != 1.0) return "";
      return s.source == DrillSource::kIns ? "gyro_factor or accel_factor" : "factor";
    case StimulusKind::kAxes:
      return s.axes != Stimulus{}.axes ? "" : "axis_x, axis_y or axis_z";
    case StimulusKind::kMount:
      return s.tilt_rad != 0.0 || s.pan_rad != 0.0 ? "" : "tilt_deg or pan_deg";
    default:
      return "";
  }
}

Stimulus read_stimulus(ParamTable table) {
  Stimulus s;
  std::vector<std::string> kinds;
  for (const KindName& k : kKinds) kinds.emplace_back(k.name);
  std::string name = kKinds[0].name;
  if (!table.has("kind")) table.fail("kind", "is missing");
  table.get("kind", &name, kinds, "What is done to the messages of the source within the window.");
  const bool known = std::find(kinds.begin(), kinds.end(), name) != kinds.end();
  const KindName& kind = known ? kind_of(name) : kKinds[0];
  s.kind = kind.kind;
  std::vector<std::string> sources;
  for (unsigned i = 0; i < std::size(kSources); ++i) {
    if ((kind.sources & (1U << i)) != 0) sources.emplace_back(kSources[i]);
  }
  std::string source = sources.front();
  table.get("source", &source, sources,
            "Sensor whose messages are changed; which are allowed depends on the kind.");
  if (std::find(sources.begin(), sources.end(), source) != sources.end()) {
    s.source = source_of(source);
  }
  table.get("begin_s", &s.begin_s, {0, 1e5},
            "Beginning of the window, from the first sensor message. By default 0.");
  if (s.kind != StimulusKind::kFlapping) {
    s.length_s = kForGood_s;
    table.get("length_s", &s.length_s, {0.01, kForGood_s},
              "Duration of the window. By default it lasts to the end of the drive.");
  }
  read_strength(&table, &s);
  return s;
}

void read_run(ParamTable table, const ParamFile& file, DrillRun* run) {
  table.get("length_s", &run->length_s, {0, 1e5},
            "Duration of the drive that is run; 0: all of it.");
  table.get(
      "scenario", &run->scenario,
      "Scenario of the simulator, relative to this file. Empty: the one of the command line.");
  if (!run->scenario.empty()) run->scenario = file.resolve(run->scenario);
  table.get("ins", &run->ins, {"", "tactical", "industrial", "consumer"},
            "INS grade of the simulator and of WM. Empty: as configured.");
  table.get("prior_map", &run->prior_map, "Gives SP the simulated a priori map of the course.");
  table.get("map_cell_m", &run->map_cell_m, {0.2, 100},
            "Cell of the simulated a priori map. Not given: as in the scenario.");
  table.get("map_shift_m", &run->map_shift_m, {-1000, 1000},
            "Error of the a priori map: shift to the east, to the north and up.");
  table.get_deg("map_turn_deg", &run->map_turn_rad, {-180, 180},
                "Error of the a priori map: rotation about the vehicle's start.");
  table.get("grant_share", &run->grant_share, {0.001, 1},
            "Share of its work units that SP is granted [1]. Smaller: as on a slower computer.");
  table.get("ladar_rows", &run->ladar_rows, {0, 1024},
            "Rows of SP's range image, for a scenario with another LADAR; 0: as configured.");
  table.get("ladar_cols", &run->ladar_cols, {0, 4096},
            "Columns of SP's range image, for a scenario with another LADAR; 0: as configured.");
}

Result<Drill> read(const ParamFile& file) {
  Drill d;
  d.id = std::filesystem::path(file.name()).stem().string();
  ParamTable root = file.root();
  d.name = d.id;
  root.get("name", &d.name, "Name of the drill in reports. By default the name of its file.");
  root.get("about", &d.about,
           "Description of the drill for reports: what happens, and why it matters.");
  std::string needs;
  root.get("needs", &needs, {"", "simulator"},
           "Requirement of the drill: the simulator, or nothing (empty), so that it also runs on a "
           "log.");
  d.needs_simulator = needs == "simulator";
  root.get("full", &d.full, "Runs the drill with --full only.");
  root.get("seeds", &d.seeds, {1, 1000}, "Number of seeds that the drill is run with.");
  root.get("seeds_full", &d.seeds_full, {1, 1000},
           "Number of seeds with --full; at least seeds are run.");
  read_run(root.table("run"), file, &d.run);
  const bool simulated = !d.run.scenario.empty() || !d.run.ins.empty() || d.run.prior_map;
  if (simulated && !d.needs_simulator) {
    root.fail("needs", "must be \"simulator\": [run] has keys that require it");
  }
  std::vector<ParamTable> tables = root.tables("stimulus");
  for (const ParamTable& table : tables) d.stimuli.push_back(read_stimulus(table));
  ParamTable limits = root.table("limits");
  for (const LimitKind& kind : kLimits) {
    if (!limits.has(kind.key)) continue;
    limits.get(kind.key, &d.limits[std::string(kind.key)], kind.range, kind.meaning);
  }
  if (Outcome finished = file.finish({}); !finished) return finished.error();
  // After the check for unknown keys: a misspelt key is the better message.
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const unsigned sources = kind_of(kind_name(d.stimuli[k].kind)).sources;
    if ((sources & (sources - 1)) != 0 && !tables[k].has("source")) {
      tables[k].fail("source", "is missing, which this kind of stimulus requires");
    }
    const std::string_view keys = missing_size(d.stimuli[k]);
    if (keys.empty()) continue;
    tables[k].fail("kind", fmt::format("changes nothing without {}", keys));
  }
  if (Outcome sized = file.finish({}); !sized) return sized.error();
  if (d.stimuli.empty() && d.limits.empty()) {
    return Error{file.name() + ": not a drill: no [[stimulus]] and no [limits]"};
  }
  return d;
}

std::string describe_values(const Stimulus& s) {
  if (s.source == DrillSource::kGps) return fmt::format(" {:g} m", s.position_m);
  if (s.source == DrillSource::kLadar) return fmt::format(" {:g} m", s.range_m);
  if (s.source == DrillSource::kOdometry) {
    return fmt::format(" {:g} m/s, {:g} deg/s", s.speed_mps, degrees(s.yaw_rate_radps));
  }
  return fmt::format(" {:.4g} deg/s, {:.4g} m/s^2", degrees(s.gyro_radps.norm()),
                     s.accel_mps2.norm());
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
    case StimulusKind::kBias:
    case StimulusKind::kNoise:
    case StimulusKind::kSaturate:
      how = describe_values(s);
      break;
    case StimulusKind::kScale:
      how = s.source == DrillSource::kIns
                ? fmt::format(" x {:g} (rates), {:g} (forces)", s.gyro_factor, s.accel_factor)
                : fmt::format(" x {:g}", s.factor);
      break;
    case StimulusKind::kMount:
      how = fmt::format(" {:g} deg tilt, {:g} deg pan", degrees(s.tilt_rad), degrees(s.pan_rad));
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
