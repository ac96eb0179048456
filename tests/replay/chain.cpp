#include "tests/replay/chain.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/executor.h"
#include "rcs/node/local_bus.h"
#include "rcs/node/lockstep_timeline.h"
#include "sim/simulator.h"
#include "tests/support/tap.h"

namespace rcs::test {
namespace {

/// The simulator without some of its sensors.
class Muted final : public EventSource {
 public:
  Muted(EventSource* source, const ChainOptions& options) : source_(source), options_(options) {}

  Stamp peek() override { return source_->peek(); }
  void take(SourceEvent* event) override {
    source_->take(event);
    const bool ladar =
        event->channel == channel::kLadarRanges || event->channel == channel::kLadarPoints;
    const bool mute =
        (ladar && !options_.ladar) || (event->channel == channel::kOdometry && !options_.odometry);
    if (mute) event->channel = "MUTED";
  }

 private:
  EventSource* source_;
  const ChainOptions& options_;
};

/// A node whose cycles are watched.
class Watched final : public Node {
 public:
  Watched(Node* node, const ChainOptions& options) : node_(node), options_(options) {}

  [[nodiscard]] const NodeInfo& info() const override { return node_->info(); }
  [[nodiscard]] Stamp next_wakeup() const override { return node_->next_wakeup(); }
  [[nodiscard]] Duration nominal_compute() const override { return node_->nominal_compute(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return node_->inboxes(); }
  void run(const Cycle& cycle) override {
    if (options_.around_cycle) options_.around_cycle(*node_, true);
    node_->run(cycle);
    if (options_.around_cycle) options_.around_cycle(*node_, false);
  }

 private:
  Node* node_;
  const ChainOptions& options_;
};

}  // namespace

ChainRun run_chain(const sim::Scenario& scenario, const std::string& vehicle_config,
                   const ChainOptions& options) {
  const Result<ParamFile> file = ParamFile::load(vehicle_config);
  RCS_CHECK(file.ok());
  const Result<sp::SpConfig> sp_config = sp::load_sp_config(*file);
  const Result<wm::WmConfig> wm_config = wm::load_wm_config(*file);
  RCS_CHECK(sp_config.ok() && wm_config.ok());

  sim::Simulator simulator(scenario);
  std::optional<ElevationMap> prior_map;
  if (options.prior_map) {
    Result<ElevationMap> map = ElevationMap::from_tiles({simulator.prior_map()});
    RCS_CHECK(map.ok());
    prior_map = std::move(map).value();
  }

  LocalBus bus;
  sp::SpNode sp_node(*sp_config, std::move(prior_map), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  ChainRun out;
  const LocalFrame world(scenario.datum);
  const Tap<truth_t> truth(&bus, channel::kSimTruth, [&](const truth_t& m, Stamp) {
    TruthSample s{from_utime(m.utime), {}, from_message(m.v_world_mps)};
    RCS_CHECK(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &s.T_world_vehicle));
    out.truth.push_back(s);
  });
  const Tap<nav_state_t> nav(&bus, channel::kWmNavState, [&](const nav_state_t& m, Stamp) {
    BeliefSample s;
    s.stamp = from_utime(m.utime);
    RCS_CHECK(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &s.T_world_vehicle));
    s.v_world = from_message(m.v_world_mps);
    // WM's world frame hangs on its own datum (the first fix, unless one is configured).
    if (m.world_valid != 0) {
      const Pose T_truth_world = world.from(
          LocalFrame({radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}}));
      s.T_world_vehicle = T_truth_world * s.T_world_vehicle;
      s.v_world = T_truth_world.q * s.v_world;
    }
    s.covariance = from_message<6>(m.cov_world_pose);
    s.v_covariance = from_message<3>(m.cov_v_world);
    s.world_valid = m.world_valid != 0;
    out.beliefs.push_back(s);
  });
  const Tap<registration_t> matches(
      &bus, channel::kSpRegistration, [&](const registration_t& m, Stamp) {
        const bool rolling = m.target == int{registration_t::TARGET_ROLLING};
        out.prior_matches += rolling ? 0 : 1;
        out.scans += rolling ? 1 : 0;
        const auto stop = static_cast<sp::Stop>(m.stop);
        out.failed += rolling && !sp::usable(stop) && stop != sp::Stop::kSeeded ? 1 : 0;
      });

  Muted source(&simulator, options);
  LockstepTimeline timeline(&bus, &source, from_seconds(0.5));
  Watched watched_sp(&sp_node, options);
  Watched watched_wm(&wm_node, options);
  run({&watched_sp, &watched_wm}, timeline, nullptr);
  return out;
}

bool ChainRun::at(Stamp stamp, BeliefSample* belief, TruthSample* truth_out) const {
  const auto b = std::upper_bound(beliefs.begin(), beliefs.end(), stamp,
                                  [](Stamp t, const BeliefSample& s) { return t < s.stamp; });
  if (b == beliefs.begin()) return false;
  *belief = *(b - 1);
  const auto after = std::lower_bound(truth.begin(), truth.end(), belief->stamp,
                                      [](const TruthSample& s, Stamp t) { return s.stamp < t; });
  if (after == truth.begin() || after == truth.end()) return false;
  const TruthSample& a = *(after - 1);
  const double u = seconds(belief->stamp - a.stamp) / seconds(after->stamp - a.stamp);
  *truth_out = {belief->stamp, interpolate(a.T_world_vehicle, after->T_world_vehicle, u),
                a.v_world + u * (after->v_world - a.v_world)};
  return true;
}

Nees nees(const BeliefSample& belief, const TruthSample& truth) {
  const Vec6 e = log_se3(belief.T_world_vehicle.inverse() * truth.T_world_vehicle);
  const Vec3 v = truth.v_world - belief.v_world;
  const Mat3 position = belief.covariance.topLeftCorner<3, 3>();
  const Mat3 attitude = belief.covariance.bottomRightCorner<3, 3>();
  return {e.head<3>().dot(position.ldlt().solve(e.head<3>())) / 3.0,
          e.tail<3>().dot(attitude.ldlt().solve(e.tail<3>())) / 3.0,
          v.dot(belief.v_covariance.ldlt().solve(v)) / 3.0,
          e.dot(belief.covariance.ldlt().solve(e)) / 6.0};
}

std::string source_path(const std::string& relative) {
  const char* root = std::getenv("RCS_SOURCE_DIR");
  return std::string(root == nullptr ? "." : root) + "/" + relative;
}

}  // namespace rcs::test
