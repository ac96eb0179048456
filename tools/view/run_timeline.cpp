#include "tools/view/run_timeline.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <type_traits>
#include <utility>

#include "lcmtypes/channel_types.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"
#include "lcmtypes/plausible.h"
#include "tools/evaluation/top_model.h"

namespace rcs::view {
namespace {

using Json = nlohmann::ordered_json;

/// Fixes older than this no longer support the belief: an outage of GPS.
constexpr double kOutage_s = 2.5;
constexpr double kTrackPeriod_s = 0.2;
constexpr std::size_t kMaxTruths = 1000;
constexpr std::size_t kMaxSeries = 64;
constexpr double kLargest_m = 1e5;

std::optional<LocalFrame> frame_of(double lat_deg, double lon_deg, double height_m) {
  const Geodetic datum{radians(lat_deg), radians(lon_deg), EllipsoidalHeight{height_m}};
  if (!plausible(datum)) return std::nullopt;
  return LocalFrame(datum);
}

bool same_datum(const LocalFrame& frame, double lat_deg, double lon_deg, double height_m) {
  const Geodetic& d = frame.datum();
  return d.lat_rad == radians(lat_deg) && d.lon_rad == radians(lon_deg) && d.height.m == height_m;
}

/// Three decimals are enough for a plot.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

Json numbers(const Vec3& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

double sigma_of_largest_axis(const Eigen::Matrix2d& cov) {
  const double mean = 0.5 * (cov(0, 0) + cov(1, 1));
  const double half = 0.5 * (cov(0, 0) - cov(1, 1));
  return std::sqrt(std::max(0.0, mean + std::hypot(half, cov(0, 1))));
}

template <class T>
std::size_t first_after(const std::vector<T>& entries, double since_s) {
  const auto at = std::upper_bound(entries.begin(), entries.end(), since_s,
                                   [](double t, const T& entry) { return t < entry.time_s; });
  return static_cast<std::size_t>(at - entries.begin());
}

}  // namespace

void RunTimeline::add(std::string_view channel, const std::uint8_t* data, std::size_t size,
                      Duration time) {
  last_ = time;
  channel::with_type_of(channel, [&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    constexpr bool kUsed = std::is_same_v<T, nav_state_t> || std::is_same_v<T, integrity_t> ||
                           std::is_same_v<T, innovation_t> || std::is_same_v<T, registration_t> ||
                           std::is_same_v<T, gps_fix_t> || std::is_same_v<T, status_t> ||
                           std::is_same_v<T, event_t> || std::is_same_v<T, cycle_t> ||
                           std::is_same_v<T, truth_t>;
    if constexpr (kUsed) {
      T message{};
      const int bytes = static_cast<int>(size);
      if (message.decode(data, 0, bytes) != bytes) return;
      if constexpr (std::is_same_v<T, status_t>) {
        add_state(channel == channel::kMissionStatus ? "mission" : "bg", message, time);
      } else {
        add(message, time);
      }
    }
  });
}

void RunTimeline::change(const char* lane, Duration time, std::string value, std::string note) {
  std::vector<Change>& changes = lanes_[lane];
  if (!changes.empty() && changes.back().value == value) return;
  if (changes.size() >= kMaxChanges) {
    changes.erase(changes.begin(), changes.begin() + kMaxChanges / 2);
    ++thinned_;
  }
  changes.push_back({seconds(time), std::move(value), std::move(note)});
}

template <class T>
void RunTimeline::thin(std::vector<T>* points) {
  if (points->size() <= kMaxPoints) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points->size(); i += 2) (*points)[kept++] = (*points)[i];
  points->resize(kept);
  ++thinned_;
}

void RunTimeline::add(const nav_state_t& m, Duration time) {
  change("mode", time, std::string(nav_mode_name(m.mode)));
  const auto age = [&](const char* name, std::int64_t us) {
    if (us >= 0) series_[name].add(time, seconds(Duration(us)));
  };
  age("age_ins_s", m.age_ins_us);
  age("age_gps_s", m.age_gps_us);
  age("age_odometry_s", m.age_odometry_us);
  age("age_rolling_map_s", m.age_rolling_us);
  if (m.age_prior_map_us >= 0) age("age_prior_map_s", m.age_prior_map_us);
  Pose T_world_vehicle;
  if (m.pose_valid == 0 || !plausible_motion(m) ||
      !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle)) {
    return;
  }
  series_["speed_mps"].add(time, from_message(m.v_world_mps).norm());
  const Mat3 R = T_world_vehicle.rotation();
  const Mat3 cov = R * from_message(m.cov_world_pose).topLeftCorner<3, 3>() * R.transpose();
  if (m.world_valid != 0 && cov.allFinite()) {
    series_["sigma3_horizontal_m"].add(time,
                                       3.0 * sigma_of_largest_axis(cov.topLeftCorner<2, 2>()));
    series_["sigma3_vertical_m"].add(time, 3.0 * std::sqrt(std::max(0.0, cov(2, 2))));
  }
  if (m.world_valid != 0 &&
      !(world_ && same_datum(*world_, m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m))) {
    world_ = frame_of(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
  }
  newest_p_world_ = T_world_vehicle.p;
  const bool gps = m.age_gps_us >= 0 && seconds(Duration(m.age_gps_us)) < kOutage_s;
  const double t = seconds(time);
  const bool due = track_.empty() || gps != track_.back().gps ||
                   (t - track_.back().time_s >= kTrackPeriod_s &&
                    (T_world_vehicle.p - track_.back().p_world).norm() >= min_track_step_m_);
  if (due) {
    track_.push_back({t, T_world_vehicle.p, gps});
    thin(&track_);
  }
  if (truth_world_ && world_) {
    beliefs_.push_back({time, m.utime, T_world_vehicle.p});
    if (beliefs_.size() > kMaxTruths) beliefs_.pop_front();
    add_errors();
  }
}

/// Errors of the beliefs between two truths.
void RunTimeline::add_errors() {
  while (!beliefs_.empty() && !truths_.empty() && beliefs_.front().utime <= truths_.back().utime) {
    const Belief belief = beliefs_.front();
    beliefs_.pop_front();
    const auto after = std::lower_bound(
        truths_.begin(), truths_.end(), belief.utime,
        [](const Truth& truth, std::int64_t utime) { return truth.utime < utime; });
    Vec3 p_truthworld = after->p_world;
    if (after->utime != belief.utime) {
      if (after == truths_.begin()) continue;
      const Truth& before = *std::prev(after);
      const double share = static_cast<double>(belief.utime - before.utime) /
                           static_cast<double>(after->utime - before.utime);
      p_truthworld = before.p_world + share * (after->p_world - before.p_world);
    }
    const Vec3 error = belief.p_world - world_->from(*truth_world_) * p_truthworld;
    series_["error_horizontal_m"].add(belief.time, error.head<2>().norm());
    series_["error_vertical_m"].add(belief.time, std::abs(error.z()));
  }
}

void RunTimeline::add(const truth_t& m, Duration time) {
  if (!truth_world_) truth_world_ = frame_of(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
  const Vec3 p = from_message(m.p_world_vehicle_m);
  if (!truth_world_ || !within(p, kLargest_m)) return;
  if (!truths_.empty() && m.utime <= truths_.back().utime) return;
  truths_.push_back({m.utime, p});
  if (truths_.size() > kMaxTruths) truths_.pop_front();
  if (!world_) return;
  add_errors();
  const double t = seconds(time);
  const Vec3 p_world = world_->from(*truth_world_) * p;
  if (truth_track_.empty() ||
      (t - truth_track_.back().time_s >= kTrackPeriod_s &&
       (p_world - truth_track_.back().p_world).norm() >= min_track_step_m_)) {
    truth_track_.push_back({t, p_world, true});
    thin(&truth_track_);
  }
}

void RunTimeline::add(const integrity_t& m, Duration time) {
  change("ins", time, std::string(source_status_name(m.ins)));
  change("gps", time, std::string(source_status_name(m.gps)));
  change("ladar", time, std::string(source_status_name(m.ladar)));
  change("alerts", time, alert_names(m.alerts));
  if (m.validity == integrity_t::VALID_WORLD) {
    const auto bound = [&](const char* name, double value_m) {
      if (value_m < kLargest_m) series_[name].add(time, value_m);
    };
    bound("protection_horizontal_m", m.protection_horizontal_m);
    bound("protection_vertical_m", m.protection_vertical_m);
  }
  series_["limit_horizontal_m"].add(time, m.limit_horizontal_m);
  series_["limit_vertical_m"].add(time, m.limit_vertical_m);
  series_["gps_test_ratio"].add(time, m.gps_test_ratio);
  series_["ladar_test_ratio"].add(time, m.ladar_test_ratio);
}

void RunTimeline::add(const registration_t& m, Duration time) {
  if (m.target != registration_t::TARGET_ROLLING) return;
  // These two are bad where they are low.
  const auto lowest = [&](const char* name, double value) {
    series_.try_emplace(name, ValueSeries::Keep::kSmallest).first->second.add(time, value);
  };
  lowest("overlap", m.overlap);
  lowest("observability", m.observability[0]);
  series_["mean_distance_m"].add(time, m.mean_distance_m);
  series_["degrade_level"].add(time, m.degrade_level);
}

void RunTimeline::add(const innovation_t& m, Duration time) {
  if (m.source != innovation_t::SOURCE_GPS_POSITION) return;
  const auto judge = [&m](Fix* fix) {
    const bool rejected =
        m.reason == innovation_t::REASON_GATE || m.reason == innovation_t::REASON_QUARANTINE;
    fix->verdict = m.accepted != 0 ? 1 : rejected ? 0 : -1;
    fix->reason = m.reason;
    fix->nis = std::isfinite(m.nis) ? m.nis : 0.0;
  };
  for (auto fix = fixes_.rbegin(); fix != fixes_.rend() && fix->utime >= m.utime; ++fix) {
    if (fix->utime == m.utime) return judge(&*fix);
  }
  // The output of a replay has no fixes, but what WM found of them.
  const Vec3 innovation(m.innovation[0], m.innovation[1], m.innovation[2]);
  if (!newest_p_world_ || !within(innovation, kLargest_m)) return;
  Fix fix;
  fix.time_s = seconds(time);
  fix.utime = m.utime;
  fix.p_world = *newest_p_world_ + innovation;
  judge(&fix);
  fixes_.push_back(fix);
  thin(&fixes_);
}

void RunTimeline::add(const gps_fix_t& m, Duration time) {
  change("fix", time, std::string(gps_fix_name(m.fix_type)));
  if (m.fix_type == gps_fix_t::FIX_NONE) return;
  double height_m = m.height_m;
  if (m.height_kind == gps_fix_t::HEIGHT_ORTHOMETRIC && std::isfinite(m.undulation_m)) {
    height_m += m.undulation_m;
  }
  Fix fix;
  fix.time_s = seconds(time);
  fix.utime = m.utime;
  fix.position = Geodetic{radians(m.lat_deg), radians(m.lon_deg), EllipsoidalHeight{height_m}};
  if (!plausible(*fix.position)) return;
  fix.type = m.fix_type;
  const double sigma_m = std::max(m.sigma_enu_m[0], m.sigma_enu_m[1]);
  fix.sigma_m = std::isfinite(sigma_m) ? sigma_m : 0.0;
  fixes_.push_back(fix);
  thin(&fixes_);
}

void RunTimeline::add_state(const char* lane, const status_t& m, Duration time) {
  change(lane, time, evaluation::printable(m.state), evaluation::printable(m.reason));
}

void RunTimeline::add(const event_t& m, Duration time) {
  if (events_.size() >= kMaxChanges) {
    events_.erase(events_.begin(), events_.begin() + kMaxChanges / 2);
    ++thinned_;
  }
  events_.push_back({seconds(time), evaluation::printable(m.node), m.severity,
                     evaluation::printable(m.code), evaluation::printable(m.text)});
}

void RunTimeline::add(const cycle_t& m, Duration time) {
  const std::string name = "cycle_" + evaluation::printable(m.node) + "_ms";
  if (series_.count(name) == 0 && series_.size() >= kMaxSeries) return;
  series_[name].add(time, milliseconds(Duration(m.used_wall_us)));
}

int RunTimeline::generation() const {
  int sum = thinned_;
  for (const auto& [name, values] : series_) sum += values.halvings();
  return sum;
}

nlohmann::ordered_json RunTimeline::json(Duration since) const {
  const double since_s = since < Duration{} ? -1.0 : seconds(since);
  Json out = {{"generation", generation()}, {"end_s", rounded(seconds(last_))},
              {"series", Json::object()},   {"lanes", Json::object()},
              {"events", Json::array()},    {"track", Json::array()},
              {"truth", Json::array()},     {"fixes", Json::array()}};
  for (const auto& [name, values] : series_) {
    const std::vector<ValueSeries::Entry>& entries = values.entries();
    Json t = Json::array();
    Json v = Json::array();
    for (std::size_t i = first_after(entries, since_s); i < entries.size(); ++i) {
      t.push_back(rounded(entries[i].time_s));
      // Small values (observability) need their digits.
      const double value = entries[i].value;
      v.push_back(std::abs(value) < 0.1 ? value : rounded(value));
    }
    out["series"][name] = {{"t", std::move(t)}, {"v", std::move(v)}};
  }
  for (const auto& [lane, changes] : lanes_) {
    Json list = Json::array();
    for (std::size_t i = first_after(changes, since_s); i < changes.size(); ++i) {
      list.push_back({rounded(changes[i].time_s), changes[i].value, changes[i].note});
    }
    out["lanes"][lane] = std::move(list);
  }
  for (std::size_t i = first_after(events_, since_s); i < events_.size(); ++i) {
    const Event& e = events_[i];
    out["events"].push_back({{"t", rounded(e.time_s)},
                             {"node", e.node},
                             {"severity", e.severity},
                             {"code", e.code},
                             {"text", e.text}});
  }
  const auto points = [&](const char* name, const std::vector<TrackPoint>& track) {
    for (std::size_t i = first_after(track, since_s); i < track.size(); ++i) {
      out[name].push_back({rounded(track[i].time_s), rounded(track[i].p_world.x()),
                           rounded(track[i].p_world.y()), rounded(track[i].p_world.z()),
                           track[i].gps ? 1 : 0});
    }
  };
  points("track", track_);
  points("truth", truth_track_);
  // The verdict on a fix comes after the fix: the last ones are repeated.
  constexpr double kVerdict_s = 2.0;
  for (std::size_t i = first_after(fixes_, since_s - kVerdict_s); world_ && i < fixes_.size();
       ++i) {
    const Fix& f = fixes_[i];
    out["fixes"].push_back({{"t", rounded(f.time_s)},
                            {"p", numbers(f.position ? world_->to_world(*f.position) : f.p_world)},
                            {"type", f.position ? gps_fix_name(f.type) : ""},
                            {"sigma_m", rounded(f.sigma_m)},
                            {"verdict", f.verdict},
                            {"reason", innovation_reason_name(f.reason)},
                            {"nis", rounded(f.nis)}});
  }
  return out;
}

}  // namespace rcs::view
