#include "tests/replay/chain.h"

#include <cstdlib>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/simulator.h"

namespace rcs::test {
namespace {

/// A node whose cycles are watched.
class Watched final : public Node {
 public:
  Watched(Node* node, const AroundCycle& around_cycle) : node_(node), around_cycle_(around_cycle) {}

  [[nodiscard]] const NodeInfo& info() const override { return node_->info(); }
  [[nodiscard]] Stamp next_wakeup() const override { return node_->next_wakeup(); }
  [[nodiscard]] Duration nominal_compute() const override { return node_->nominal_compute(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return node_->inboxes(); }
  void run(const Cycle& cycle) override {
    around_cycle_(*node_, true);
    node_->run(cycle);
    around_cycle_(*node_, false);
  }

 private:
  Node* node_;
  const AroundCycle& around_cycle_;
};

}  // namespace

ChainRun run_chain(const sim::Scenario& scenario, const std::string& vehicle_config,
                   const AroundCycle& around_cycle) {
  const Result<ParamFile> file = ParamFile::load(vehicle_config);
  RCS_CHECK(file.ok());
  const Result<sp::SpConfig> sp_config = sp::load_sp_config(*file);
  const Result<wm::WmConfig> wm_config = wm::load_wm_config(*file);
  RCS_CHECK(sp_config.ok() && wm_config.ok());

  sim::Simulator simulator(scenario);
  const sim::PriorMap survey = simulator.prior_map();
  Result<ElevationMap> prior_map = ElevationMap::from_rasters(survey.frame, {survey.raster});
  RCS_CHECK(prior_map.ok());

  LocalBus bus;
  sp::SpNode sp_node(*sp_config, PriorTerrain(std::move(prior_map).value(), nullptr), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  ChainRun out;
  const Tap<registration_t> matches(
      &bus, channel::kSpRegistration, [&](const registration_t& m, Stamp) {
        const bool rolling = m.target == int{registration_t::TARGET_ROLLING};
        out.prior_matches += rolling ? 0 : 1;
        out.scans += rolling ? 1 : 0;
      });

  LockstepTimeline timeline(&bus, &simulator, kReplayTail);
  Watched watched_sp(&sp_node, around_cycle);
  Watched watched_wm(&wm_node, around_cycle);
  run({&watched_sp, &watched_wm}, timeline, nullptr);
  return out;
}

std::string source_path(const std::string& relative) {
  const char* root = std::getenv("RCS_SOURCE_DIR");
  return std::string(root == nullptr ? "." : root) + "/" + relative;
}

}  // namespace rcs::test
