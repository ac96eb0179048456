// Late, repeated, reordered and jumping inputs.
#include <gtest/gtest.h>

#include <algorithm>

#include "modules/wm/history.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

/// Two seconds of all measurements, from a state that is already georeferenced and moving.
/// Without fault detection.
constexpr auto kContent = [](const Measurement&, const ImuSample*, const FilterState&) {
  return std::optional<FilterState>();
};

class HistoryTest : public ::testing::Test {
 protected:
  HistoryTest() : truth_(make_drive(script())) {
    params_.history.lag = from_milliseconds(3000.0);
    Sensors sensors(truth_, params_, {});
    start_.belief = initial_belief(params_, truth_[kFirst].stamp);
    start_.belief.x.T_world_vehicle = truth_[kFirst].T_world_vehicle;
    start_.belief.x.v_world = truth_[kFirst].v_world;
    start_.belief.x.inertial = true;
    start_.bookkeeping.ins_stamp = truth_[kFirst].stamp;
    start_.bookkeeping.georeferenced = true;
    const LocalFrame frame(test_datum());
    for (std::size_t i = kFirst + 1; i <= kFirst + 200; ++i) {
      inputs_.push_back({truth_[i].stamp, sensors.imu(i)});
      const Stamp between = truth_[i].stamp - Duration(3'000);
      if (i % 20 == 0) {
        GeodeticFix fix = sensors.gps(i);
        fix.fix.p_world = frame.to_world(fix.antenna);
        inputs_.push_back({between, fix.fix});
      }
      if (i % 10 == 0) inputs_.push_back({between, sensors.scan(i)});
      if (i % 10 == 5) inputs_.push_back({between, sensors.odometry(i)});
    }
  }
  static DriveScript script() {
    DriveScript s;
    s.length_s = 16.0;
    return s;
  }
  History make() const {
    History h{Model(params_)};
    h.restart(start_);
    return h;
  }

  static constexpr std::size_t kFirst = 1000;
  WmParams params_;
  std::vector<Truth> truth_;
  FilterState start_;
  std::vector<Measurement> inputs_;
};

TEST_F(HistoryTest, OrderOfArrivalDoesNotMatter) {
  std::vector<Innovation> records;
  records.reserve(10000);
  History in_order = make();
  for (const Measurement& m : inputs_) ASSERT_EQ(in_order.insert(m), Reason::kAccepted);
  in_order.fuse(&records);

  std::mt19937 random(1);
  for (int trial = 0; trial < 3; ++trial) {
    std::vector<Measurement> shuffled = inputs_;
    // Each input is up to half a second late, and all received inputs are fused each time.
    std::uniform_int_distribution<int> late_us(0, 500'000);
    std::vector<std::pair<Stamp, std::size_t>> arrival;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      arrival.emplace_back(inputs_[i].stamp + Duration(late_us(random)), i);
    }
    std::sort(arrival.begin(), arrival.end());
    History reordered = make();
    for (std::size_t k = 0; k < arrival.size(); ++k) {
      ASSERT_EQ(reordered.insert(inputs_[arrival[k].second]), Reason::kAccepted);
      if (k % 7 == 0) reordered.fuse(&records);
    }
    reordered.fuse(&records);
    EXPECT_EQ(reordered.head().belief.P, in_order.head().belief.P);
    EXPECT_EQ(reordered.head().belief.x.T_world_vehicle.p,
              in_order.head().belief.x.T_world_vehicle.p);
    EXPECT_EQ(reordered.head().bookkeeping.T_local_vehicle.p,
              in_order.head().bookkeeping.T_local_vehicle.p);
    EXPECT_EQ(reordered.head().belief.x.stamp, in_order.head().belief.x.stamp);
  }
}

TEST_F(HistoryTest, DiscardedSamplesOfTheInsLeaveNoTrace) {
  std::vector<Innovation> records;
  records.reserve(10000);
  const Stamp since = truth_[kFirst + 120].stamp;
  const Stamp until = truth_[kFirst + 150].stamp;
  History never = make();
  for (const Measurement& m : inputs_) {
    if (m.imu() != nullptr && m.stamp >= since) continue;
    ASSERT_EQ(never.insert(m), Reason::kAccepted);
  }
  never.fuse(&records);
  History h = make();
  for (Measurement m : inputs_) {
    if (m.imu() != nullptr && m.stamp >= until) continue;  // rejected when they are received
    if (m.imu() != nullptr && m.stamp >= since) std::get<ImuSample>(m.value).delta_angle *= -1.0;
    ASSERT_EQ(h.insert(m), Reason::kAccepted);
    if (m.stamp < until) h.fuse(&records);
  }
  h.discard_ins(since, until);
  h.fuse(&records);
  EXPECT_EQ(h.head().belief.P, never.head().belief.P);
  EXPECT_EQ(h.head().belief.x.stamp, never.head().belief.x.stamp);
  EXPECT_EQ(h.head().belief.x.T_world_vehicle.p, never.head().belief.x.T_world_vehicle.p);
  EXPECT_GT(never.head().belief.x.stamp, until);
}

TEST_F(HistoryTest, EachMeasurementIsReportedOnce) {
  std::vector<Innovation> records;
  records.reserve(10000);
  History h = make();
  for (auto it = inputs_.rbegin(); it != inputs_.rend(); ++it) {
    h.insert(*it);
    h.fuse(&records);
  }
  const auto gps = std::count_if(records.begin(), records.end(), [](const Innovation& i) {
    return i.source == Source::kGpsPosition;
  });
  EXPECT_EQ(gps, 10);
}

TEST_F(HistoryTest, MeasurementsNewerThanTheInsWaitUntilItIsSilent) {
  std::vector<Innovation> records;
  records.reserve(100);
  History h = make();
  ASSERT_EQ(h.insert(inputs_[0]), Reason::kAccepted);
  RollingMatch scan;
  scan.seeded = true;
  const Stamp ahead = inputs_[0].stamp + Duration(50'000);
  ASSERT_EQ(h.insert({ahead, scan}), Reason::kAccepted);
  h.fuse(&records);
  EXPECT_EQ(h.head().belief.x.stamp, inputs_[0].stamp);
  const Stamp silent = inputs_[0].stamp + Duration(300'000);
  ASSERT_EQ(h.insert({silent, scan}), Reason::kAccepted);
  h.fuse(&records);
  EXPECT_EQ(h.head().belief.x.stamp, inputs_[0].stamp) << "the first still waits for the INS";
}

TEST_F(HistoryTest, InvalidStampsAreRejectedWithReasons) {
  std::vector<Innovation> records;
  records.reserve(10000);
  params_.history.lag = from_milliseconds(500.0);
  History h = make();
  for (const Measurement& m : inputs_) {
    h.insert(m);
    h.fuse(&records);
    h.finish(kContent);
  }
  EXPECT_EQ(h.insert(inputs_.back()), Reason::kRepeated);
  EXPECT_EQ(h.insert(inputs_.front()), Reason::kLate);
  Measurement far = inputs_.back();
  far.stamp += std::chrono::seconds(60);
  EXPECT_EQ(h.insert(far), Reason::kInvalid);
}

TEST_F(HistoryTest, AFullRingDropsTheOldest) {
  params_.history.capacity = 64;
  std::vector<Innovation> records;
  records.reserve(10000);
  History h = make();
  for (const Measurement& m : inputs_) {
    EXPECT_EQ(h.insert(m), Reason::kAccepted);
    h.fuse(&records);
  }
  EXPECT_EQ(h.head().belief.x.stamp, truth_[kFirst + 200].stamp);
  EXPECT_EQ(h.insert(inputs_.front()), Reason::kLate);
}

TEST_F(HistoryTest, ALostInsSampleIsBridged) {
  std::vector<Innovation> records;
  records.reserve(10000);
  History whole = make(), holed = make();
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    whole.insert(inputs_[i]);
    if (i % 40 != 20) holed.insert(inputs_[i]);
  }
  whole.fuse(&records);
  holed.fuse(&records);
  const Vec3 d = whole.head().belief.x.T_world_vehicle.p - holed.head().belief.x.T_world_vehicle.p;
  EXPECT_LT(d.norm(), 0.1);
  EXPECT_TRUE(holed.head().belief.x.inertial);
}

// INS and odometry are correct except for one stamp of the odometry.
TEST_F(HistoryTest, AClockAheadDoesNotAdvanceTheBelief) {
  std::vector<Innovation> records;
  records.reserve(10000);
  History history = make();
  Stamp newest = Stamp::min();
  for (const Measurement& m : inputs_) {
    newest = std::max(newest, m.stamp);
    ASSERT_EQ(history.insert(m), Reason::kAccepted);
    Measurement ahead = m;
    ahead.stamp += from_seconds(2.0);
    if (std::holds_alternative<OdometrySample>(m.value)) (void)history.insert(ahead);
    history.fuse(&records);
    EXPECT_LE(history.head().belief.x.stamp, newest);
  }
}

// A true silence of the INS is confirmed by other sources.
TEST_F(HistoryTest, ASilentInsIsConfirmedByTwoOtherSources) {
  std::vector<Innovation> records;
  records.reserve(10000);
  History history = make();
  const Stamp last_ins = inputs_[inputs_.size() / 2].stamp;
  for (const Measurement& m : inputs_) {
    if (m.imu() != nullptr && m.stamp > last_ins) continue;
    ASSERT_EQ(history.insert(m), Reason::kAccepted);
    history.fuse(&records);
  }
  EXPECT_GT(history.head().belief.x.stamp, last_ins + from_seconds(0.7));
}

}  // namespace
}  // namespace rcs::wm
