#include "tools/drills/drill_stimulus.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "rcs/base/geodesy.h"

namespace rcs::drills {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Range of the returns of dust.
constexpr double kDustNear_m = 2.0;
constexpr double kDustFar_m = 6.0;

bool is_sensor(std::string_view channel) { return speaks_on(DrillSource::kAll, channel); }

/// Decodes, changes and encodes; a message that cannot be decoded is not changed.
template <class T, class Change>
bool change(SourceEvent* event, Change change_message) {
  T m{};
  const int size = static_cast<int>(event->data.size());
  if (m.decode(event->data.data(), 0, size) != size) return false;
  change_message(&m);
  const int encoded = m.getEncodedSize();
  event->data.resize(static_cast<std::size_t>(encoded));
  RCS_CHECK(m.encode(event->data.data(), 0, encoded) == encoded);
  return true;
}

void move_stamps(Duration by, SourceEvent* event) {
  const std::int64_t us = by.count();
  const auto utime = [us](auto* m) { m->utime += us; };
  const auto scan = [us](auto* m) {
    m->utime += us;
    m->reference_utime += us;
  };
  if (event->channel == channel::kIns) change<ins_t>(event, utime);
  if (event->channel == channel::kOdometry) change<odometry_t>(event, utime);
  if (event->channel == channel::kGpsFix) change<gps_fix_t>(event, utime);
  if (event->channel == channel::kLadarRanges) change<ladar_ranges_t>(event, scan);
  if (event->channel == channel::kLadarPoints) change<ladar_points_t>(event, scan);
}

void empty_facet(SourceEvent* event) {
  if (event->channel == channel::kLadarRanges) {
    change<ladar_ranges_t>(event, [](ladar_ranges_t* m) {
      m->n = 0;
      m->range_m.clear();
    });
  }
  if (event->channel == channel::kLadarPoints) {
    change<ladar_points_t>(event, [](ladar_points_t* m) {
      m->n = m->n_index = m->n_time = 0;
      for (std::vector<float>* v : {&m->x_m, &m->y_m, &m->z_m}) v->clear();
      m->row.clear();
      m->col.clear();
      m->dt_us.clear();
    });
  }
}

void raise_dust(double share, std::mt19937_64* random, SourceEvent* event) {
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  std::uniform_real_distribution<double> range_m(kDustNear_m, kDustFar_m);
  if (event->channel == channel::kLadarRanges) {
    change<ladar_ranges_t>(event, [&](ladar_ranges_t* m) {
      for (float& r : m->range_m) {
        const bool dusty = chance(*random) < share;
        const float dust_m = static_cast<float>(range_m(*random));
        if (dusty && (r <= 0.0F || dust_m < r)) r = dust_m;
      }
    });
  }
  if (event->channel == channel::kLadarPoints) {
    change<ladar_points_t>(event, [&](ladar_points_t* m) {
      for (std::size_t i = 0; i < m->x_m.size(); ++i) {
        const bool dusty = chance(*random) < share;
        const float dust_m = static_cast<float>(range_m(*random));
        const float r = std::hypot(m->x_m[i], m->y_m[i], m->z_m[i]);
        if (!dusty || !(r > dust_m)) continue;
        for (std::vector<float>* v : {&m->x_m, &m->y_m, &m->z_m}) (*v)[i] *= dust_m / r;
      }
    });
  }
}

/// Moves a fix horizontally.
void move_fix(double east_m, double north_m, gps_fix_t* fix) {
  const Geodetic g{radians(fix->lat_deg), radians(fix->lon_deg), {fix->height_m}};
  if (!plausible(g)) return;
  const Geodetic moved = LocalFrame(g).to_geodetic({east_m, north_m, 0.0});
  fix->lat_deg = degrees(moved.lat_rad);
  fix->lon_deg = degrees(moved.lon_rad);
}

double offset_at(const Stimulus& s, double since_s) {
  if (s.kind == StimulusKind::kRamp) return s.rate_mps * since_s;
  return s.decay_s > 0.0 ? s.offset_m * std::max(0.0, 1.0 - since_s / s.decay_s) : s.offset_m;
}

}  // namespace

std::vector<std::string> drive_channels() {
  std::vector<std::string> channels{channel::kSimTruth};
  channels.insert(channels.end(), channel::kSensors.begin(), channel::kSensors.end());
  return channels;
}

bool speaks_on(DrillSource source, std::string_view channel) {
  const bool ladar = channel == channel::kLadarRanges || channel == channel::kLadarPoints;
  switch (source) {
    case DrillSource::kGps:
      return channel == channel::kGpsFix;
    case DrillSource::kLadar:
      return ladar;
    case DrillSource::kIns:
      return channel == channel::kIns;
    case DrillSource::kOdometry:
      return channel == channel::kOdometry;
    case DrillSource::kAll:
      return ladar || channel == channel::kGpsFix || channel == channel::kIns ||
             channel == channel::kOdometry;
  }
  return false;
}

void change_fix(const Stimulus& s, double since_s, gps_fix_t* fix) {
  const double east = std::sin(s.bearing_rad);
  const double north = std::cos(s.bearing_rad);
  switch (s.kind) {
    case StimulusKind::kRamp:
      if (s.with_velocity) {
        fix->v_enu_mps[0] += s.rate_mps * east;
        fix->v_enu_mps[1] += s.rate_mps * north;
      }
      [[fallthrough]];
    case StimulusKind::kOffset: {
      const double m = offset_at(s, since_s);
      return move_fix(m * east, m * north, fix);
    }
    case StimulusKind::kHeight:
      fix->height_m += s.height_m;
      return;
    case StimulusKind::kSigma:
      for (double& sigma_m : fix->sigma_enu_m) sigma_m = s.sigma_m;
      return;
    case StimulusKind::kStale:
      fix->utime -= from_seconds(s.age_s).count();
      return;
    case StimulusKind::kNullIsland:
      fix->lat_deg = fix->lon_deg = fix->height_m = 0.0;
      return;
    case StimulusKind::kNan:
      fix->lat_deg = fix->lon_deg = fix->height_m = kNaN;
      for (double& v : fix->v_enu_mps) v = kNaN;
      return;
    default:
      return;
  }
}

StimulatedSource::StimulatedSource(EventSource* source, const std::vector<Stimulus>& stimuli,
                                   std::uint64_t seed)
    : source_(source) {
  for (std::size_t k = 0; k < stimuli.size(); ++k) {
    std::seed_seq sequence{seed, static_cast<std::uint64_t>(k)};
    active_.push_back({stimuli[k], std::mt19937_64(sequence), 0, {}, {}});
  }
}

Stamp StimulatedSource::peek() {
  read_ahead();
  return ready_.empty() ? Stamp::max() : ready_.begin()->first;
}

void StimulatedSource::take(SourceEvent* event) {
  read_ahead();
  RCS_CHECK(!ready_.empty());
  std::swap(*event, ready_.begin()->second);
  ready_.erase(ready_.begin());
}

// Reads on until no later message can be due before the first that is ready.
void StimulatedSource::read_ahead() {
  while (true) {
    const Stamp due = source_->peek();
    if (due == Stamp::max()) return release_held();
    if (!ready_.empty() && ready_.begin()->first < due) return;
    SourceEvent event;
    source_->take(&event);
    if (!begin_ && is_sensor(event.channel)) begin_ = due;
    pass(std::move(event), due);
  }
}

/// Messages that still wait for a successor at the end of the stream are released last.
void StimulatedSource::release_held() {
  const Stamp last = ready_.empty() ? begin_.value_or(Stamp()) : ready_.rbegin()->first;
  for (Active& a : active_) {
    if (a.held) ready_.emplace(last, std::move(*a.held));
    a.held.reset();
  }
}

void StimulatedSource::pass(SourceEvent event, Stamp due) {
  const double time_s = begin_ ? seconds(due - *begin_) : -1.0;
  std::vector<SourceEvent> after;  // released after this one
  Stamp arrival = due;
  for (Active& a : active_) {
    const Stimulus& s = a.stimulus;
    if (!s.holds(time_s) || !speaks_on(s.source, event.channel)) continue;
    const double since_s = time_s - s.begin_s;
    switch (s.kind) {
      case StimulusKind::kDropout:
        return;
      case StimulusKind::kFlapping:
        if (std::fmod(since_s, s.on_s + s.off_s) >= s.on_s) return;
        break;
      case StimulusKind::kEmptyFacets:
        if (std::uniform_real_distribution<double>(0.0, 1.0)(a.random) < s.share) {
          empty_facet(&event);
        }
        break;
      case StimulusKind::kDust:
        raise_dust(s.share, &a.random, &event);
        break;
      case StimulusKind::kClock:
        move_stamps(from_seconds(s.jump_s), &event);
        break;
      case StimulusKind::kDelay:
        arrival += from_milliseconds(s.delay_ms);
        break;
      case StimulusKind::kRepeat:
        ready_.emplace(arrival + from_milliseconds(s.delay_ms), event);
        break;
      case StimulusKind::kReorder:
        if (!a.held) {
          a.held = std::move(event);
          return;
        }
        after.push_back(std::move(*a.held));
        a.held.reset();
        break;
      case StimulusKind::kFrozen:
        change<gps_fix_t>(&event, [&a](gps_fix_t* fix) {
          if (!a.frozen) a.frozen = *fix;
          gps_fix_t again = *a.frozen;
          again.utime = fix->utime;
          again.seq = fix->seq;
          *fix = again;
        });
        break;
      default:
        if (s.kind == StimulusKind::kOffset && s.count > 0 && a.changed >= s.count) break;
        change<gps_fix_t>(&event, [&](gps_fix_t* fix) { change_fix(s, since_s, fix); });
        ++a.changed;
        break;
    }
  }
  ready_.emplace(arrival, std::move(event));
  for (SourceEvent& held : after) ready_.emplace(arrival, std::move(held));
}

}  // namespace rcs::drills
