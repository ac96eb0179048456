#include "tools/drills/random_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rcs/base/check.h"

namespace rcs::drills {
namespace {

constexpr double kRun_s = 115.0;
// Begin of a fault: the filter is aligned, and sub-filters exist.
constexpr double kFirst_s = 30.0;
constexpr double kLast_s = 45.0;
// Length of a fault. A silence is at most kSilence_s long.
constexpr double kShortest_s = 2.0;
constexpr double kLongest_s = 40.0;
constexpr double kShortestSilence_s = 0.1;
constexpr double kSilence_s = 5.0;
// A second fault begins within this time after the first.
constexpr double kSecond_s = 10.0;
// GPS, where it is denied, is lost this long before the first fault and returns after the last one.
constexpr double kLostBefore_s = 5.0;
constexpr double kLostAfter_s = 5.0;

class Draw {
 public:
  Draw(std::uint64_t seed, std::uint64_t index) {
    std::seed_seq sequence{seed, index};
    random_.seed(sequence);
  }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double log_uniform(double low, double high) {
    return std::exp(uniform(std::log(low), std::log(high)));
  }
  bool coin() { return uniform(0.0, 1.0) < 0.5; }
  double sign() { return coin() ? 1.0 : -1.0; }
  std::size_t one_of(std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_);
  }
  /// A vector of this length, along one axis.
  Vec3 along_an_axis(double length) {
    return length * sign() * Vec3::Unit(static_cast<Eigen::Index>(one_of(3)));
  }
  /// A factor that differs from 1 by between `low` and `high`.
  double factor(double low, double high) {
    return std::max(0.0, 1.0 + sign() * log_uniform(low, high));
  }

 private:
  std::mt19937_64 random_;
};

struct Row {
  FaultClass fault;
  StimulusKind kind;
  void (*draw)(Draw*, Stimulus*);
};

void nothing(Draw* /*draw*/, Stimulus* /*s*/) {}

void draw_silence(Draw* draw, Stimulus* s) {
  s->length_s = draw->log_uniform(kShortestSilence_s, kSilence_s);
}

void draw_clock(Draw* draw, Stimulus* s) {
  s->jump_s = draw->sign() * draw->log_uniform(0.02, 3.0);
}

void draw_delay(Draw* draw, Stimulus* s) { s->delay_ms = draw->log_uniform(20.0, 400.0); }

template <int kRise_s>
void draw_gyro(Draw* draw, Stimulus* s) {
  s->gyro_radps = draw->along_an_axis(radians(draw->log_uniform(0.02, 3.0)));
  s->rise_s = kRise_s;
}

template <int kRise_s>
void draw_accel(Draw* draw, Stimulus* s) {
  s->accel_mps2 = draw->along_an_axis(draw->log_uniform(0.05, 2.0));
  s->rise_s = kRise_s;
}

void draw_axes(Draw* draw, Stimulus* s) {
  const std::size_t i = draw->one_of(3);
  const std::size_t j = draw->one_of(3);
  if (i == j) {
    s->axes[i] = -s->axes[i];
  } else {
    std::swap(s->axes[i], s->axes[j]);
  }
}

void draw_ramp(Draw* draw, Stimulus* s) {
  s->rate_mps = draw->log_uniform(0.2, 5.0);
  s->bearing_rad = draw->uniform(0.0, radians(360.0));
  s->with_velocity = draw->coin();
}

void draw_offset(Draw* draw, Stimulus* s) {
  s->offset_m = draw->log_uniform(2.0, 100.0);
  s->bearing_rad = draw->uniform(0.0, radians(360.0));
}

const std::vector<Row>& rows() {
  using K = StimulusKind;
  using S = DrillSource;
  static const std::vector<Row> all = {
      {{S::kIns, "ins silence", "0.1 to 5 s"}, K::kDropout, draw_silence},
      {{S::kIns, "ins frozen", "the same increments"}, K::kFrozen, nothing},
      {{S::kIns, "ins zero", "all increments 0"}, K::kZero, nothing},
      {{S::kIns, "gyro bias", "step of 0.02 to 3 deg/s on one axis"}, K::kBias, draw_gyro<0>},
      {{S::kIns, "gyro ramp", "the same, reached in 20 s"}, K::kBias, draw_gyro<20>},
      {{S::kIns, "accel bias", "step of 0.05 to 2 m/s^2 on one axis"}, K::kBias, draw_accel<0>},
      {{S::kIns, "accel ramp", "the same, reached in 20 s"}, K::kBias, draw_accel<20>},
      {{S::kIns, "ins scale", "rates and forces, each with 50 %, off by 2 to 50 %"},
       K::kScale,
       [](Draw* draw, Stimulus* s) {
         const bool gyro = draw->coin();
         (gyro ? s->gyro_factor : s->accel_factor) = draw->factor(0.02, 0.5);
       }},
      {{S::kIns, "ins noise", "0.1 to 3 deg/s and 0.1 to 3 m/s^2 a sample"},
       K::kNoise,
       [](Draw* draw, Stimulus* s) {
         s->gyro_radps.setConstant(radians(draw->log_uniform(0.1, 3.0)));
         s->accel_mps2.setConstant(draw->log_uniform(0.1, 3.0));
       }},
      {{S::kIns, "ins saturation", "rates of 3 to 20 deg/s, forces of 10 to 12 m/s^2"},
       K::kSaturate,
       [](Draw* draw, Stimulus* s) {
         s->gyro_radps.setConstant(radians(draw->log_uniform(3.0, 20.0)));
         s->accel_mps2.setConstant(draw->uniform(10.0, 12.0));
       }},
      {{S::kIns, "ins axes", "two exchanged or one inverted"}, K::kAxes, draw_axes},
      {{S::kIns, "ins delay", "20 to 400 ms"}, K::kDelay, draw_delay},
      {{S::kIns, "ins clock", "stamps off by 0.02 to 3 s"}, K::kClock, draw_clock},
      {{S::kIns, "ins repeated", "every message again after 20 to 400 ms"}, K::kRepeat, draw_delay},
      {{S::kIns, "ins disorder", "every second message after its successor"}, K::kReorder, nothing},

      {{S::kGps, "gps offset", "2 to 100 m"}, K::kOffset, draw_offset},
      {{S::kGps, "gps ramp", "0.2 to 5 m/s, with or without velocity"}, K::kRamp, draw_ramp},
      {{S::kGps, "gps height", "2 to 50 m"},
       K::kHeight,
       [](Draw* draw, Stimulus* s) { s->height_m = draw->sign() * draw->log_uniform(2.0, 50.0); }},
      {{S::kGps, "gps frozen", "the same fix with new stamps"}, K::kFrozen, nothing},
      {{S::kGps, "gps noise", "1 to 10 m on each axis"},
       K::kNoise,
       [](Draw* draw, Stimulus* s) { s->position_m = draw->log_uniform(1.0, 10.0); }},
      {{S::kGps, "gps stale", "0.2 to 3 s old"},
       K::kStale,
       [](Draw* draw, Stimulus* s) { s->age_s = draw->log_uniform(0.2, 3.0); }},
      {{S::kGps, "gps clock", "stamps off by 0.02 to 3 s"}, K::kClock, draw_clock},
      {{S::kGps, "gps delay", "20 to 400 ms"}, K::kDelay, draw_delay},

      {{S::kLadar, "ladar silence", "0.1 to 5 s"}, K::kDropout, draw_silence},
      {{S::kLadar, "ladar frozen", "the same scan with new stamps"}, K::kFrozen, nothing},
      {{S::kLadar, "range scale", "off by 1 to 10 %"},
       K::kScale,
       [](Draw* draw, Stimulus* s) { s->factor = draw->factor(0.01, 0.1); }},
      {{S::kLadar, "range bias", "0.05 to 1 m"},
       K::kBias,
       [](Draw* draw, Stimulus* s) { s->range_m = draw->sign() * draw->log_uniform(0.05, 1.0); }},
      {{S::kLadar, "range noise", "0.1 to 1 m"},
       K::kNoise,
       [](Draw* draw, Stimulus* s) { s->range_m = draw->log_uniform(0.1, 1.0); }},
      {{S::kLadar, "mount tilt", "0.3 to 5 deg"},
       K::kMount,
       [](Draw* draw, Stimulus* s) {
         s->tilt_rad = draw->sign() * radians(draw->log_uniform(0.3, 5.0));
       }},
      {{S::kLadar, "mount pan", "0.3 to 5 deg"},
       K::kMount,
       [](Draw* draw, Stimulus* s) {
         s->pan_rad = draw->sign() * radians(draw->log_uniform(0.3, 5.0));
       }},
      {{S::kLadar, "ladar dust", "in 10 to 90 % of the cells"},
       K::kDust,
       [](Draw* draw, Stimulus* s) { s->share = draw->uniform(0.1, 0.9); }},
      {{S::kLadar, "ladar clock", "stamps off by 0.02 to 3 s"}, K::kClock, draw_clock},
      {{S::kLadar, "ladar delay", "20 to 400 ms"}, K::kDelay, draw_delay},

      {{S::kOdometry, "wheels silence", "0.1 to 5 s"}, K::kDropout, draw_silence},
      {{S::kOdometry, "wheels frozen", "the same speed"}, K::kFrozen, nothing},
      {{S::kOdometry, "wheels zero", "speed and yaw rate 0"}, K::kZero, nothing},
      {{S::kOdometry, "wheels scale", "off by 5 to 80 %"},
       K::kScale,
       [](Draw* draw, Stimulus* s) { s->factor = draw->factor(0.05, 0.8); }},
      {{S::kOdometry, "wheels bias", "0.2 to 5 m/s, 1 to 10 deg/s"},
       K::kBias,
       [](Draw* draw, Stimulus* s) {
         s->speed_mps = draw->sign() * draw->log_uniform(0.2, 5.0);
         s->yaw_rate_radps = draw->sign() * radians(draw->log_uniform(1.0, 10.0));
       }},
      {{S::kOdometry, "wheels noise", "0.3 to 5 m/s"},
       K::kNoise,
       [](Draw* draw, Stimulus* s) { s->speed_mps = draw->log_uniform(0.3, 5.0); }},
      {{S::kOdometry, "wheels clock", "stamps off by 0.02 to 3 s"}, K::kClock, draw_clock},
      {{S::kOdometry, "wheels delay", "20 to 400 ms"}, K::kDelay, draw_delay},

      {{DrillSource::kAll, "all silent", "0.1 to 5 s"}, K::kDropout, draw_silence},
      {{DrillSource::kAll, "all clocks", "stamps off by 0.02 to 3 s"}, K::kClock, draw_clock},
  };
  return all;
}

Stimulus stimulus_of(const Row& row, double begin_s, Draw* draw) {
  Stimulus s;
  s.kind = row.kind;
  s.source = row.fault.source;
  s.begin_s = begin_s;
  s.length_s = draw->log_uniform(kShortest_s, kLongest_s);
  row.draw(draw, &s);
  return s;
}

}  // namespace

const std::vector<FaultClass>& fault_classes() {
  static const std::vector<FaultClass> classes = [] {
    std::vector<FaultClass> of_rows;
    for (const Row& row : rows()) of_rows.push_back(row.fault);
    return of_rows;
  }();
  return classes;
}

std::vector<std::size_t> selected_classes(const std::vector<std::string>& only) {
  std::vector<std::size_t> selected;
  const std::vector<FaultClass>& all = fault_classes();
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto names = [&](const std::string& name) {
      return name == all[k].name || name == source_name(all[k].source);
    };
    if (only.empty() || std::any_of(only.begin(), only.end(), names)) selected.push_back(k);
  }
  return selected;
}

RandomFault random_fault(const RandomFaultPlan& plan, int index) {
  const std::vector<std::size_t> selected = selected_classes(plan.only);
  RCS_CHECK(!plan.scenarios.empty() && !selected.empty() && index >= 0);
  const auto at = static_cast<std::size_t>(index);
  // Neighbours share a scene, and every class visits every scenario.
  const std::size_t scene = at / static_cast<std::size_t>(plan.runs_of_a_scene);
  Draw draw(static_cast<std::uint64_t>(plan.first_seed), at);

  RandomFault f;
  f.seed = plan.first_seed + static_cast<std::int64_t>(scene);
  f.drill.id = fmt::format("f{:04}", index);
  f.drill.needs_simulator = true;
  f.drill.run.length_s = kRun_s;
  f.drill.run.scenario = plan.scenarios[scene % plan.scenarios.size()];
  double begin_s = draw.uniform(kFirst_s, kLast_s);
  double first_s = begin_s;
  double last_s = begin_s;
  bool of_gps = false;
  for (int k = 0; k < plan.faults; ++k) {
    std::size_t chosen = selected[at % selected.size()];
    const auto taken = [&](std::size_t c) {
      return std::any_of(f.classes.begin(), f.classes.end(), [c](std::size_t o) {
        return rows()[o].fault.source == rows()[c].fault.source;
      });
    };
    while (k > 0 && taken(chosen)) chosen = selected[draw.one_of(selected.size())];
    f.classes.push_back(chosen);
    const Row& row = rows()[chosen];
    f.drill.stimuli.push_back(stimulus_of(row, begin_s, &draw));
    first_s = std::min(first_s, begin_s);
    last_s = std::max(last_s, f.drill.stimuli.back().end_s());
    of_gps = of_gps || row.fault.source == DrillSource::kGps;
    begin_s += draw.uniform(0.0, kSecond_s);
  }
  f.gps_lost = !of_gps && draw.coin();
  if (f.gps_lost) {
    f.drill.stimuli.push_back(dropout(DrillSource::kGps, first_s - kLostBefore_s,
                                      last_s + kLostAfter_s - first_s + kLostBefore_s));
  }
  for (std::size_t k = 0; k < f.classes.size(); ++k) {
    f.drill.name += (k == 0 ? "" : ", ") + describe(f.drill.stimuli[k]);
  }
  return f;
}

}  // namespace rcs::drills
