#include "tools/drills/drill_content.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

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

/// Share of the full error that has been reached.
double risen(const Stimulus& s, double since_s) {
  return s.rise_s > 0.0 ? std::min(1.0, since_s / s.rise_s) : 1.0;
}

double gaussian(double sigma, std::mt19937_64* random) {
  return sigma > 0.0 ? std::normal_distribution<double>(0.0, sigma)(*random) : 0.0;
}

void change_ins(const Stimulus& s, double share, std::mt19937_64* random, ins_t* m) {
  const double dt_s = 1e-6 * m->interval_us;
  const auto change_triple = [&](double* value, const Vec3& error, double factor) {
    const Vec3 was(value[0], value[1], value[2]);
    for (int i = 0; i < 3; ++i) {
      const int from = s.axes[static_cast<std::size_t>(i)];
      switch (s.kind) {
        case StimulusKind::kZero:
          value[i] = 0.0;
          break;
        case StimulusKind::kBias:
          value[i] += share * error[i] * dt_s;
          break;
        case StimulusKind::kScale:
          value[i] *= 1.0 + share * (factor - 1.0);
          break;
        case StimulusKind::kNoise:
          value[i] += gaussian(error[i] * dt_s, random);
          break;
        case StimulusKind::kSaturate:
          if (error[i] > 0.0) value[i] = std::clamp(value[i], -error[i] * dt_s, error[i] * dt_s);
          break;
        case StimulusKind::kAxes:
          value[i] = (from > 0 ? 1.0 : -1.0) * was[std::abs(from) - 1];
          break;
        default:
          break;
      }
    }
  };
  change_triple(m->delta_angle_rad, s.gyro_radps, s.gyro_factor);
  change_triple(m->delta_v_mps, s.accel_mps2, s.accel_factor);
}

void change_odometry(const Stimulus& s, double share, std::mt19937_64* random, odometry_t* m) {
  if (s.kind == StimulusKind::kZero) m->speed_mps = m->yaw_rate_radps = 0.0;
  if (s.kind == StimulusKind::kBias) {
    m->speed_mps += share * s.speed_mps;
    m->yaw_rate_radps += share * s.yaw_rate_radps;
  }
  if (s.kind == StimulusKind::kScale) {
    m->speed_mps *= 1.0 + share * (s.factor - 1.0);
    m->yaw_rate_radps *= 1.0 + share * (s.factor - 1.0);
  }
  if (s.kind == StimulusKind::kNoise) {
    m->speed_mps += gaussian(s.speed_mps, random);
    m->yaw_rate_radps += gaussian(s.yaw_rate_radps, random);
  }
}

/// @return the range that replaces `range_m`, a return
double change_range(const Stimulus& s, double share, std::mt19937_64* random, double range_m) {
  if (s.kind == StimulusKind::kBias) range_m += share * s.range_m;
  if (s.kind == StimulusKind::kScale) range_m *= 1.0 + share * (s.factor - 1.0);
  if (s.kind == StimulusKind::kNoise) range_m += gaussian(s.range_m, random);
  return std::max(range_m, 0.01);
}

void change_ranges(const Stimulus& s, double share, std::mt19937_64* random, ladar_ranges_t* m) {
  if (s.kind == StimulusKind::kMount) {  // the encoder does not measure the turn of the mount
    m->tilt_rad -= share * s.tilt_rad;
    m->pan_rad -= share * s.pan_rad;
    return;
  }
  for (float& r : m->range_m) {
    if (r > 0.0F) r = static_cast<float>(change_range(s, share, random, r));
  }
}

void change_points(const Stimulus& s, double share, std::mt19937_64* random, ladar_points_t* m) {
  const Mat3 turn = exp_so3(Vec3(0.0, share * s.tilt_rad, -share * s.pan_rad)).toRotationMatrix();
  for (std::size_t i = 0; i < m->x_m.size(); ++i) {
    Vec3 p(m->x_m[i], m->y_m[i], m->z_m[i]);
    const double range_m = p.norm();
    if (!(range_m > 0.0)) continue;
    if (s.kind == StimulusKind::kMount) {
      p = turn * p;
    } else {
      p *= change_range(s, share, random, range_m) / range_m;
    }
    m->x_m[i] = static_cast<float>(p.x());
    m->y_m[i] = static_cast<float>(p.y());
    m->z_m[i] = static_cast<float>(p.z());
  }
}

/// The content of the first message of the window, with the stamps and numbers of this one.
template <class T, class Identify>
void freeze(int facet, ContentState* state, SourceEvent* event, Identify identify) {
  const auto [first, is_new] = state->first.try_emplace({event->channel, facet}, event->data);
  if (is_new) return;
  T again{};
  const int size = static_cast<int>(first->second.size());
  RCS_CHECK(again.decode(first->second.data(), 0, size) == size);
  change<T>(event, [&](T* m) {
    identify(*m, &again);
    again.utime = m->utime;
    again.seq = m->seq;
    *m = again;
  });
}

void freeze(ContentState* state, SourceEvent* event) {
  const auto scan = [](const auto& m, auto* again) {
    again->reference_utime = m.reference_utime;
    again->scan_id = m.scan_id;
  };
  const auto as_is = [](const auto&, auto*) {};
  if (event->channel == channel::kIns) freeze<ins_t>(0, state, event, as_is);
  if (event->channel == channel::kOdometry) freeze<odometry_t>(0, state, event, as_is);
  if (event->channel == channel::kGpsFix) freeze<gps_fix_t>(0, state, event, as_is);
  if (event->channel == channel::kLadarRanges) {
    ladar_ranges_t m{};
    if (m.decode(event->data.data(), 0, static_cast<int>(event->data.size())) < 0) return;
    freeze<ladar_ranges_t>(m.facet, state, event, scan);
  }
  if (event->channel == channel::kLadarPoints) {
    ladar_points_t m{};
    if (m.decode(event->data.data(), 0, static_cast<int>(event->data.size())) < 0) return;
    freeze<ladar_points_t>(m.facet, state, event, scan);
  }
}

}  // namespace

bool publishes_on(DrillSource source, std::string_view channel) {
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

void change_content(const Stimulus& s, double since_s, ContentState* state, SourceEvent* event) {
  std::mt19937_64* random = &state->random;
  const double share = risen(s, since_s);
  switch (s.kind) {
    case StimulusKind::kEmptyFacets:
      if (std::uniform_real_distribution<double>(0.0, 1.0)(*random) < s.share) empty_facet(event);
      return;
    case StimulusKind::kDust:
      return raise_dust(s.share, random, event);
    case StimulusKind::kClock:
      return move_stamps(from_seconds(s.jump_s), event);
    case StimulusKind::kFrozen:
      return freeze(state, event);
    default:
      break;
  }
  if (s.kind == StimulusKind::kOffset && s.count > 0 && state->changed >= s.count) return;
  ++state->changed;
  if (event->channel == channel::kGpsFix) {
    change<gps_fix_t>(event, [&](gps_fix_t* m) {
      change_fix(s, since_s, m);
      if (s.kind != StimulusKind::kNoise) return;
      move_fix(gaussian(s.position_m, random), gaussian(s.position_m, random), m);
      m->height_m += gaussian(s.position_m, random);
    });
  }
  if (event->channel == channel::kIns) {
    change<ins_t>(event, [&](ins_t* m) { change_ins(s, share, random, m); });
  }
  if (event->channel == channel::kOdometry) {
    change<odometry_t>(event, [&](odometry_t* m) { change_odometry(s, share, random, m); });
  }
  if (event->channel == channel::kLadarRanges) {
    change<ladar_ranges_t>(event, [&](ladar_ranges_t* m) { change_ranges(s, share, random, m); });
  }
  if (event->channel == channel::kLadarPoints) {
    change<ladar_points_t>(event, [&](ladar_points_t* m) { change_points(s, share, random, m); });
  }
}

}  // namespace rcs::drills
