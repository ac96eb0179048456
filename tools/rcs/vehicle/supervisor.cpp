#include "tools/rcs/vehicle/supervisor.h"

#include <algorithm>

namespace rcs::cli {

Supervisor::Supervisor(const std::vector<bool>& critical, const SupervisorParams& params)
    : params_(params), nodes_(critical.size()) {
  for (std::size_t i = 0; i < critical.size(); ++i) nodes_[i].critical = critical[i];
}

void Supervisor::on_alive(std::size_t node, Stamp now) {
  NodeState& n = nodes_[node];
  if (n.state != State::kStarting && n.state != State::kRunning) return;
  if (!n.was_alive) n.alive_since = now;
  n.was_alive = true;
  n.was_ever_alive = true;
  n.refusals = 0;
  forget_failures_of_healthy(&n, now);
  n.state = State::kRunning;
  n.until = now + params_.silent_for;
}

std::optional<Duration> Supervisor::on_exit(std::size_t node, const Exit& exit, Stamp now) {
  NodeState& n = nodes_[node];
  const bool refused = !n.was_alive && !exit.by_signal && exit.code != 0;
  forget_failures_of_healthy(&n, now);
  n.was_alive = false;
  n.state = State::kEnded;
  if (stopping_) return std::nullopt;
  n.refusals = refused ? n.refusals + 1 : 0;
  ++n.failures;
  // A node that was alive before may control a moving vehicle: the others keep running. Otherwise
  // stopping all is safe.
  if (n.critical && !n.was_ever_alive && n.refusals >= params_.failing_after) {
    gave_up_on_ = node;
    stopping_ = true;
    return std::nullopt;
  }
  const Duration wait = backoff(n);
  n.state = State::kWaiting;
  n.until = now + wait;
  return wait;
}

bool Supervisor::failing(std::size_t node) const {
  return nodes_[node].failures >= params_.failing_after;
}

void Supervisor::forget_failures_of_healthy(NodeState* node, Stamp now) const {
  if (node->was_alive && now - node->alive_since >= params_.healthy_after) node->failures = 0;
}

Duration Supervisor::backoff(const NodeState& node) const {
  // A rejected configuration will not become valid soon.
  if (node.refusals >= params_.failing_after) return params_.longest_backoff;
  Duration wait = params_.first_backoff;
  for (int i = 1; i < node.failures && wait < params_.longest_backoff; ++i) wait *= 2;
  return std::min(wait, params_.longest_backoff);
}

std::vector<SupervisorAction> Supervisor::due(Stamp now) {
  std::vector<SupervisorAction> actions;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    NodeState& n = nodes_[i];
    const bool over = now >= n.until;
    switch (n.state) {
      case State::kWaiting:
        if (stopping_) {
          n.state = State::kEnded;
        } else if (over) {
          actions.push_back({SupervisorAction::Kind::kStart, i});
          n.state = State::kStarting;
          n.until = now + params_.start_within;
        }
        break;
      case State::kStarting:
      case State::kRunning:
        if (stopping_) {
          actions.push_back({SupervisorAction::Kind::kTerminate, i});
          n.state = State::kStopping;
          n.until = now + params_.stop_within;
        } else if (over) {
          actions.push_back({n.was_alive ? SupervisorAction::Kind::kKillSilent
                                         : SupervisorAction::Kind::kKillUnstarted,
                             i});
          n.state = State::kKilled;
        }
        break;
      case State::kStopping:
        if (over) {
          actions.push_back({SupervisorAction::Kind::kKillUnstopped, i});
          n.state = State::kKilled;
        }
        break;
      case State::kKilled:
      case State::kEnded:
        break;
    }
  }
  return actions;
}

Stamp Supervisor::next() const {
  Stamp next = Stamp::max();
  for (const NodeState& n : nodes_) {
    if (n.state == State::kKilled || n.state == State::kEnded) continue;
    // Stop without delay.
    next = std::min(next, stopping_ && n.state != State::kStopping ? Stamp::min() : n.until);
  }
  return next;
}

bool Supervisor::finished() const {
  return stopping_ && std::all_of(nodes_.begin(), nodes_.end(),
                                  [](const NodeState& n) { return n.state == State::kEnded; });
}

}  // namespace rcs::cli
