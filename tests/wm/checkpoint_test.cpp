// WM is killed while the vehicle drives, and its successor continues.
#include "modules/wm/checkpoint_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "modules/wm/wm_node.h"
#include "rcs/node/budget.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/local_bus.h"
#include "tests/wm/estimator_rig.h"
#include "tests/wm/sensor_messages.h"

namespace rcs::wm {
namespace {

constexpr double kKilled_s = 30.0;

struct Seen {
  double worst_m = 0.0;       ///< horizontal error in frame world after the start of the successor
  double local_step_m = 0.0;  ///< of the local pose against the true motion over the gap
  double outside = 0.0;       ///< share of the instants with an error above 4 sigma
  Mode first = Mode::kAlign;  ///< a second after the start of the successor
  bool georeferenced_at_once = false;
  bool placed = false;  ///< georeferenced at the end
  double end_m = 0.0;   ///< horizontal error there
};

/// The estimator is replaced by another one `gap_s` after it was destroyed.
/// Of the registrations that SP makes while WM is dead or stopped.
enum class Meanwhile { kMissed, kReceivedLate, kNone };

Seen drive(double gap_s, bool gps_after = true, Meanwhile meanwhile = Meanwhile::kMissed) {
  Experiment experiment;
  experiment.drive.length_s = 60.0;
  const std::vector<Truth> truth = make_drive(experiment.drive);
  Sensors sensors(truth, experiment.params, experiment.sensors);
  auto estimator = std::make_unique<Estimator>(experiment.params, test_datum());
  std::optional<Continuation> kept;
  std::size_t killed = 0;
  Seen seen;
  int instants = 0;
  std::int64_t missed = 0;  // registrations
  std::vector<std::pair<std::size_t, RollingMatch>> late;
  std::size_t missed_until = 0;  // the first one that the successor received
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double t = seconds(truth[i].stamp - truth[0].stamp);
    const ImuSample imu = sensors.imu(i);
    RollingMatch match = sensors.scan(i);
    match.missed = kept && missed_until == 0 ? missed : 0;
    const GeodeticFix fix = sensors.gps(i);
    const bool dead = t >= kKilled_s && t < kKilled_s + gap_s;
    if (dead && estimator) {
      kept = estimator->continuation();
      killed = i - 1;
      estimator.reset();
    }
    if (dead) {
      if (i % 10 == 0 && meanwhile == Meanwhile::kMissed) ++missed;
      if (i % 10 == 0 && meanwhile == Meanwhile::kReceivedLate) late.push_back({i, match});
      continue;
    }
    const bool starts = !estimator;
    if (starts) {
      estimator = std::make_unique<Estimator>(experiment.params, test_datum());
      estimator->resume(*kept);
    }
    estimator->add(imu);
    for (const auto& [k, old] : late) estimator->add(truth[k].stamp, old);
    late.clear();
    if (i % 10 == 0) {
      estimator->add(truth[i].stamp, match);
      if (kept) missed_until = i;
    }
    if (i % 20 == 0 && (gps_after || !kept)) estimator->add(truth[i].stamp, fix);
    estimator->fuse();
    estimator->clear_innovations();
    if (!kept) continue;
    const FilterState& s = estimator->state();
    if (starts) {
      seen.georeferenced_at_once = s.bookkeeping.georeferenced;
      const Pose moved = kept->T_local_vehicle.inverse() * estimator->T_local_vehicle();
      const Pose truly = truth[killed].T_world_vehicle.inverse() * truth[i].T_world_vehicle;
      seen.local_step_m = (moved.p - truly.p).norm();
    }
    if (t < kKilled_s + gap_s + 1.0) seen.first = estimator->mode();
    const Vec2 error = (s.belief.x.T_world_vehicle.p - truth[i].T_world_vehicle.p).head<2>();
    const Mat<2> P = s.belief.P.block<2, 2>(kPosition, kPosition);
    seen.placed = s.bookkeeping.georeferenced;
    seen.end_m = error.norm();
    seen.worst_m = std::max(seen.worst_m, error.norm());
    seen.outside += error.dot(P.inverse() * error) > 16.0 ? 1.0 : 0.0;
    ++instants;
  }
  seen.outside /= instants;
  return seen;
}

TEST(WmCheckpoint, ASuccessorNavigatesAtOnce) {
  for (const double gap_s : {0.1, 0.4, 1.0, 1.4}) {
    const Seen seen = drive(gap_s);
    EXPECT_TRUE(seen.georeferenced_at_once) << gap_s;
    EXPECT_EQ(seen.first, Mode::kGpsInsLadar) << gap_s;
    EXPECT_LT(seen.worst_m, 1.5) << gap_s;
    EXPECT_LT(seen.outside, 0.02) << gap_s;
    EXPECT_LT(seen.local_step_m, 0.1 + 2.0 * gap_s * gap_s) << gap_s;
    std::printf("[  RESUMED ] after %.1f s: local step %.2f m, largest error %.2f m\n", gap_s,
                seen.local_step_m, seen.worst_m);
  }
}

// The rolling map of SP, which lives on, bounds the error of the gap.
TEST(WmCheckpoint, WithoutGpsASuccessorKeepsItsPlace) {
  const Seen seen = drive(0.5, false);
  EXPECT_EQ(seen.first, Mode::kGpsInsLadar) << "the age of GPS is kept";
  EXPECT_LT(seen.worst_m, 2.0);
  EXPECT_LT(seen.outside, 0.02);
}

// Longer than any motion can be predicted: the map of SP, which has tracked the vehicle, places it.
TEST(WmCheckpoint, AfterALongGapTheRollingMapPlacesTheVehicle) {
  for (const double gap_s : {2.0, 3.0, 4.9}) {
    const Seen seen = drive(gap_s, false);
    EXPECT_TRUE(seen.placed) << gap_s;
    EXPECT_LT(seen.end_m, 2.0) << gap_s;
    EXPECT_LT(seen.outside, 0.05) << gap_s;
    std::printf("[  RESUMED ] after %.1f s: error at the end %.2f m\n", gap_s, seen.end_m);
    // WM was stopped, and receives the registrations of the gap after the INS.
    EXPECT_TRUE(drive(gap_s, false, Meanwhile::kReceivedLate).placed) << gap_s;
  }
  // SP was silent, too: where the vehicle is now is unknown, and not claimed.
  EXPECT_FALSE(drive(3.0, false, Meanwhile::kNone).placed);
}

class WmCheckpointNode : public testing::Test {
 protected:
  explicit WmCheckpointNode(const DriveScript& script = {}) : truth_(make_drive(script)) {
    begin_sensors();
    Result<CheckpointOwner> created = CheckpointOwner::create();
    EXPECT_TRUE(created.ok());
    owner_ = std::move(created).value();
    start();
  }
  /// Their map begins, too.
  void begin_sensors() { sensors_.emplace(truth_, config_.params, SensorScript{}); }
  void start(std::uint64_t program = 1, std::int64_t run_id = 1) {
    if (node_) killed_.push_back(std::move(node_));  // the bus holds the addresses of its inboxes
    node_ = std::make_unique<WmNode>(config_, &bus_);
    auto memory = CheckpointMemory::open(owner_.path(), node_->checkpoint_layout(), program);
    ASSERT_TRUE(memory.ok()) << memory.error().message;
    node_->use(std::move(memory).value(), Publisher{run_id, 1, 1});
  }
  /// Runs the node over truth_[begin, end) with the INS, registrations, fixes and points.
  void run(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Stamp now = truth_[i].stamp;
      ins_t m = message(sensors_->imu(i));
      gps_fix_t fix = message(now, sensors_->gps(i));
      ins_out_.publish(&m);
      if (i % 10 == 0) publish_scan(i);
      if (i % 20 == 0) gps_out_.publish(&fix);
      cycle(now);
    }
  }
  void publish_scan(std::size_t i) {
    registration_t m = message(truth_[i].stamp, sensors_->scan(i));
    registration_out_.publish(&m);
    if (!points_) return;
    points_t p{};
    p.utime = m.utime;
    p.map_epoch = m.map_epoch;
    std::copy(std::begin(m.q_target_vehicle), std::end(m.q_target_vehicle), p.q_rolling_vehicle);
    std::copy(std::begin(m.p_target_vehicle_m), std::end(m.p_target_vehicle_m),
              p.p_rolling_vehicle_m);
    for (int x = 0; x < lines_; ++x) {
      for (int y = -20; y <= 20; ++y) {
        p.x_m.push_back(6.0F + 0.3F * static_cast<float>(x));
        p.y_m.push_back(0.4F * static_cast<float>(y));
        p.z_m.push_back(-0.5F + hills_m_ * std::sin(0.5F * (p.x_m.back() + moved_m_)));
      }
    }
    p.n = static_cast<std::int32_t>(p.x_m.size());
    points_out_.publish(&p);
  }
  void cycle(Stamp now) {
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now);
    stages_.start_cycle();
    node_->run({0, now, now, now + config_.info.budget, &stages_});
    stages_.end_cycle();
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now);
  }
  [[nodiscard]] static int known_cells(const map_patch_t& m) {
    return static_cast<int>(std::count_if(m.flags.begin(), m.flags.end(), [](auto flags) {
      return (flags & map_patch_t::FLAG_UNKNOWN) == 0;
    }));
  }
  [[nodiscard]] std::string newest_event(const std::string& code = "state.resumed") {
    std::string text;
    for (; !events_.empty(); events_.pop()) {
      if (events_.front()->code == code) text = events_.front()->text;
    }
    return text;
  }

  WmConfig config_;
  LocalBus bus_;
  std::vector<Truth> truth_;
  std::optional<Sensors> sensors_;
  bool points_ = true;
  int lines_ = 60;
  float hills_m_ = 0.0F;
  float moved_m_ = 0.0F;
  StageClock stages_;
  CheckpointOwner owner_;
  std::unique_ptr<WmNode> node_;
  std::vector<std::unique_ptr<WmNode>> killed_;
  Inbox<nav_state_t> nav_states_{&bus_, channel::kWmNavState, 64};
  Inbox<map_patch_t> patches_{&bus_, channel::kWmMapPatch, 4};
  Inbox<event_t> events_{&bus_, channel::kWmEvent, 64};
  Outbox<ins_t> ins_out_{&bus_, channel::kIns};
  Outbox<gps_fix_t> gps_out_{&bus_, channel::kGpsFix};
  Outbox<registration_t> registration_out_{&bus_, channel::kSpRegistration};
  Outbox<points_t> points_out_{&bus_, channel::kSpPoints};
};

TEST_F(WmCheckpointNode, FrameLocalEpochAndTerrainContinue) {
  run(1, 4000);
  const nav_state_t before = *nav_states_.latest();
  const int known = known_cells(*patches_.latest());
  ASSERT_GT(known, 1000);
  start();
  points_ = false;
  for (std::size_t i = 4000; i < 4040; ++i) {
    (void)sensors_->imu(i);
    if (i % 10 == 0) (void)sensors_->scan(i);
  }
  run(4040, 4080);
  const nav_state_t after = *nav_states_.latest();
  EXPECT_NE(newest_event().find("continued from"), std::string::npos);
  EXPECT_EQ(after.local_utime, before.local_utime);
  EXPECT_EQ(after.map_epoch, before.map_epoch);
  EXPECT_EQ(after.rolling_valid, 1);
  EXPECT_EQ(after.world_valid, 1);
  EXPECT_LE(after.world_resets, before.world_resets + 1) << "by the error of 0.4 s at most";
  EXPECT_EQ(after.mode, before.mode);
  EXPECT_EQ(after.datum_lat_deg, before.datum_lat_deg);
  EXPECT_GT(known_cells(*patches_.latest()), known / 2);
}

// The vehicle has driven some metres meanwhile: ground seen before would lie beside what is seen
// now.
TEST_F(WmCheckpointNode, FrameLocalAndTerrainBeginAgainIfNothingCoversTheGap) {
  run(1, 4000);
  const nav_state_t before = *nav_states_.latest();
  const int known = known_cells(*patches_.latest());
  start();
  points_ = false;
  // For 2 s, in which SP was silent, too: no sequence number is missing.
  for (std::size_t i = 4000; i < 4200; ++i) {
    (void)sensors_->imu(i);
    if (i % 10 == 0) (void)sensors_->scan(i);
  }
  run(4200, 4240);
  const nav_state_t after = *nav_states_.latest();
  EXPECT_NE(newest_event("input.none").find("begin again"), std::string::npos);
  EXPECT_GT(after.local_utime, before.local_utime);
  for (; !patches_.empty(); patches_.pop()) {
  }
  points_ = true;
  run(4240, 4270);
  ASSERT_EQ(patches_.latest()->local_utime, after.local_utime);
  EXPECT_LT(known_cells(*patches_.latest()), known / 2) << "ground of a few scans only";
}

TEST_F(WmCheckpointNode, TheStateOfAnotherProgramIsNotUsed) {
  run(1, 2000);
  const std::int64_t received = nav_states_.account().received;
  start(2);
  run(2000, 2100);
  EXPECT_EQ(newest_event(), "");
  EXPECT_EQ(nav_states_.account().received, received) << "it levels itself";
}

TEST_F(WmCheckpointNode, AStateThatIsOldIsNotUsed) {
  run(1, 2000);
  start();
  run(2600, 2601);
  EXPECT_NE(newest_event().find("start without belief and terrain"), std::string::npos);
}

// It may have ended the successor.
TEST_F(WmCheckpointNode, AStateWhoseSuccessorEndedSoonIsNotUsedAgain) {
  run(1, 2000);
  start();
  run(2000, 2500);
  EXPECT_NE(newest_event().find("continued from"), std::string::npos);
  start();
  run(2500, 2501);
  EXPECT_NE(newest_event().find("soon after"), std::string::npos);
}

TEST_F(WmCheckpointNode, AStateWhoseSuccessorRanForLongIsUsed) {
  run(1, 2000);
  start();
  run(2000, 3100);
  (void)newest_event();
  start();
  run(3100, 3101);
  EXPECT_NE(newest_event().find("continued from"), std::string::npos);
}

class WmCheckpointAtRest : public WmCheckpointNode {
 protected:
  WmCheckpointAtRest() : WmCheckpointNode({30.0, 35.0}) { hills_m_ = 0.6F; }
  /// The vehicle stands for 15 s, then everything starts again, 3 s later.
  void restart_all() {
    run(1, kEnd);
    before_ = *nav_states_.latest();
    known_ = known_cells(*patches_.latest());
    for (; !patches_.empty(); patches_.pop()) {
    }
    start(1, 2);
    begin_sensors();
    lines_ = 12;  // of the 60 that were seen
  }
  /// Flag of the cell at a place in frame local.
  [[nodiscard]] static int unknown_at(const map_patch_t& m, double x_m, double y_m) {
    const int i = static_cast<int>(std::floor(x_m / m.cell_m)) - m.first_i;
    const int j = static_cast<int>(std::floor(y_m / m.cell_m)) - m.first_j;
    return m.flags[static_cast<std::size_t>(j * m.width + i)] & map_patch_t::FLAG_UNKNOWN;
  }
  /// Whether the ground at a place, frame local of its process, is known in the memory.
  [[nodiscard]] bool kept_at(double x_m, double y_m) {
    const CheckpointLayout layout = node_->checkpoint_layout();
    const auto memory = CheckpointMemory::open(owner_.path(), layout, 1);
    std::vector<std::byte> row(layout.row_bytes);
    const double edge_m = 0.5 * config_.terrain.cell_m;
    const int i = static_cast<int>(std::floor(x_m / edge_m));
    const int j = static_cast<int>(std::floor(y_m / edge_m));
    const auto count = static_cast<int>(layout.rows);
    if (!(*memory)->read_row(static_cast<std::size_t>((j % count + count) % count), row.data())) {
      return false;
    }
    std::array<int, 2> lowest{};  // of the row
    TerrainCell cell;
    std::memcpy(lowest.data(), row.data(), sizeof lowest);
    std::memcpy(
        &cell,
        row.data() + sizeof lowest + static_cast<std::size_t>(i - lowest[0]) * sizeof(TerrainCell),
        sizeof cell);
    return lowest[1] == j && cell.scans > 0;
  }
  static constexpr std::size_t kEnd = 1500;
  nav_state_t before_{};
  int known_ = 0;
};

TEST_F(WmCheckpointAtRest, AnotherRunContinuesWithTheTerrainAhead) {
  restart_all();
  run(kEnd + 300, kEnd + 700);
  EXPECT_NE(newest_event().find("start with the terrain"), std::string::npos);
  ASSERT_FALSE(patches_.empty());
  const map_patch_t after = *patches_.latest();
  EXPECT_GT(after.local_utime, before_.local_utime) << "another frame";
  EXPECT_EQ(unknown_at(after, 11.0, 3.0), 0) << "not in the new scans";
  EXPECT_EQ(unknown_at(after, 8.0, 3.0), 0);
  EXPECT_NE(unknown_at(after, 14.0, 3.0), 0) << "farther than the first scan verifies";
}

TEST_F(WmCheckpointAtRest, AScanThatIsOldWhileTheProcessRunsMakesTheTerrainOld) {
  run(1, kEnd);
  Stamp now = truth_[kEnd].stamp;
  for (int k = 0; k < 700; ++k) cycle(now += from_seconds(1.0));  // all sensors are silent
  start(1, 2);
  cycle(now + from_seconds(1.0));
  EXPECT_NE(newest_event().find("start without belief and terrain"), std::string::npos);
}

TEST(WmCheckpoint, AVehicleWhoseVelocityIsUnknownIsNotAtRest) {
  Belief belief = initial_belief(WmParams{}, Stamp{});
  EXPECT_FALSE(at_rest(belief));
  belief.P.block<3, 3>(kVelocity, kVelocity) = 1e-4 * Mat3::Identity();
  EXPECT_TRUE(at_rest(belief));
  belief.x.v_world = Vec3(0.0, 0.2, 0.0);
  EXPECT_FALSE(at_rest(belief));
}

TEST_F(WmCheckpointAtRest, NoPatchIsPublishedBeforeAScanHasVerifiedTheTerrain) {
  restart_all();
  points_ = false;
  run(kEnd + 300, kEnd + 1300);
  EXPECT_TRUE(patches_.empty());
}

TEST_F(WmCheckpointAtRest, TheTerrainOfAnotherPlaceIsNotUsed) {
  restart_all();
  moved_m_ = 3.0F;
  run(kEnd + 300, kEnd + 1300);
  EXPECT_NE(newest_event().find("start without the terrain"), std::string::npos);
  ASSERT_FALSE(patches_.empty());
  EXPECT_LT(known_cells(*patches_.latest()), known_ / 2);
}

// The process may end before it would have written each row once.
TEST_F(WmCheckpointAtRest, NothingOfADiscardedTerrainIsLeftInTheMemory) {
  restart_all();
  ASSERT_TRUE(kept_at(15.0, 3.0));
  ASSERT_TRUE(kept_at(15.0, -3.0));
  moved_m_ = 3.0F;
  std::string text;
  for (std::size_t k = kEnd + 300; text.empty(); k += 10) {
    ASSERT_LT(k, kEnd + 1300);
    run(k, k + 10);
    text = newest_event();
  }
  ASSERT_NE(text.find("start without the terrain"), std::string::npos);
  EXPECT_FALSE(kept_at(15.0, 3.0));
  EXPECT_FALSE(kept_at(15.0, -3.0));
}

TEST_F(WmCheckpointAtRest, TerrainIsUsedAtMostThreeTimesWithoutProof) {
  restart_all();
  for (std::size_t k = 0; k <= 3; ++k) {
    run(kEnd + 300 + 300 * k, kEnd + 600 + 300 * k);
    EXPECT_NE(newest_event().find(k < 3 ? "start with the terrain" : "soon after"),
              std::string::npos)
        << k;
    start(1, 3 + static_cast<std::int64_t>(k));
    begin_sensors();
  }
}

TEST_F(WmCheckpointAtRest, StartsThatDoNotUseTheTerrainDoNotCount) {
  restart_all();
  for (std::int64_t k = 0; k < 5; ++k) {
    cycle(truth_[kEnd + 300].stamp);  // no INS
    start(1, 3 + k);
  }
  begin_sensors();
  run(kEnd + 300, kEnd + 600);
  EXPECT_NE(newest_event().find("start with the terrain"), std::string::npos);
}

TEST_F(WmCheckpointAtRest, TerrainThatIsOldIsNotUsed) {
  restart_all();
  cycle(truth_[kEnd].stamp + from_seconds(700.0));
  EXPECT_NE(newest_event().find("start without belief and terrain"), std::string::npos);
}

// Where it came to rest is unknown.
TEST_F(WmCheckpointNode, TheTerrainOfAVehicleThatMovedIsNotUsedByAnotherRun) {
  run(1, 2000);
  start(1, 2);
  run(2100, 2101);
  EXPECT_NE(newest_event().find("start without belief and terrain"), std::string::npos);
}

}  // namespace
}  // namespace rcs::wm
