#include "tools/evaluation/top_model.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/process/publisher_watch.h"

namespace rcs::evaluation {
namespace {

constexpr std::size_t kMaxText = 400;
constexpr std::size_t kMaxName = 16;
constexpr std::size_t kMaxChannel = 64;
/// A position farther from the datum is not converted.
constexpr double kFar_m = 1e6;
/// Limit of the samples in a window; no node has more cycles in it.
constexpr std::size_t kMaxLooks = 20'000;

/// Times and counts of a message may have any value; their differences must not overflow.
std::int64_t bounded(std::int64_t value) {
  constexpr std::int64_t kFar = std::int64_t{1} << 60;
  return std::clamp(value, -kFar, kFar);
}

std::optional<Duration> age_of(std::int64_t age_us) {
  return age_us < 0 ? std::nullopt : std::optional<Duration>(Duration(age_us));
}

TopView::Nav view_nav(const nav_state_t& m) {
  TopView::Nav nav;
  nav.mode = nav_mode_name(m.mode);
  nav.pose_valid = m.pose_valid != 0;
  nav.world_valid = m.world_valid != 0;
  for (std::size_t i = 0; i < 3; ++i) {
    nav.sigma_m[i] = std::sqrt(m.cov_world_pose[i][i]);
    nav.p_world_m[i] = m.p_world_vehicle_m[i];
  }
  if (Pose T; from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T)) {
    nav.heading_deg = std::fmod(90.0 - degrees(yaw_of(T.q)) + 720.0, 360.0);
    const Geodetic datum{radians(m.datum_lat_deg), radians(m.datum_lon_deg),
                         EllipsoidalHeight{m.datum_height_m}};
    if (nav.world_valid && plausible(datum) && T.p.norm() < kFar_m) {
      const Geodetic here = LocalFrame(datum).to_geodetic(T.p);
      nav.lat_deg = degrees(here.lat_rad);
      nav.lon_deg = degrees(here.lon_rad);
    }
  }
  nav.sigma_yaw_rad = std::sqrt(m.cov_world_pose[5][5]);
  nav.speed_mps = std::hypot(m.v_world_mps[0], m.v_world_mps[1], m.v_world_mps[2]);
  nav.distance_since_gps_m = m.distance_since_gps_m;
  nav.world_resets = m.world_resets;
  nav.map_epoch = m.map_epoch;
  nav.ages = {{"ins", age_of(m.age_ins_us)},
              {"gps", age_of(m.age_gps_us)},
              {"odometry", age_of(m.age_odometry_us)},
              {"rolling", age_of(m.age_rolling_us)},
              {"prior map", age_of(m.age_prior_map_us)}};
  return nav;
}

TopView::Status view_status(const status_t& m, Duration received) {
  return {received,
          std::string(status_name(m.status)),
          printable(m.state),
          printable(m.reason),
          m.echo_serial,
          printable(m.issuer),
          std::string(emergency_stop_name(m.emergency_stop))};
}

TopView::Routes view_routes(const routes_t& m, Duration received) {
  TopView::Routes routes{received, m.route.size(), m.alert_limit_m, std::nullopt};
  for (const route_t& r : m.route) {
    if (r.verdict != route_t::VERDICT_CHOSEN) continue;
    routes.chosen = TopView::Routes::Chosen{r.length_m, r.time_s, r.level_max_m};
  }
  return routes;
}

/// The newest information of an entry, or a new one in the place of an outdated one if there are
/// `most`: a flood of ever new ones displaces no present one.
template <class Known, class Same>
void remember(std::vector<Known>* all, std::size_t most, Known known, Duration outdated,
              const Same& same) {
  const auto find = [all](const auto& match) {
    return std::find_if(all->begin(), all->end(), match);
  };
  auto entry = find(same);
  if (entry == all->end() && all->size() >= most) {
    entry = find([&](const Known& k) { return known.arrival - k.arrival > outdated; });
    if (entry == all->end()) return;
  }
  if (entry == all->end()) entry = all->emplace(entry);
  *entry = std::move(known);
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out(text.substr(0, kMaxText));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
  }
  return out;
}

void RateWindow::add(Stamp arrival, std::int64_t counted) {
  const std::int64_t count = bounded(counted);
  // The count restarts: another process.
  if (!looks_.empty() && count < looks_.back().count) looks_.clear();
  looks_.push_back({arrival, count});
  if (looks_.size() > kMaxLooks) looks_.pop_front();
}

void RateWindow::forget_before(Stamp oldest) {
  while (!looks_.empty() && looks_.front().arrival < oldest) looks_.pop_front();
}

std::optional<double> RateWindow::rate() const {
  if (looks_.size() < 2) return std::nullopt;
  const double span_s = seconds(looks_.back().arrival - looks_.front().arrival);
  if (span_s <= 0.0) return std::nullopt;
  return static_cast<double>(looks_.back().count - looks_.front().count) / span_s;
}

TopModel::NodeState* TopModel::node(std::string_view name) {
  std::string key = printable(name.substr(0, kMaxName));
  const auto known = nodes_.find(key);
  if (known != nodes_.end()) return &known->second;
  if (nodes_.size() >= kMaxNodes) return nullptr;
  NodeState& n = nodes_[key];
  n.metrics.name = std::move(key);
  return &n;
}

void TopModel::note_process(const process_t& m, Stamp arrival) {
  TopView::Process process{
      printable(m.node.substr(0, kMaxName)), m.pid, {m.run_id, m.publisher_id, 0}};
  remember(&processes_, kMaxProcesses, KnownProcess{process, arrival}, kSilent,
           [&](const KnownProcess& k) {
             return k.process.node == process.node &&
                    k.process.publisher.publisher_id == m.publisher_id;
           });
}

void TopModel::note_rejection(const event_t& m, Stamp arrival) {
  const std::optional<Rejection> rejection = rejection_of(m);
  if (!rejection) return;
  TopView::Rejected rejected{printable(rejection->channel.substr(0, kMaxChannel)),
                             printable(m.node.substr(0, kMaxName)),
                             {rejection->run_id, rejection->publisher_id, 0},
                             std::nullopt};
  remember(&rejections_, kMaxRejected, KnownRejection{rejected, arrival}, kRejectedFor,
           [&](const KnownRejection& k) {
             return k.rejected.channel == rejected.channel && k.rejected.by == rejected.by &&
                    k.rejected.publisher.publisher_id == rejection->publisher_id;
           });
}

void TopModel::on_process(const process_t& m, Stamp arrival) {
  note_process(m, arrival);
  NodeState* const n = node(m.node);
  if (n == nullptr) return;
  TopView::Node& f = n->metrics;
  if (f.pid != m.pid) n->cpu_us = {};
  n->process_arrival = arrival;
  n->start = from_utime(bounded(m.start_utime));
  n->cpu_us.add(arrival, m.cpu_us);
  f.pid = m.pid;
  f.publisher = {m.run_id, m.publisher_id, 0};
  f.rss_kb = m.rss_kb;
  f.heap_kb = m.heap_kb;
  f.descriptors = m.descriptors;
  f.realtime_priority = m.realtime_priority;
  f.memory_locked = m.memory_locked != 0;
  f.note = printable(m.note);
  f.overruns = m.overruns;
  f.missed = m.missed;
  f.degrade_level = m.degrade_level;
}

void TopModel::on_cycle(const cycle_t& m, Stamp arrival) {
  NodeState* const n = node(m.node);
  if (n == nullptr) return;
  n->accounts.add(arrival, ++n->account_count);
  n->work.push_back({arrival, Duration(m.used_wall_us), Duration(m.slack_us)});
  if (n->work.size() > kMaxLooks) n->work.pop_front();
  TopView::Node& f = n->metrics;
  f.budget = Duration(bounded(m.deadline_utime) - bounded(m.wakeup_utime));
  f.overruns = m.overruns;
  f.missed = m.missed;
  f.degrade_level = m.degrade_level;
  for (const input_account_t& in : m.input) {
    const std::string channel = printable(in.channel.substr(0, kMaxChannel));
    if (n->inputs.count(channel) == 0 && n->inputs.size() >= kMaxInputs) continue;
    InputState& state = n->inputs[channel];
    state.metrics.channel = channel;
    state.metrics.dropped = in.dropped;
    state.metrics.gaps = in.gaps;
    state.metrics.malformed = in.malformed;
    state.metrics.rejected = in.rejected;
    state.received.add(arrival, in.received);
    state.any = in.age_us >= 0;
    state.last = arrival - Duration(bounded(in.age_us));
  }
}

void TopModel::on_event(const event_t& m, Stamp arrival) {
  note_rejection(m, arrival);
  // Not the message itself, whose texts may have any length.
  event_t kept{};
  kept.node = printable(m.node.substr(0, kMaxName));
  kept.severity = m.severity;
  kept.code = printable(m.code.substr(0, kMaxChannel));
  kept.text = printable(m.text);
  kept.repeated = m.repeated;
  events_.push_front({arrival, std::move(kept)});
  if (events_.size() > kMaxEvents) events_.pop_back();
}

void TopModel::on_nav(const nav_state_t& m, Stamp arrival) { nav_ = {arrival, m}; }

void TopModel::on_integrity(const integrity_t& m, Stamp arrival) { integrity_ = {arrival, m}; }

void TopModel::on_fix(const gps_fix_t& m, Stamp arrival) { fix_ = {arrival, m}; }

void TopModel::on_status(const status_t& m, Stamp arrival) { status_ = {arrival, m}; }

void TopModel::on_mission(const status_t& m, Stamp arrival) { mission_ = {arrival, m}; }

void TopModel::on_routes(const routes_t& m, Stamp arrival) { routes_ = {arrival, m}; }

void TopModel::view_work(NodeState* n) const {
  TopView::Node& f = n->metrics;
  f.used_p50 = f.used_p99 = f.used_max = f.min_slack = std::nullopt;
  if (n->work.empty()) return;
  std::vector<Duration> used;
  Duration least = Duration::max();
  for (const Work& w : n->work) {
    used.push_back(w.used);
    least = std::min(least, w.slack);
  }
  const auto middle = used.begin() + static_cast<std::ptrdiff_t>(used.size() / 2);
  std::nth_element(used.begin(), middle, used.end());
  f.used_p50 = *middle;
  // Nearest rank: the smallest value with at least 99 % of the values at or below it.
  const auto rank = used.begin() + static_cast<std::ptrdiff_t>((99 * used.size() + 99) / 100 - 1);
  std::nth_element(used.begin(), rank, used.end());
  f.used_p99 = *rank;
  f.used_max = *std::max_element(used.begin(), used.end());
  f.min_slack = least;
}

TopView TopModel::view(Stamp now, std::int64_t now_utime) {
  TopView view;
  view.now_utime = now_utime;
  std::optional<Stamp> run_start;
  const Stamp oldest = now - kWindow;
  for (auto& [name, n] : nodes_) {
    while (!n.work.empty() && n.work.front().arrival < oldest) n.work.pop_front();
    n.accounts.forget_before(oldest);
    n.cpu_us.forget_before(oldest);
    view_work(&n);
    TopView::Node& f = n.metrics;
    f.received =
        n.process_arrival ? std::optional<Duration>(now - *n.process_arrival) : std::nullopt;
    f.alive = f.received && *f.received < kSilent;
    f.up = now - n.start;
    if (f.alive) run_start = std::min(run_start.value_or(n.start), n.start);
    f.account_hz = n.accounts.rate();
    const std::optional<double> cpu = n.cpu_us.rate();
    f.cpu_percent = cpu ? std::optional<double>(*cpu * 1e-4) : std::nullopt;
    f.inputs.clear();
    for (auto& [channel, input] : n.inputs) {
      input.received.forget_before(oldest);
      input.metrics.rate_hz = input.received.rate();
      input.metrics.age = input.any ? std::optional<Duration>(now - input.last) : std::nullopt;
      f.inputs.push_back(input.metrics);
    }
    view.nodes.push_back(f);
  }
  if (nav_) {
    view.nav = view_nav(nav_->message);
    view.nav->received = now - nav_->arrival;
  }
  if (integrity_) {
    const integrity_t& m = integrity_->message;
    view.integrity = TopView::Integrity{
        now - integrity_->arrival,
        std::isfinite(m.protection_horizontal_m) && std::isfinite(m.protection_vertical_m),
        m.protection_horizontal_m,
        m.protection_vertical_m,
        m.limit_horizontal_m,
        m.limit_vertical_m,
        m.alerts,
        std::string(source_status_name(m.ins)),
        std::string(source_status_name(m.gps)),
        std::string(source_status_name(m.ladar))};
  }
  if (fix_) {
    view.fix = TopView::Fix{now - fix_->arrival, std::string(gps_fix_name(fix_->message.fix_type)),
                            fix_->message.satellites};
  }
  if (status_) view.status = view_status(status_->message, now - status_->arrival);
  if (mission_) view.mission = view_status(mission_->message, now - mission_->arrival);
  if (routes_) view.routes = view_routes(routes_->message, now - routes_->arrival);
  for (const Received<event_t>& e : events_) {
    const std::optional<Duration> of_run =
        run_start ? std::optional<Duration>(e.arrival - *run_start) : std::nullopt;
    view.events.push_back({now - e.arrival, of_run, e.message.node, e.message.severity,
                           e.message.code, e.message.text, e.message.repeated});
  }
  view.malformed = malformed_;
  view_processes(now, &view);
  return view;
}

void TopModel::view_processes(Stamp now, TopView* view) const {
  for (const KnownProcess& k : processes_) {
    if (now - k.arrival < kSilent) view->processes.push_back(k.process);
  }
  std::sort(view->processes.begin(), view->processes.end(),
            [](const TopView::Process& a, const TopView::Process& b) {
              return a.node != b.node ? a.node < b.node
                                      : a.publisher.publisher_id < b.publisher.publisher_id;
            });
  for (const KnownRejection& k : rejections_) {
    if (now - k.arrival >= kRejectedFor) continue;
    TopView::Rejected rejected = k.rejected;
    const auto process = std::find_if(
        view->processes.begin(), view->processes.end(), [&](const TopView::Process& p) {
          // 0: a program that does not set the id.
          return p.publisher.publisher_id == rejected.publisher.publisher_id &&
                 p.publisher.publisher_id != 0;
        });
    if (process != view->processes.end()) rejected.process = *process;
    view->rejected.push_back(std::move(rejected));
  }
}

}  // namespace rcs::evaluation
