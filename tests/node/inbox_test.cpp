#include "rcs/node/bus/inbox.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <limits>
#include <random>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/tap.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::encode;
using test::odometry;

class InboxTest : public testing::Test {
 protected:
  void send(std::int64_t seq, std::int64_t utime, Stamp arrival) {
    const std::vector<std::uint8_t> bytes = encode(odometry(seq, utime));
    inbox_.receive(bytes.data(), bytes.size(), arrival);
  }

  LocalBus bus_;
  Inbox<odometry_t> inbox_{&bus_, "ODOMETRY", 3};
};

TEST_F(InboxTest, DeliversMessagesInOrder) {
  for (std::int64_t i = 1; i <= 3; ++i) send(i, 10 * i, at_ms(i));
  EXPECT_EQ(inbox_.oldest_arrival(), at_ms(1));
  for (int i = 1; i <= 3; ++i) {
    ASSERT_NE(inbox_.front(), nullptr);
    EXPECT_EQ(inbox_.front()->seq, i);
    EXPECT_EQ(inbox_.front_arrival(), at_ms(i));
    inbox_.pop();
  }
  EXPECT_EQ(inbox_.front(), nullptr);
  EXPECT_EQ(inbox_.oldest_arrival(), Stamp::max());
}

TEST_F(InboxTest, KeepsTheNewestMessagesAndCountsTheDropped) {
  for (int i = 1; i <= 10; ++i) send(i, i, at_ms(i));
  EXPECT_EQ(inbox_.size(), 3U);
  EXPECT_EQ(inbox_.front()->seq, 8);
  EXPECT_EQ(inbox_.account().received, 10);
  EXPECT_EQ(inbox_.account().dropped, 7);
  EXPECT_EQ(inbox_.account().gaps, 0);
  EXPECT_EQ(inbox_.latest()->seq, 10);
  EXPECT_EQ(inbox_.account().dropped, 7) << "skipping to the latest is the reader's choice";
}

TEST_F(InboxTest, CountsGapsCopiesAndLateMessages) {
  for (const int seq : {5, 6, 9, 9, 8, 10, 8}) send(seq, 0, at_ms(0));
  EXPECT_EQ(inbox_.account().gaps, 1) << "7; 8 was late";
  EXPECT_EQ(inbox_.account().late, 1);
  EXPECT_EQ(inbox_.account().repeated, 1 + 1) << "9 and 8 again";
  EXPECT_EQ(inbox_.account().received, 5) << "copies are dropped";
}

TEST_F(InboxTest, CopiesDisplaceNothing) {
  for (int i = 1; i <= 3; ++i) send(i, i, at_ms(i));
  for (int k = 0; k < 3000; ++k) send(1 + k % 3, 1 + k % 3, at_ms(4));
  EXPECT_EQ(inbox_.account().dropped, 0);
  EXPECT_EQ(inbox_.front()->seq, 1);
}

TEST_F(InboxTest, NewMessagesOfAWriterThatDoesNotCountAreNoCopies) {
  for (int i = 1; i <= 3; ++i) send(0, i, at_ms(i));
  for (int i = 4; i <= 6; ++i) send(7, i, at_ms(i));
  EXPECT_EQ(inbox_.account().received, 6);
  EXPECT_EQ(inbox_.account().repeated, 0);
}

class OwnedInboxTest : public testing::Test {
 protected:
  static constexpr std::int64_t kRun = 5;

  OwnedInboxTest() {
    bus_.set_publisher({kRun, 1});
    bus_.require_owners();
  }
  template <class T>
  void send(Inbox<T>* inbox, const Publisher& from, std::int64_t seq, Stamp arrival) {
    T m{};
    m.seq = seq;
    m.utime = to_utime(arrival);
    m.run_id = from.run_id;
    m.publisher_id = from.publisher_id;
    const std::vector<std::uint8_t> bytes = encode(m);
    inbox->receive(bytes.data(), bytes.size(), arrival);
  }

  LocalBus bus_;
};

TEST_F(OwnedInboxTest, AnOutputOfAnotherRunIsRejectedAlsoAsTheFirst) {
  Inbox<nav_state_t> inbox(&bus_, "WM_NAV_STATE", 8);
  send(&inbox, {6, 9}, 1, at_ms(0));
  EXPECT_EQ(inbox.account().rejected, 1);
  EXPECT_TRUE(inbox.empty());
  EXPECT_TRUE(inbox.contested(at_ms(900), test::ms(1000)));
  EXPECT_FALSE(inbox.contested(at_ms(1100), test::ms(1000)));
  send(&inbox, {kRun, 2}, 1, at_ms(20));
  EXPECT_EQ(inbox.size(), 1U);
}

TEST_F(OwnedInboxTest, OfTwoDriversTheFirstIsUsedUntilItIsSilent) {
  Inbox<odometry_t> inbox(&bus_, "ODOMETRY", 64);
  for (std::int64_t i = 0; i < 20; ++i) {
    send(&inbox, {8, 3}, 1 + i, at_ms(20 * i));
    send(&inbox, {9, 4}, 1 + i, at_ms(20 * i + 10));
  }
  EXPECT_EQ(inbox.account().received, 20);
  EXPECT_EQ(inbox.account().rejected, 20);
  EXPECT_EQ(inbox.account().rejected_of.publisher_id, 4);
  EXPECT_EQ(inbox.owner().publisher_id, 3);
  for (std::int64_t t = 390; t < 380 + 3000; t += 10) send(&inbox, {9, 4}, t, at_ms(t));
  EXPECT_EQ(inbox.owner().publisher_id, 3) << "in a gap of less than 3 s";
  EXPECT_EQ(inbox.account().owner_changes, 0);
  send(&inbox, {9, 4}, 4000, at_ms(380 + 3000));
  EXPECT_EQ(inbox.account().received, 21);
  EXPECT_EQ(inbox.account().gaps, 0) << "another publisher counts on its own";
  EXPECT_EQ(inbox.account().owner_changes, 1);
  EXPECT_EQ(inbox.account().owner_before.publisher_id, 3);
  EXPECT_EQ(inbox.account().owner_silent, test::ms(3000));
  send(&inbox, {8, 3}, 21, at_ms(3390));
  EXPECT_EQ(inbox.owner().publisher_id, 4) << "the first one is the second now";
}

TEST_F(OwnedInboxTest, ASecondDriverDoesNotUseAGapOfTheFirst) {
  Inbox<odometry_t> inbox(&bus_, "ODOMETRY", 64);
  std::int64_t t = 0;
  for (; t < 1000; t += 10) send(&inbox, {8, 3}, 1 + t, at_ms(t));
  send(&inbox, {9, 4}, 1, at_ms(t));  // one message is enough to be known as a second one
  for (t += 5; t < 3000; t += 10) send(&inbox, {8, 3}, 1 + t, at_ms(t));
  t += 500;  // a gap
  send(&inbox, {9, 4}, 2, at_ms(t));
  EXPECT_EQ(inbox.owner().publisher_id, 3);
  send(&inbox, {8, 3}, 1 + t, at_ms(t + 10));
  EXPECT_EQ(inbox.account().rejected, 2) << "the first one continues";
}

TEST_F(OwnedInboxTest, ADriverThatIsStartedAgainIsAcceptedSoon) {
  // Its first messages may come before the silence of its predecessor is noticed.
  for (const std::int64_t restart : {20, 60, 99, 101, 250, 2000}) {
    Inbox<odometry_t> inbox(&bus_, "ODOMETRY", 1024);
    std::int64_t last = 0;
    for (std::int64_t t = 0; t < 1000; t += 10) send(&inbox, {8, 3}, 1 + t, at_ms(last = t));
    std::int64_t accepted = 0;
    for (std::int64_t t = last + restart; accepted == 0 && t < 10'000; t += 10) {
      send(&inbox, {8, 4}, 1 + t, at_ms(t));
      if (inbox.owner().publisher_id == 4) accepted = t;
    }
    EXPECT_LE(accepted, last + std::max<std::int64_t>(restart, 111)) << "after " << restart;
    EXPECT_EQ(inbox.account().owner_changes, 1);
  }
}

TEST_F(OwnedInboxTest, ASecondDriverOfLongAgoDelaysNoSuccessor) {
  Inbox<odometry_t> inbox(&bus_, "ODOMETRY", 1024);
  send(&inbox, {8, 3}, 1, at_ms(0));
  send(&inbox, {9, 4}, 1, at_ms(5));
  for (std::int64_t t = 10; t <= 5000; t += 10) send(&inbox, {8, 3}, 1 + t, at_ms(t));
  send(&inbox, {8, 5}, 1, at_ms(5000 + 150));
  EXPECT_EQ(inbox.owner().publisher_id, 5);
}

TEST_F(OwnedInboxTest, AnotherRunDelaysNoSuccessor) {
  Inbox<nav_state_t> inbox(&bus_, "WM_NAV_STATE", 256);
  for (std::int64_t t = 0; t < 2000; t += 20) {
    send(&inbox, {kRun, 2}, 1 + t, at_ms(t));
    send(&inbox, {6, 9}, 1 + t, at_ms(t + 10));  // a recording
  }
  send(&inbox, {kRun, 3}, 1, at_ms(1980 + 200));
  EXPECT_EQ(inbox.owner().publisher_id, 3);
}

TEST_F(OwnedInboxTest, AMalformedMessageOwnsNothing) {
  Inbox<odometry_t> inbox(&bus_, "ODOMETRY", 4);
  odometry_t m{};
  m.publisher_id = 7;
  std::vector<std::uint8_t> bytes = encode(m);
  bytes.pop_back();
  inbox.receive(bytes.data(), bytes.size(), at_ms(0));
  send(&inbox, {9, 4}, 1, at_ms(1));
  EXPECT_EQ(inbox.account().rejected, 0);
  EXPECT_EQ(inbox.account().received, 1);
}

TEST_F(OwnedInboxTest, CommandsOfAnyoneAreStored) {
  Inbox<command_t> inbox(&bus_, "BG_COMMAND", 4);
  send(&inbox, {8, 3}, 1, at_ms(0));
  send(&inbox, {9, 4}, 1, at_ms(1));
  EXPECT_EQ(inbox.size(), 2U);
}

TEST_F(OwnedInboxTest, CommandsOfSuperiorsWithoutIdsAreNoCopiesOfOneAnother) {
  Inbox<command_t> inbox(&bus_, "BG_COMMAND", 4);
  send(&inbox, {0, 0}, 1, at_ms(0));
  send(&inbox, {0, 0}, 1, at_ms(0));
  EXPECT_EQ(inbox.size(), 2U);
  send(&inbox, {8, 3}, 1, at_ms(0));
  send(&inbox, {8, 3}, 1, at_ms(0));
  EXPECT_EQ(inbox.size(), 3U) << "with an id the second one is a copy";
}

TEST_F(InboxTest, ARestartedWriterLeavesNoGap) {
  for (const int seq : {5, 6, 1, 2}) send(seq, 0, at_ms(0));
  EXPECT_EQ(inbox_.account().gaps, 0);
  EXPECT_EQ(inbox_.account().repeated, 0);
}

TEST_F(InboxTest, ExtremeSequenceNumbersCountOnceAndDoNotOverflow) {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t seq : {kMin, kMax, kMin, std::int64_t{7}, kMax}) send(seq, 0, at_ms(0));
  EXPECT_EQ(inbox_.account().gaps, 3);
  EXPECT_EQ(inbox_.account().repeated, 0);
}

TEST_F(InboxTest, AgeIsSinceTheLastArrivalInNodeTime) {
  EXPECT_EQ(inbox_.account().age(at_ms(7)), Duration(-1));
  send(1, 1'700'000'000'000'000, at_ms(10));  // sensor time of another epoch
  EXPECT_EQ(inbox_.account().age(at_ms(17)), test::ms(7));
  EXPECT_EQ(to_utime(inbox_.account().newest), 1'700'000'000'000'000);
}

TEST_F(InboxTest, MalformedMessagesAreCountedAndDisplaceNothing) {
  for (int i = 1; i <= 3; ++i) send(i, i, at_ms(i));
  std::vector<std::uint8_t> bytes = encode(odometry(4, 4));
  inbox_.receive(bytes.data(), 0, at_ms(4));                 // empty
  inbox_.receive(bytes.data(), bytes.size() - 1, at_ms(4));  // truncated
  bytes.push_back(0);
  inbox_.receive(bytes.data(), bytes.size(), at_ms(4));  // a byte left over
  bytes.pop_back();
  bytes[3] ^= 1;
  inbox_.receive(bytes.data(), bytes.size(), at_ms(4));  // another type's fingerprint
  const std::vector<std::uint8_t> huge(InboxBase::kMaxMessageBytes + 1);
  inbox_.receive(huge.data(), huge.size(), at_ms(4));
  EXPECT_EQ(inbox_.account().malformed, 5);
  EXPECT_EQ(inbox_.account().received, 3);
  EXPECT_EQ(inbox_.account().dropped, 0);
  EXPECT_EQ(inbox_.front()->seq, 1);
}

std::size_t heap_bytes() {
  const struct mallinfo2 heap = mallinfo2();
  return heap.uordblks + heap.hblkhd;
}

TEST(InboxMemory, AFloodOfLongTextsKeepsNoMemory) {
  LocalBus bus;
  Inbox<process_t> alive(&bus, "SP_PROCESS", 4);
  Inbox<command_t> commands(&bus, "BG_COMMAND", 64);
  process_t heartbeat{};
  heartbeat.note.assign(std::size_t{1} << 20, 'x');
  command_t command{};
  command.issuer.assign(std::size_t{1} << 20, 'x');
  const std::vector<std::uint8_t> long_heartbeat = encode(heartbeat);
  const std::vector<std::uint8_t> long_command = encode(command);
  const std::size_t before = heap_bytes();
  for (int k = 0; k < 200; ++k) {
    alive.receive(long_heartbeat.data(), long_heartbeat.size(), at_ms(k));
    commands.receive(long_command.data(), long_command.size(), at_ms(k));
  }
  EXPECT_LT(heap_bytes(), before + (std::size_t{1} << 18));
  int malformed = 0;
  Tap<process_t> tap(
      &bus, "WM_PROCESS", [](const process_t&, Stamp) { FAIL(); }, [&] { ++malformed; });
  tap.receive(long_heartbeat.data(), long_heartbeat.size(), at_ms(0));
  EXPECT_EQ(malformed, 1);
  EXPECT_EQ(alive.account().malformed, 200);
  EXPECT_EQ(commands.account().malformed, 200);
  heartbeat.note = "SCHED_FIFO 50 not granted";
  const std::vector<std::uint8_t> usual = encode(heartbeat);
  alive.receive(usual.data(), usual.size(), at_ms(300));
  EXPECT_EQ(alive.size(), 1U);
}

template <class T>
void expect_accepted(const T& largest) {
  LocalBus bus;
  Inbox<T> inbox(&bus, "ANY", 1);
  const std::vector<std::uint8_t> bytes = encode(largest);
  inbox.receive(bytes.data(), bytes.size(), Stamp());
  EXPECT_EQ(inbox.size(), 1U) << T::getTypeName() << ": " << bytes.size() << " bytes";
}

TEST(InboxMemory, TheLargestMessagesOfTheSystemAreAccepted) {
  map_patch_t patch{};
  patch.n = 512 * 512;  // [wm.terrain] patch
  patch.height_cm.resize(512 * 512);
  patch.step_cm = patch.height_cm;
  patch.slope_deg.resize(512 * 512);
  patch.roughness_cm = patch.flags = patch.slope_deg;
  expect_accepted(patch);
  points_t points{};
  points.n = 20'000;
  points.x_m.resize(20'000);
  points.y_m = points.z_m = points.x_m;
  expect_accepted(points);
  path_query_t query{};
  query.n = 1000;
  query.x_m.resize(1000);
  query.y_m = query.x_m;
  expect_accepted(query);
  path_uncertainty_t uncertainty{};
  uncertainty.n = 1001;
  uncertainty.x_m.resize(1001);
  uncertainty.y_m = uncertainty.travelled_m = uncertainty.x_m;
  uncertainty.sigma_dead_reckoning_m = uncertainty.sigma_with_map_m = uncertainty.x_m;
  expect_accepted(uncertainty);
  command_t command{};
  command.n = 256;  // [gateway] max_waypoints
  command.waypoint.resize(256);
  expect_accepted(command);
  ladar_points_t facet{};
  facet.n = facet.n_index = facet.n_time = 3500;
  facet.x_m.resize(3500);
  facet.y_m = facet.z_m = facet.x_m;
  facet.row.resize(3500);
  facet.col = facet.row;
  facet.dt_us.resize(3500);
  expect_accepted(facet);
}

// Every message type that contains a length, filled so that each array and string has elements.
template <class T>
T sample();

template <>
ladar_ranges_t sample() {
  ladar_ranges_t m{};
  m.n = 4;
  m.range_m = {1, 2, 3, 4};
  return m;
}
template <>
ladar_points_t sample() {
  ladar_points_t m{};
  m.n = m.n_index = m.n_time = 2;
  m.x_m = m.y_m = m.z_m = {1, 2};
  m.row = m.col = {1, 2};
  m.dt_us = {1, 2};
  return m;
}
template <>
points_t sample() {
  points_t m{};
  m.n = 2;
  m.x_m = m.y_m = m.z_m = {1, 2};
  return m;
}
template <>
registration_t sample() {
  registration_t m{};
  m.n_tiles = 2;
  m.tile_id = {1, 2};
  return m;
}
template <>
map_patch_t sample() {
  map_patch_t m{};
  m.n = 2;
  m.height_cm = m.step_cm = {1, 2};
  m.slope_deg = m.roughness_cm = m.flags = {1, 2};
  return m;
}
template <>
path_query_t sample() {
  path_query_t m{};
  m.issuer = "operator";
  m.n = 2;
  m.x_m = m.y_m = {1, 2};
  return m;
}
template <>
path_uncertainty_t sample() {
  path_uncertainty_t m{};
  m.issuer = "operator";
  m.n = 2;
  m.travelled_m = m.x_m = m.y_m = m.sigma_dead_reckoning_m = m.sigma_with_map_m = {1, 2};
  return m;
}
template <>
command_t sample() {
  command_t m{};
  m.issuer = "operator";
  m.n = 2;
  m.waypoint.resize(2);
  return m;
}
template <>
plan_t sample() {
  plan_t m{};
  m.issuer = "operator";
  m.n = 2;
  m.point.resize(2);
  return m;
}
template <>
cycle_t sample() {
  cycle_t m{};
  m.node = "sp";
  m.n_stages = 2;
  m.stage = {{"a", 1}, {"b", 2}};
  m.n_inputs = 1;
  m.input.resize(1);
  m.input[0].channel = "INS";
  return m;
}
template <>
event_t sample() {
  event_t m{};
  m.node = "sp";
  m.code = "map.reseeded";
  m.text = "text";
  return m;
}
template <>
status_t sample() {
  status_t m{};
  m.node = m.issuer = "bg";
  m.state = "EXEC";
  m.reason = "none";
  return m;
}
template <>
nav_state_t sample() {
  return nav_state_t{};
}

template <class T>
class HostileBytes : public testing::Test {};
using MessageTypes = testing::Types<ladar_ranges_t, ladar_points_t, points_t, registration_t,
                                    map_patch_t, command_t, path_query_t, path_uncertainty_t,
                                    plan_t, cycle_t, event_t, status_t, nav_state_t>;
// The comma: an empty variadic argument is not ISO C++17.
TYPED_TEST_SUITE(HostileBytes, MessageTypes, );

TYPED_TEST(HostileBytes, EveryLengthAtEveryOffsetIsHandled) {
  // GIVEN a valid message; every length in it lies at some offset
  LocalBus bus;
  Inbox<TypeParam> inbox(&bus, "ANY", 2);
  const std::vector<std::uint8_t> good = encode(sample<TypeParam>());
  inbox.receive(good.data(), good.size(), Stamp());
  ASSERT_EQ(inbox.account().received, 1);
  // WHEN each 4 bytes in turn are overwritten by a hostile length
  std::int64_t sent = 1;
  for (std::size_t at = 0; at + 4 <= good.size(); ++at) {
    for (const std::uint32_t length :
         {0x80000000U, 0xffffffffU, 0x7fffffffU, 0x20000000U, 0x40000001U, 0x00ffffffU, 0U}) {
      std::vector<std::uint8_t> bytes = good;
      for (std::size_t i = 0; i < 4; ++i) {
        bytes[at + i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
      }
      inbox.receive(bytes.data(), bytes.size(), Stamp());
      ++sent;
    }
  }
  // THEN it is decoded or counted, without a crash
  EXPECT_EQ(inbox.account().received + inbox.account().malformed, sent);
  EXPECT_GT(inbox.account().malformed, 0);
}

TYPED_TEST(HostileBytes, RandomDamageIsHandled) {
  std::mt19937 rng(11);
  LocalBus bus;
  Inbox<TypeParam> inbox(&bus, "ANY", 2);
  const std::vector<std::uint8_t> good = encode(sample<TypeParam>());
  constexpr int kRounds = 20'000;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::uint8_t> bytes = good;
    std::uniform_int_distribution<std::size_t> place(8, good.size() - 1);  // keep the fingerprint
    std::uniform_int_distribution<int> byte(0, 255);
    for (int k = 0; k < 1 + round % 4; ++k) {
      bytes[place(rng)] = static_cast<std::uint8_t>(byte(rng));
    }
    if (round % 5 == 0) bytes.resize(place(rng));
    inbox.receive(bytes.data(), bytes.size(), Stamp());
  }
  EXPECT_EQ(inbox.account().received + inbox.account().malformed, kRounds);
}

}  // namespace
}  // namespace rcs
