#pragma once
// A synthetic stream of sensor messages for the stimuli of drills, and synthetic records for their
// metrics.

#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "rcs/base/geodesy.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tools/drills/drill_record.h"
#include "tools/drills/drill_stimulus.h"

namespace rcs::test {

/// A message and its arrival.
struct Arrived {
  Stamp due;
  std::string channel;
  std::vector<std::uint8_t> data;

  template <class T>
  [[nodiscard]] T as() const {
    T m{};
    RCS_CHECK(m.decode(data.data(), 0, static_cast<int>(data.size())) ==
              static_cast<int>(data.size()));
    return m;
  }
  bool operator==(const Arrived& o) const {
    return due == o.due && channel == o.channel && data == o.data;
  }
};

template <class T>
void append(Stamp due, const char* channel, const T& m, std::vector<Arrived>* events) {
  Arrived event{due, channel, {}};
  event.data.resize(static_cast<std::size_t>(m.getEncodedSize()));
  RCS_CHECK(m.encode(event.data.data(), 0, m.getEncodedSize()) == m.getEncodedSize());
  events->push_back(std::move(event));
}

class Script final : public EventSource {
 public:
  explicit Script(std::vector<Arrived> events) : events_(std::move(events)) {}

  [[nodiscard]] Stamp peek() override {
    return next_ < events_.size() ? events_[next_].due : Stamp::max();
  }
  void take(SourceEvent* event) override {
    event->channel = events_[next_].channel;
    event->data = events_[next_].data;
    ++next_;
  }

 private:
  std::vector<Arrived> events_;
  std::size_t next_ = 0;
};

constexpr Stamp kBegin = Stamp(std::chrono::seconds(1000));
constexpr double kLat_deg = 40.0;
constexpr double kLon_deg = -76.0;

inline Geodetic datum() { return {radians(kLat_deg), radians(kLon_deg), {100.0}}; }

/// 20 s: INS every 0.1 s, a fix every 0.5 s at the datum, and four facets of ranges (each 10 m)
/// and four sectors of points (each at 10 m) every second.
inline std::vector<Arrived> quiet_drive() {
  std::vector<Arrived> events;
  for (int k = 0; k < 200; ++k) {
    const Stamp t = kBegin + from_seconds(0.1 * k);
    ins_t ins{};
    ins.utime = to_utime(t);
    ins.seq = k + 1;
    append(t, channel::kIns, ins, &events);
    if (k % 5 == 0) {
      gps_fix_t fix{};
      fix.utime = to_utime(t);
      fix.seq = k / 5 + 1;
      fix.lat_deg = kLat_deg;
      fix.lon_deg = kLon_deg;
      fix.height_m = 100.0;
      fix.has_velocity = 1;
      for (double& sigma_m : fix.sigma_enu_m) sigma_m = 0.3;
      append(t, channel::kGpsFix, fix, &events);
    }
    for (int facet = 0; k % 10 == 0 && facet < 4; ++facet) {
      ladar_ranges_t ranges{};
      ranges.utime = to_utime(t);
      ranges.reference_utime = to_utime(t) + 50'000;
      ranges.scan_id = k;
      ranges.facet = static_cast<std::int16_t>(facet);
      ranges.facet_count = 4;
      ranges.n = 100;
      ranges.range_m.assign(100, 10.0F);
      append(t, channel::kLadarRanges, ranges, &events);
      ladar_points_t points{};
      points.utime = to_utime(t);
      points.reference_utime = to_utime(t) + 50'000;
      points.n = points.n_time = points.n_index = 100;
      points.x_m.assign(100, 6.0F);
      points.y_m.assign(100, 8.0F);
      points.z_m.assign(100, 0.0F);
      points.row.assign(100, 1);
      points.col.assign(100, 2);
      points.dt_us.assign(100, 3);
      append(t, channel::kLadarPoints, points, &events);
    }
  }
  return events;
}

inline std::vector<Arrived> drain(EventSource* source) {
  std::vector<Arrived> out;
  SourceEvent event;
  for (Stamp due = source->peek(); due != Stamp::max(); due = source->peek()) {
    source->take(&event);
    out.push_back({due, event.channel, event.data});
  }
  return out;
}

/// Messages of the undisturbed drive that arrive under these stimuli.
inline std::vector<Arrived> stimulated(const std::vector<drills::Stimulus>& stimuli,
                                       std::uint64_t seed = 1) {
  Script script(quiet_drive());
  drills::StimulatedSource source(&script, stimuli, seed);
  return drain(&source);
}

inline std::vector<Arrived> of_channel(const std::vector<Arrived>& all, const char* channel) {
  std::vector<Arrived> some;
  for (const Arrived& a : all) {
    if (a.channel == channel) some.push_back(a);
  }
  return some;
}

inline double time_s(Stamp stamp) { return seconds(stamp - kBegin); }

/// 60 s straight east at 10 m/s: the ground truth, and beliefs at 50 Hz without error, with sigma
/// 0.1 m and 0.01 rad.
inline drills::DrillRecord right_record() {
  drills::DrillRecord r;
  r.begin = kBegin;
  r.end = kBegin + std::chrono::seconds(60);
  for (int k = 0; k <= 6000; ++k) {
    const double t_s = 0.01 * k;
    r.truth.push_back({kBegin + from_seconds(t_s), {Quat::Identity(), {10.0 * t_s, 0.0, 0.0}}});
    if (k % 2 == 1) continue;
    drills::DrillBelief b;
    b.stamp = r.truth.back().stamp;
    b.T_world_vehicle = r.truth.back().T;
    b.T_local_vehicle = b.T_world_vehicle;
    b.v_world = b.v_local = Vec3(10.0, 0.0, 0.0);
    b.cov_world_pose.diagonal() << 0.01, 0.01, 0.01, 1e-4, 1e-4, 1e-4;
    r.beliefs.push_back(b);
  }
  return r;
}

/// Moves the beliefs within a window; the local pose is unchanged.
inline void mislead(double from_s, double to_s, const Vec3& by, drills::DrillRecord* r) {
  for (drills::DrillBelief& b : r->beliefs) {
    if (time_s(b.stamp) >= from_s && time_s(b.stamp) < to_s) b.T_world_vehicle.p += by;
  }
}

}  // namespace rcs::test
