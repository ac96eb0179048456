#pragma once
// The message shell of WM: receives sensor data and registrations, publishes the belief.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "lcmtypes/gps_content.h"
#include "lcmtypes/ins_content.h"
#include "lcmtypes/odometry_content.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/subfilter_t.hpp"
#include "modules/wm/alignment_watch.h"
#include "modules/wm/checkpoint_node.h"
#include "modules/wm/estimator.h"
#include "modules/wm/input_watch.h"
#include "modules/wm/integrity.h"
#include "modules/wm/path_uncertainty_node.h"
#include "modules/wm/terrain/terrain_node.h"
#include "modules/wm/wm_config.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"

namespace rcs::wm {

class WmNode final : public Node {
 public:
  /// @param prior  the a priori map, for predictions along paths; without it these use dead
  ///   reckoning only
  /// @param no_map  why a configured map is not used; reported as an event
  WmNode(const WmConfig& config, Bus* bus, PriorTerrain prior = {}, std::string no_map = {});

  /// Before the first cycle: why no state outlives this process; reported as an event.
  void state_no_checkpoint(std::string why) { no_checkpoint_ = std::move(why); }
  /// Before the first cycle: continues with the state of a predecessor, and keeps its own.
  void use(std::unique_ptr<CheckpointMemory> memory, const Publisher& publisher) {
    checkpoint_.emplace(std::move(memory), publisher);
  }
  [[nodiscard]] CheckpointLayout checkpoint_layout() const {
    return CheckpointKeeper::layout(terrain_.grid());
  }

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override;
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override;
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }

 private:
  void begin(Stamp now);
  void resume(Stamp now);
  void keep_local(Stamp now);
  void accept(const ins_t& m, Stamp now);
  void accept(const gps_fix_t& m, Stamp now);
  void accept(const odometry_t& m, Stamp now);
  void accept(const registration_t& m, Stamp now);
  template <class Message>
  void accept_all(Inbox<Message>* inbox, Stamp now);

  [[nodiscard]] Duration without_input_for(Stamp now) const;
  [[nodiscard]] Mode mode(Stamp now) const;
  void publish_innovations();
  void publish_nav_state(Stamp now);
  void publish_integrity(Stamp now);
  void publish_subfilters();
  void fill_belief(const FilterState& state, Stamp now);
  void fill_ages(const FilterState& state, Stamp now);
  void report_events(Stamp now);
  void report_source_status(Stamp now);
  void report_alerts(Stamp now);
  void report_inputs(Stamp now);
  void report_alignment(Stamp now);

  WmConfig config_;
  PeriodicClock clock_;

  Inbox<ins_t> ins_;
  Inbox<gps_fix_t> fixes_;
  Inbox<odometry_t> odometry_;
  Inbox<registration_t> registrations_;
  Outbox<nav_state_t> nav_state_out_;
  Outbox<innovation_t> innovation_out_;
  Outbox<integrity_t> integrity_out_;
  Outbox<subfilter_t> subfilter_out_;
  Report report_;

  Estimator estimator_;
  InputWatch inputs_;
  Stamp moved_to_ = Stamp::min();  // sensor time of the belief
  Stamp moved_at_ = Stamp::min();  // node time at which it reached that
  AlignmentWatch alignment_;
  bool fixes_have_velocity_ = false;
  InsContent ins_content_;
  GpsContent gps_content_;
  OdometryContent odometry_content_;
  double wheels_mps_ = 0.0;  ///< newest speed, and its arrival
  Stamp wheels_received_ = Stamp::min();
  TerrainServer terrain_;
  std::optional<CheckpointKeeper> checkpoint_;
  PathUncertaintyServer path_uncertainty_;
  std::string no_map_;
  std::string no_checkpoint_;
  PeriodicClock integrity_clock_;
  PeriodicClock subfilter_clock_;
  CheckpointKeeper::NodeState kept_;

  // Newest registration, for the latency trace of the belief.
  Stamp cause_ = Stamp::min();
  latency_trace_t latency_trace_{};
  Stamp published_ = Stamp::min();  // stamp of the newest published belief
  int published_clock_steps_ = 0;
  // Last reported values.
  Mode reported_mode_ = Mode::kAlign;
  int reported_resets_ = 0;
  int reported_clock_steps_ = 0;
  int reported_losses_ = 0;
  int local_breaks_ = 0;
  int reported_epoch_ = -1;
  int reported_findings_ = 0;
  bool reported_map_suspected_ = false;
  std::int8_t reported_alerts_ = 0;
  std::array<bool, kInputs> reported_silent_{};
  bool reported_no_input_ = false;
  Duration reported_ins_shift_{};

  nav_state_t nav_state_{};
  innovation_t innovation_{};
  integrity_t integrity_{};
  subfilter_t subfilter_{};
};

/// For a replay: tiles of the a priori map are read when they are needed. A map that cannot be read
/// is reported and is not an error, because the filter does not depend on it.
[[nodiscard]] Result<std::unique_ptr<Node>> make_wm_node(const ParamFile& file, Bus* bus);
/// For the vehicle: tiles are read by a thread.
[[nodiscard]] Result<std::unique_ptr<Node>> make_live_wm_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::wm
