#include "tools/recording/run_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/registration/registration.h"
#include "rcs/node/log/log_file.h"
#include "tools/base/files.h"
#include "tools/recording/message_fields.h"

namespace rcs::recording {
namespace {

/// Longer silences of WM are not bridged by interpolation.
constexpr Duration kMaxNavGap = std::chrono::milliseconds(250);

Geodetic geodetic(double lat_deg, double lon_deg, double height_m) {
  return {radians(lat_deg), radians(lon_deg), EllipsoidalHeight{height_m}};
}

double to_ms(std::int64_t us) { return static_cast<double>(us) * 1e-3; }

class Reader {
 public:
  explicit Reader(RunLog* run) : run_(run) {}

  void take(const LogEvent& event) {
    if (event.channel == channel::kSpRegistration) {
      with(event, &registration_, [this](const registration_t& m) { return add(m); });
    } else if (event.channel == channel::kWmNavState) {
      with(event, &nav_state_, [this](const nav_state_t& m) { return add(m); });
    } else if (event.channel == channel::kWmInnovation) {
      with(event, &innovation_, [this](const innovation_t& m) { return add(m); });
    } else if (event.channel == channel::kSimTruth) {
      with(event, &truth_, [this](const truth_t& m) { return add(m); });
    } else if (is_cycle_channel(event.channel)) {
      with(event, &cycle_, [this](const cycle_t& m) { return add(m); });
    }
  }

  void finish() {
    sort_unique(&run_->nav, [](const NavRecord& r) { return r.stamp; });
    sort_unique(&run_->truth, [](const tools::StampedPose& r) { return r.stamp; });
    sort_unique(&run_->scans, [](const ScanRecord& r) { return r.reference; });
  }

 private:
  static bool is_cycle_channel(const std::string& channel) {
    return channel == channel::kSpCycle || channel == channel::kWmCycle ||
           channel == channel::kBgCycle;
  }

  template <class T, class Add>
  void with(const LogEvent& event, T* message, Add add_message) {
    const int size = static_cast<int>(event.data.size());
    if (message->decode(event.data.data(), 0, size) != size || !add_message(*message)) {
      ++run_->undecodable;
    }
  }

  /// Sorts by stamp; of equal stamps keeps the last one received.
  template <class T, class StampOf>
  static void sort_unique(std::vector<T>* records, StampOf stamp_of) {
    std::stable_sort(records->begin(), records->end(),
                     [&](const T& a, const T& b) { return stamp_of(a) < stamp_of(b); });
    std::vector<T> unique;
    for (T& r : *records) {
      if (!unique.empty() && stamp_of(unique.back()) == stamp_of(r)) {
        unique.back() = std::move(r);
      } else {
        unique.push_back(std::move(r));
      }
    }
    *records = std::move(unique);
  }

  bool add(const registration_t& m) {
    if (m.target == registration_t::TARGET_PRIOR_MAP) {
      if (is_answer(m.stop)) ++run_->prior_matches;
      return true;
    }
    ScanRecord r;
    r.reference = from_utime(m.utime);
    r.scan_id = m.scan_id;
    r.map_epoch = m.map_epoch;
    r.stop = m.stop;
    r.iterations = m.iterations;
    Pose T;
    if (from_message(m.q_target_vehicle, m.p_target_vehicle_m, &T)) r.T_rolling_vehicle = T;
    run_->scans.push_back(r);
    return true;
  }

  bool add(const nav_state_t& m) {
    NavRecord r;
    r.stamp = from_utime(m.utime);
    r.world_valid = m.world_valid != 0;
    if (!from_message(m.q_local_vehicle, m.p_local_vehicle_m, &r.T_local_vehicle)) return false;
    if (!from_message(m.q_world_vehicle, m.p_world_vehicle_m, &r.T_world_vehicle)) return false;
    r.cov_world_pose = from_message(m.cov_world_pose);
    r.age_gps = Duration(m.age_gps_us);
    r.age_ins = Duration(m.age_ins_us);
    r.cause_arrival = from_utime(m.latency_trace.last_facet_utime);
    r.published = from_utime(m.publish_utime);
    if (r.world_valid) {
      run_->world_datum = geodetic(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
    }
    run_->nav.push_back(r);
    return true;
  }

  bool add(const innovation_t& m) {
    if (m.accepted != 0) run_->fused.push_back({from_utime(m.utime), m.source});
    return true;
  }

  bool add(const truth_t& m) {
    Pose T;
    if (!from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T)) return false;
    run_->truth.push_back({from_utime(m.utime), T});
    run_->truth_datum = geodetic(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
    return true;
  }

  bool add(const cycle_t& m) {
    NodeRecord& node = run_->nodes[m.node];
    CycleRecord r;
    r.late_ms = to_ms(m.late_us);
    r.wall_ms = to_ms(m.used_wall_us);
    r.slack_ms = to_ms(m.slack_us);
    for (const stage_t& s : m.stage) r.stages_ms.emplace_back(s.name, to_ms(s.wall_us));
    node.cycles.push_back(std::move(r));
    node.missed = m.missed;
    node.overruns = m.overruns;
    for (const input_account_t& in : m.input) node.lost[in.channel] = in.dropped + in.gaps;
    run_->live = true;
    return true;
  }

  RunLog* run_;
  registration_t registration_{};
  nav_state_t nav_state_{};
  innovation_t innovation_{};
  truth_t truth_{};
  cycle_t cycle_{};
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t from = 0;
  while (from <= text.size()) {
    const std::size_t to = std::min(text.find(separator, from), text.size());
    if (to > from) parts.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return parts;
}

/// The computing times of a replay: see TimingFile. Malformed lines are skipped, because the file
/// may end in the middle of a line.
void read_timing(const std::string& text, RunLog* run) {
  for (const std::string& line : split(text, '\n')) {
    const std::vector<std::string> cells = split(line, ',');
    if (cells.size() < 7 || cells[0] == "node") continue;
    const std::optional<std::vector<double>> us =
        tools::parse_numbers(cells[3] + " " + cells[4] + " " + cells[5]);
    if (!us || us->size() != 3) continue;
    NodeRecord& node = run->nodes[cells[0]];
    CycleRecord r;
    r.late_ms = (*us)[0] * 1e-3;
    r.slack_ms = (*us)[1] * 1e-3;
    r.wall_ms = (*us)[2] * 1e-3;
    if (cells.size() > 7) {
      for (const std::string& stage : split(cells[7], ' ')) {
        const std::size_t colon = stage.find(':');
        const std::optional<std::vector<double>> value =
            tools::parse_numbers(std::string_view(stage).substr(std::min(colon + 1, stage.size())));
        if (value && value->size() == 1) {
          r.stages_ms.emplace_back(stage.substr(0, colon), value->front() * 1e-3);
        }
      }
    }
    if (r.slack_ms < 0.0) ++node.overruns;
    node.cycles.push_back(std::move(r));
  }
}

std::optional<Pose> nav_pose_at(const RunLog& run, Frame frame, Stamp stamp) {
  const auto pose_of = [frame](const NavRecord& r) -> const Pose& {
    return frame == Frame::kWorld ? r.T_world_vehicle : r.T_local_vehicle;
  };
  const auto usable = [frame](const NavRecord& r) {
    return frame != Frame::kWorld || r.world_valid;
  };
  const std::vector<NavRecord>::const_iterator after =
      std::lower_bound(run.nav.begin(), run.nav.end(), stamp,
                       [](const NavRecord& r, Stamp t) { return r.stamp < t; });
  if (after == run.nav.end() || !usable(*after)) return std::nullopt;
  if (after->stamp == stamp) return pose_of(*after);
  if (after == run.nav.begin() || !usable(*(after - 1))) return std::nullopt;
  return tools::pose_at(
      {{(after - 1)->stamp, pose_of(*(after - 1))}, {after->stamp, pose_of(*after)}}, stamp,
      kMaxNavGap);
}

/// Poses of a run without scans.
Result<ScanPoses> poses_at_beliefs(const RunLog& run, Frame frame) {
  ScanPoses out;
  for (const NavRecord& nav : run.nav) {
    if (frame == Frame::kRolling || (frame == Frame::kWorld && !nav.world_valid)) continue;
    out.scan_ids.push_back(static_cast<std::int64_t>(out.scan_ids.size()));
    out.poses.push_back(
        {nav.stamp, frame == Frame::kWorld ? nav.T_world_vehicle : nav.T_local_vehicle});
  }
  if (!out.poses.empty()) return out;
  return Error{run.path + ": no registration of any scan (SP_REGISTRATION)" +
               (frame == Frame::kRolling ? "" : ", no belief in that frame (WM_NAV_STATE)") +
               "; a log of sensors only: run `rcs replay` first"};
}

}  // namespace

Result<RunLog> read_run(const std::string& path, const std::function<bool(double)>& progress) {
  Result<LogReader> reader = LogReader::open(path);
  if (!reader) return reader.error();
  RunLog run;
  run.path = path;
  Reader records(&run);
  LogEvent event;
  while (reader->next(&event)) {
    records.take(event);
    if (!progress(static_cast<double>(reader->position_bytes()) /
                  static_cast<double>(reader->size_bytes()))) {
      return Error{"interrupted"};
    }
  }
  records.finish();
  if (!reader->health().good()) run.damage = reader->health().summary();
  if (run.nodes.empty() && std::filesystem::exists(path + ".timing")) {
    const Result<std::string> timing = tools::read_text(path + ".timing");
    if (timing) read_timing(*timing, &run);
  }
  return run;
}

void cut(Duration from, Duration to, RunLog* run) {
  Stamp zero = Stamp::max();
  if (!run->nav.empty()) zero = std::min(zero, run->nav.front().stamp);
  if (!run->scans.empty()) zero = std::min(zero, run->scans.front().reference);
  if (!run->truth.empty()) zero = std::min(zero, run->truth.front().stamp);
  const auto keep = [&](auto* records, auto stamp_of) {
    records->erase(std::remove_if(records->begin(), records->end(),
                                  [&](const auto& r) {
                                    const Duration t = stamp_of(r) - zero;
                                    return t < from || t >= to;
                                  }),
                   records->end());
  };
  keep(&run->nav, [](const NavRecord& r) { return r.stamp; });
  keep(&run->scans, [](const ScanRecord& r) { return r.reference; });
  keep(&run->truth, [](const tools::StampedPose& r) { return r.stamp; });
}

std::string_view stop_name(int stop) {
  // The same values: see the conversion of SP.
  return registration::name_of(static_cast<registration::Stop>(stop));
}

Result<ScanPoses> poses_at_scans(const RunLog& run, Frame frame) {
  if (run.scans.empty()) return poses_at_beliefs(run, frame);
  std::vector<std::optional<Pose>> poses;
  for (const ScanRecord& scan : run.scans) {
    if (frame != Frame::kRolling) {
      poses.push_back(nav_pose_at(run, frame, scan.reference));
      continue;
    }
    if (scan.map_epoch != run.scans.front().map_epoch) {
      return Error{
          fmt::format("{}: SP restarted its rolling map at scan {}: the poses have no common "
                      "frame; use --frame local",
                      run.path, scan.scan_id)};
    }
    poses.push_back(scan.T_rolling_vehicle);
  }

  ScanPoses out;
  // From covered neighbours outwards, forwards and then backwards.
  const auto carry = [&](std::size_t from, std::size_t to) {
    const ScanRecord& a = run.scans[from];
    const ScanRecord& b = run.scans[to];
    if (poses[to] || !poses[from] || a.map_epoch != b.map_epoch || !a.T_rolling_vehicle ||
        !b.T_rolling_vehicle) {
      return;
    }
    poses[to] = *poses[from] * a.T_rolling_vehicle->inverse() * *b.T_rolling_vehicle;
    ++out.carried;
  };
  for (std::size_t i = 1; i < poses.size(); ++i) carry(i - 1, i);
  for (std::size_t i = poses.size() - 1; i > 0; --i) carry(i, i - 1);

  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i]) continue;
    out.scan_ids.push_back(run.scans[i].scan_id);
    out.poses.push_back({run.scans[i].reference, *poses[i]});
  }
  if (out.poses.empty()) {
    return Error{fmt::format("{}: no pose in the requested frame at any of {} scans", run.path,
                             run.scans.size())};
  }
  return out;
}

std::optional<Stamp> begin_in_sensor_time(const std::string& path) {
  Result<LogReader> log = LogReader::open(path);
  if (!log) return std::nullopt;
  std::optional<Stamp> first;
  LogEvent event;
  while (log->next(&event)) {
    if (!first) first = event.stamp;
    if (event.channel != channel::kSimTruth && event.channel != channel::kWmNavState) continue;
    const std::optional<MessageHead> head = read_head(event.channel, event.data);
    constexpr std::int64_t kMax = std::int64_t{1} << 60;  // beyond: a damaged message
    if (head && head->utime > -kMax && head->utime < kMax) {
      return from_utime(head->utime) - (event.stamp - *first);
    }
  }
  return std::nullopt;
}

}  // namespace rcs::recording
