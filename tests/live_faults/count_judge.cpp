#include "tests/live_faults/count_judge.h"

#include <fmt/format.h>

#include <algorithm>

namespace rcs::live_faults {
namespace {

constexpr std::size_t kMaxBreaches = 50;
constexpr double kAway = 3.0;  // times the radius
constexpr double kNowhere_m = 1e9;

}  // namespace

void CountJudge::breach(const std::string& text) {
  if (breaches_.size() < kMaxBreaches) breaches_.push_back(text);
}

void CountJudge::watch(const std::string& what, std::int64_t seq,
                       std::vector<std::int64_t> counts) {
  Life& life = lives_[what];
  if (seq <= life.seq || life.begun == 0) {
    ++life.begun;
  } else {
    // Its first message may arrive before the process has published its pid.
    const auto processes = static_cast<std::int64_t>(pids_[what.substr(0, what.find(':'))].size());
    if (life.begun > processes) {
      breach(fmt::format("{}: counts began for the {}th time in {} processes", what, life.begun,
                         processes));
      life.begun = processes;
    }
    for (std::size_t i = 0; i < std::min(counts.size(), life.counts.size()); ++i) {
      if (counts[i] >= life.counts[i]) continue;
      breach(
          fmt::format("{}: count {} ran back from {} to {}", what, i, life.counts[i], counts[i]));
    }
  }
  life.seq = seq;
  life.counts = std::move(counts);
}

void CountJudge::take(const registration_t& m) {
  const scan_account_t& a = m.account;
  watch("sp: scan_account", m.seq,
        {a.answered, a.degraded, a.held, a.failed, a.dropped, a.facets_lost, a.facets_refused});
  // A new map after failures gives a second result for the same scan, and so does the a priori map.
  const bool first_answer = m.target == registration_t::TARGET_ROLLING &&
                            !(m.stop == registration_t::STOP_SEEDED && m.scan_id == newest_scan_);
  if (!first_answer) return;
  ++scans_;
  if (m.scan_id <= newest_scan_) {
    breach(fmt::format("sp: scan {} is answered after scan {}", m.scan_id, newest_scan_));
  }
  newest_scan_ = m.scan_id;
}

void CountJudge::take(const innovation_t& m) {
  const bool counted_once =
      m.source == innovation_t::SOURCE_ROLLING || m.source == innovation_t::SOURCE_PRIOR_MAP ||
      m.source == innovation_t::SOURCE_GPS_POSITION || m.source == innovation_t::SOURCE_ODOMETRY;
  if (!counted_once || m.accepted == 0) return;
  if (fused_.emplace(m.source, m.utime).second) return;
  breach(fmt::format("wm: a measurement of source {} at {} is fused twice", m.source, m.utime));
}

void CountJudge::take(const cycle_t& m) {
  std::vector<std::int64_t> counts = {m.index, m.missed, m.overruns};
  for (const input_account_t& i : m.input) {
    counts.insert(counts.end(), {i.received, i.dropped, i.gaps, i.malformed});
  }
  watch(m.node + ": cycle", m.seq, std::move(counts));
}

void CountJudge::take(const process_t& m) {
  pids_[m.node].insert(m.pid);
  watch(m.node + ": process", m.seq, {m.cycles, m.missed, m.overruns, m.cpu_us});
}

void CountJudge::take(const command_t& m) { tasks_[{m.issuer, m.serial}] = m.task; }

void CountJudge::take(const status_t& m) {
  const auto task = tasks_.find({m.issuer, m.echo_serial});
  if (task != tasks_.end() && task->second != 0) {
    int& done = done_[{m.issuer, task->second}];
    if (m.waypoints_done < done) {
      breach(fmt::format("bg: {} waypoints of task {} were done, now {}", done, task->second,
                         m.waypoints_done));
    }
    done = m.waypoints_done;
  }
  if (m.new_command == 0) return;
  if (taken_.emplace(m.issuer, m.echo_serial).second) return;
  breach(fmt::format("bg: command {} of {} is acted on twice", m.echo_serial, m.issuer));
}

void CountJudge::take(const truth_t& m) {
  const Vec2 here(m.p_world_vehicle_m[0], m.p_world_vehicle_m[1]);
  nearest_to_next_m_ = std::min(nearest_to_next_m_, (course_[next_] - here).norm());
  for (std::size_t k = 0; k < course_.size(); ++k) {
    const double distance_m = (course_[k] - here).norm();
    if (distance_m > kAway * radius_m_) far_[k] = true;
    if (distance_m > radius_m_ || !far_[k]) continue;
    far_[k] = false;
    if (k != next_ && waypoints_ == 0) continue;
    // BG was dead, or its pose differed, when the vehicle passed the waypoint, so it still drives
    // to it.
    if ((k + 1) % course_.size() == next_) {
      ++returns_;
      continue;
    }
    if (k != next_) {
      breach(
          fmt::format("waypoint {} is driven to; the next one is {}, and {:.1f} m is as near as "
                      "it was driven to",
                      k + 1, next_ + 1, nearest_to_next_m_));
    }
    ++waypoints_;
    next_ = (k + 1) % course_.size();
    nearest_to_next_m_ = kNowhere_m;
  }
}

}  // namespace rcs::live_faults
