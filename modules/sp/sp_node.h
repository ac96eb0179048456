#pragma once
// Node SP: receives facets and beliefs, publishes registrations and points.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/ins_content.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/scan_account_t.hpp"
#include "modules/registration/cloud_registration.h"
#include "modules/registration/voxel_sampler.h"
#include "modules/sp/degrade.h"
#include "modules/sp/motion_prediction.h"
#include "modules/sp/points_node.h"
#include "modules/sp/prior/prior_match.h"
#include "modules/sp/prior/prior_scan.h"
#include "modules/sp/scan/scan_assembler.h"
#include "modules/sp/scan/scan_motion.h"
#include "modules/sp/scan/scan_repetition.h"
#include "modules/sp/scan/stamp_watch.h"
#include "modules/sp/sp_config.h"
#include "modules/sp/start/initial_localization_node.h"
#include "modules/sp/usual_overlap.h"
#include "modules/sp/voxel_scale.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"
#include "rcs/prior/prior_terrain.h"

namespace rcs::sp {

class SpNode final : public Node {
 public:
  SpNode(const SpConfig& config, PriorTerrain prior, Bus* bus);

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override;
  [[nodiscard]] Duration nominal_compute() const override;
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override;
  [[nodiscard]] int degrade_level() const override { return static_cast<int>(ladder_.level); }

 private:
  void reserve();
  void take_inertial();
  void take_belief(Stamp now);
  /// @return true if a scan was finished: at most one in a cycle, which has one start and one
  ///         deadline
  template <class Message>
  bool take_facets(Inbox<Message>* inbox, const Cycle& cycle);
  void begin_scan(const FacetId& id);
  void finish_scan(const Cycle& cycle);
  void choose_level(const Cycle& cycle);
  void begin_answer(const Cycle& cycle, Stamp measured);
  void answer(const registration::Registration& registration, int target);
  void answer_without_registering(registration::Stop stop, const Expectation& expected);
  void correct_stamp(const Cycle& cycle);
  void choose_reference(Scan* scan) const;
  void decide_stamp(Expectation* expected);
  void prepare_points(const Cycle& cycle, const Expectation& expected);
  void deskew_and_sample(const MotionState& motion);
  void sample();
  [[nodiscard]] double fitting_scale();
  void choose_voxels(const Cycle& cycle);
  [[nodiscard]] bool matches_less_than_usual(const registration::Registration& r) const;
  [[nodiscard]] bool matches_less_than(double share, const registration::Registration& r) const;
  void search_wide(const Expectation& expected, registration::Registration* rolling);
  /// This scan and the last one as two clouds; compared at most once.
  struct ScanPair {
    std::optional<registration::CloudMatcher> matcher;
    std::vector<Pose> T_rolling_vehicle;  ///< the best first; none: they determine no motion
    std::optional<registration::Plausibility> contradiction;  ///< of a registration
  };
  /// T_rolling_last^-1 T, of the LADAR instead of the vehicle.
  [[nodiscard]] Pose ladar_motion_to(const Pose& T_rolling_vehicle) const;
  void compare_scans(const Pose& predicted, ScanPair* pair);
  void register_by_last_scan(double least, ScanPair* pair, registration::Prediction* prediction,
                             registration::Registration* rolling);
  void follow_motion(const Expectation& expected, registration::Registration* rolling);
  void register_by_own_motion(registration::Prediction* prediction,
                              registration::Registration* rolling);
  void recover(const Cycle& cycle, const Expectation& expected, ScanPair* pair,
               registration::Prediction* prediction, registration::Registration* rolling);
  void register_scan(const Cycle& cycle, const Expectation& expected);
  void search_start(const Cycle& cycle, const Pose& T_rolling_vehicle);
  void match_prior(const Cycle& cycle, const Pose& T_rolling_vehicle, bool distorted);
  void remember_scan(const Pose& T_rolling_vehicle);
  void seed(const Cycle& cycle, const Pose& T_rolling_vehicle);
  void publish_points(const Pose& T_rolling_vehicle);

  SpConfig config_;
  PriorTerrain prior_;

  StartSearch start_;

  Inbox<ladar_ranges_t> ranges_;
  Inbox<ladar_points_t> facets_;
  Inbox<ins_t> ins_;
  Inbox<nav_state_t> nav_states_;
  Outbox<registration_t> registration_out_;
  PointsWriter points_out_;
  Report report_;

  ScanAssembler assembler_;
  ScanRepetition repetition_;
  Stamp first_facet_arrival_ = Stamp::min();  // of the current scan
  Stamp last_facet_arrival_ = Stamp::min();
  int facet_count_ = 1;
  std::int64_t last_scan_ = -1;  // the newest begun; -1: none yet
  Duration late_{};              // largest delay of a cycle since the last scan
  DegradeLadder ladder_;
  WorkUnits granted_ = 0;    // for the current scan, and not used yet
  WorkUnits full_need_ = 0;  // nominal, of the newest scan that was not degraded; 0: none yet
  scan_account_t account_{};
  StampWatch stamps_;
  Duration reported_shift_{};  // of the stamps of the scans
  InertialBuffer inertial_;
  InsContent ins_content_;
  bool ins_excluded_ = false;  // by WM
  Duration ins_shift_{};       // correction of the stamps of INS, from WM
  MotionTable motion_;
  registration::VoxelSampler map_sampler_;
  registration::VoxelSampler source_sampler_;
  PriorScan prior_scan_;
  Scan as_measured_;  // not deskewed; filled while the INS is silent
  Points dense_;      // inserted into the map
  Points source_;     // registered
  Points last_seen_;  // of the last registered scan, from the LADAR
  Pose T_rolling_last_;
  registration::RollingMap map_;
  registration::IcpWorkspace icp_;
  PriorMatchWorkspace prior_match_;

  std::int32_t epoch_ = 0;  // of the map; 0: none yet
  VoxelScale scale_;
  std::vector<float> distances_;
  double range_m_ = 0.0;        ///< median of the newest scan with enough points
  UsualOverlap usual_overlap_;  ///< of the scans of this map
  int failures_ = 0;            // in a row
  MotionGuess motion_guess_;
  std::optional<Pose> T_level_rolling_;  // while frame world is unknown
  std::optional<Pose> T_world_rolling_;
  Mat6 world_covariance_ = Mat6::Identity();

  registration_t registration_message_{};
};

/// Opens the configured a priori map and creates the node.
[[nodiscard]] Result<std::unique_ptr<Node>> make_sp_node(const ParamFile& file, Bus* bus);
/// The same with a thread that loads the map, as required on a vehicle.
[[nodiscard]] Result<std::unique_ptr<Node>> make_live_sp_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::sp
