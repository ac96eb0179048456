// Hostile input, as a list: each kind is sent to each node that reads it while the vehicle drives.
// It is counted in the status of the node or reported in an event, no node crashes (hostile_drive()
// checks that and the messages of the nodes), and the following valid messages are used.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "modules/registration/registration.h"
#include "tests/replay/hostile_drive.h"

namespace rcs::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

template <class T>
T decoded(const Bytes& bytes) {
  T m{};
  EXPECT_EQ(m.decode(bytes.data(), 0, static_cast<int>(bytes.size())),
            static_cast<int>(bytes.size()));
  return m;
}

/// All valid messages of a drive, by channel.
class Ears final : public BusTap {
 public:
  void on_deliver(Stamp /*due*/, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override {
    received_[std::string(channel)].push_back({data, data + size});
  }

  template <class T>
  [[nodiscard]] std::vector<T> all(const std::string& channel) const {
    std::vector<T> out;
    const auto found = received_.find(channel);
    if (found == received_.end()) return out;
    for (const Bytes& bytes : found->second) out.push_back(decoded<T>(bytes));
    return out;
  }
  template <class T>
  [[nodiscard]] T last(const std::string& channel) const {
    const std::vector<T> messages = all<T>(channel);
    EXPECT_FALSE(messages.empty()) << channel;
    return messages.empty() ? T{} : messages.back();
  }

  /// The published counters of an input of a node.
  [[nodiscard]] input_account_t account(const std::string& node, const std::string& input) const {
    const cycle_t cycle = last<cycle_t>(node + "_CYCLE");
    for (const input_account_t& a : cycle.input) {
      if (a.channel == input) return a;
    }
    ADD_FAILURE() << node << " does not read " << input;
    return {};
  }
  /// The texts of a node's events of a code.
  [[nodiscard]] std::vector<std::string> events(const std::string& node,
                                                const std::string& code) const {
    std::vector<std::string> texts;
    for (const event_t& e : all<event_t>(node + "_EVENT")) {
      if (e.code == code) texts.push_back(e.text);
    }
    return texts;
  }

 private:
  std::map<std::string, std::vector<Bytes>> received_;
};

Ears drive_with(const std::string& channel, const std::vector<Bytes>& packets) {
  Ears ears;
  hostile_drive(channel, packets, &ears);
  return ears;
}

const Ears& clean_drive() {
  static const Ears ears = drive_with("NOBODY", {});
  return ears;
}

/// The middle message of a channel, without a number: with one a second datagram would be a copy,
/// which the inbox drops.
template <class T>
T good(const char* channel) {
  const std::vector<T> all = clean_drive().all<T>(channel);
  EXPECT_FALSE(all.empty()) << channel;
  T message = all[all.size() / 2];
  message.seq = 0;
  return message;
}

/// The middle facet of a channel as a scan of its own, newer than all of the drive.
template <class Facet>
Facet one_facet_scan(const char* channel) {
  Facet facet = good<Facet>(channel);
  facet.utime = facet.reference_utime = 1'000'600'000;
  facet.scan_id = 100;
  facet.facet = 0;
  facet.facet_count = 1;
  return facet;
}

/// Readers of each channel.
struct Reader {
  const char* node;
  const char* channel;
};
constexpr Reader kReaders[] = {
    {"SP", channel::kLadarRanges}, {"SP", channel::kLadarPoints},
    {"SP", channel::kIns},         {"SP", channel::kWmNavState},
    {"WM", channel::kIns},         {"WM", channel::kGpsFix},
    {"WM", channel::kOdometry},    {"WM", channel::kSpRegistration},
    {"WM", channel::kSpPoints},    {"BG", channel::kBgCommand},
    {"BG", channel::kWmNavState},  {"BG", channel::kWmMapPatch},
    {"WM", channel::kWmPathQuery},
};

/// There is no query during the drive.
path_query_t path_query() {
  path_query_t m{};
  m.utime = 1'000'000'000;
  m.issuer = "test";
  m.serial = 1;
  m.n = 2;
  m.x_m = {10.0, 50.0};
  m.y_m = {0.0, 20.0};
  return m;
}

Bytes sample(const std::string& name) {
  if (name == channel::kLadarRanges) return encode(good<ladar_ranges_t>(channel::kLadarRanges));
  if (name == channel::kLadarPoints) return encode(good<ladar_points_t>(channel::kLadarPoints));
  if (name == channel::kIns) return encode(good<ins_t>(channel::kIns));
  if (name == channel::kGpsFix) return encode(good<gps_fix_t>(channel::kGpsFix));
  if (name == channel::kOdometry) return encode(good<odometry_t>(channel::kOdometry));
  if (name == channel::kSpPoints) return encode(good<points_t>(channel::kSpPoints));
  if (name == channel::kBgCommand) return encode(good<command_t>(channel::kBgCommand));
  if (name == channel::kWmMapPatch) return encode(good<map_patch_t>(channel::kWmMapPatch));
  if (name == channel::kWmPathQuery) return encode(path_query());
  if (name == channel::kWmNavState) return encode(good<nav_state_t>(channel::kWmNavState));
  return encode(good<registration_t>(channel::kSpRegistration));
}

/// They are counted as malformed by each reader of the channel, and no valid message is lost.
void expect_malformed(const std::string& channel, const std::vector<Bytes>& packets) {
  const Ears ears = drive_with(channel, packets);
  for (const Reader& reader : kReaders) {
    if (channel != reader.channel) continue;
    SCOPED_TRACE(std::string(reader.node) + " reads " + channel);
    const input_account_t account = ears.account(reader.node, channel);
    EXPECT_EQ(account.malformed, static_cast<std::int64_t>(packets.size()));
    EXPECT_EQ(account.received, clean_drive().account(reader.node, channel).received);
    EXPECT_EQ(account.dropped, 0);
  }
}

Bytes with_int32(Bytes bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) {
    bytes.at(at + i) = static_cast<std::uint8_t>(value >> (24 - 8 * i));
  }
  return bytes;
}

/// Malformed with each invalid length at offset `at`.
void expect_length_guarded(const std::string& channel, std::size_t at) {
  std::vector<Bytes> packets;
  for (const std::uint32_t length : {0x7fffffffU, 0xffffffffU, 0x80000000U, 0x20000000U}) {
    packets.push_back(with_int32(sample(channel), at, length));
  }
  expect_malformed(channel, packets);
}

bool names(const std::vector<std::string>& texts, const std::string& what) {
  return std::any_of(texts.begin(), texts.end(),
                     [&](const std::string& text) { return text.find(what) != std::string::npos; });
}

TEST(HostileInput, ACleanDriveHasNoComplaints) {
  for (const Reader& reader : kReaders) {
    EXPECT_EQ(clean_drive().account(reader.node, reader.channel).malformed, 0);
    for (const event_t& e : clean_drive().all<event_t>(std::string(reader.node) + "_EVENT")) {
      EXPECT_TRUE(e.severity == event_t::SEVERITY_INFO || e.code == "world.reset" ||
                  e.code == "path.none")
          << e.node << ": " << e.code << ": " << e.text;
    }
  }
}

TEST(HostileInput, GarbageAndWrongFingerprintsAreCounted) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> byte(0, 255);
  Bytes garbage(300);
  for (std::uint8_t& b : garbage) b = static_cast<std::uint8_t>(byte(random));
  for (const Reader& reader : kReaders) {
    const Bytes message = sample(reader.channel);
    Bytes another_type = message;
    another_type[3] ^= 1;
    Bytes longer = message;
    longer.push_back(0);
    const Bytes shorter(message.begin(), message.end() - 1);
    expect_malformed(reader.channel, {{}, garbage, another_type, longer, shorter});
  }
}

TEST(HostileInput, InvalidLengthsAreCounted) {
  constexpr std::size_t kInt32 = 4;
  // Where nothing follows the arrays, a message without elements ends with their length.
  expect_length_guarded(channel::kLadarRanges, encode(ladar_ranges_t{}).size() - kInt32);
  expect_length_guarded(channel::kSpPoints, encode(points_t{}).size() - kInt32);
  expect_length_guarded(channel::kWmMapPatch, encode(map_patch_t{}).size() - kInt32);
  // Three lengths, two of them behind arrays.
  expect_length_guarded(channel::kLadarPoints, encode(ladar_points_t{}).size() - 3 * kInt32);
  // Behind the fingerprint, utime, seq, both ids, scan_id, target and map_epoch.
  expect_length_guarded(channel::kSpRegistration, 8 + 5 * 8 + 1 + 4);
  // Behind the fingerprint, utime, seq and both ids: a string's.
  expect_length_guarded(channel::kBgCommand, 8 + 4 * 8);
  expect_length_guarded(channel::kWmPathQuery, 8 + 4 * 8);
  // The positions follow after the serial.
  expect_length_guarded(channel::kWmPathQuery,
                        encode(path_query()).size() - 4 * sizeof(double) - kInt32);
}

TEST(HostileInput, NonFiniteRangesAndPointsAreOmittedAndReported) {
  auto ranges = one_facet_scan<ladar_ranges_t>(channel::kLadarRanges);
  ranges.range_m[0] = std::numeric_limits<float>::quiet_NaN();
  ranges.range_m[1] = std::numeric_limits<float>::infinity();
  auto points = one_facet_scan<ladar_points_t>(channel::kLadarPoints);
  points.x_m[0] = std::numeric_limits<float>::quiet_NaN();
  points.z_m[1] = -std::numeric_limits<float>::infinity();
  for (const Ears& ears : {drive_with(channel::kLadarRanges, {encode(ranges)}),
                           drive_with(channel::kLadarPoints, {encode(points)})}) {
    EXPECT_TRUE(
        names(ears.events("SP", "points.not_finite"), "scan 100: 2 ranges or points rejected"));
    const auto last = ears.last<registration_t>(channel::kSpRegistration);
    EXPECT_EQ(last.account.failed, 0);
    EXPECT_EQ(last.account.answered,
              clean_drive().last<registration_t>(channel::kSpRegistration).account.answered + 1);
  }
}

TEST(HostileInput, AnEmptyScanGetsAResultAndCountsAsFailed) {
  auto empty = one_facet_scan<ladar_ranges_t>(channel::kLadarRanges);
  empty.n = 0;
  empty.range_m.clear();
  const Ears ears = drive_with(channel::kLadarRanges, {encode(empty)});
  for (const auto& m : ears.all<registration_t>(channel::kSpRegistration)) {
    EXPECT_EQ(m.stop == registration_t::STOP_EMPTY, m.scan_id == 100) << m.scan_id;
  }
  EXPECT_EQ(ears.last<registration_t>(channel::kSpRegistration).account.failed, 1);
  EXPECT_FALSE(ears.events("SP", "registration.failed").empty());
}

TEST(HostileInput, EmptyPointsTerrainAndRoutesAreHarmless) {
  auto points = good<points_t>(channel::kSpPoints);
  points.n = 0;
  points.x_m = points.y_m = points.z_m = {};
  EXPECT_EQ(
      drive_with(channel::kSpPoints, {encode(points)}).account("WM", channel::kSpPoints).malformed,
      0);

  map_patch_t patch{};
  patch.cell_m = 0.4;
  const Ears terrain = drive_with(channel::kWmMapPatch, {encode(patch)});
  EXPECT_TRUE(names(terrain.events("BG", "input.rejected"), channel::kWmMapPatch));

  auto command = good<command_t>(channel::kBgCommand);
  command.utime = 1'000'600'000;
  command.serial = command.utime;
  command.task = 0;
  command.n = 0;
  command.waypoint.clear();
  const Ears route = drive_with(channel::kBgCommand, {encode(command)});
  const std::vector<status_t> statuses = route.all<status_t>(channel::kBgStatus);
  EXPECT_TRUE(std::any_of(statuses.begin(), statuses.end(), [](const status_t& s) {
    return s.status == status_t::STATUS_ERROR && s.echo_serial == 1'000'600'000;
  }));
  EXPECT_NE(statuses.back().echo_serial, 1'000'600'000);
  EXPECT_EQ(statuses.back().status, int{status_t::STATUS_EXEC});
}

/// NaN and an implausible number in each field of a message in turn: the node rejects and reports
/// them.
/// @param places  the fields, in `scratch`
template <class Message, std::size_t N>
void expect_refused(const char* node, const char* channel, double* (&places)[N], Message* scratch) {
  SCOPED_TRACE(std::string(node) + " reads " + channel);
  const auto message = good<Message>(channel);
  std::vector<Bytes> packets;
  for (double* place : places) {
    for (const double value : {kNan, kInf, 1e300}) {
      *scratch = message;
      *place = value;
      packets.push_back(encode(*scratch));
    }
  }
  const Ears ears = drive_with(channel, packets);
  EXPECT_TRUE(names(ears.events(node, "input.rejected"), channel));
  EXPECT_EQ(ears.account(node, channel).received, clean_drive().account(node, channel).received +
                                                      static_cast<std::int64_t>(packets.size()));
}

TEST(HostileInput, NonFiniteNumbersAreRejectedAndReported) {
  ins_t ins{};
  double* ins_places[] = {&ins.delta_angle_rad[0], &ins.delta_v_mps[2]};
  expect_refused("WM", channel::kIns, ins_places, &ins);
  gps_fix_t gps{};
  double* gps_places[] = {&gps.lat_deg, &gps.lon_deg, &gps.height_m, &gps.sigma_enu_m[1]};
  expect_refused("WM", channel::kGpsFix, gps_places, &gps);
  odometry_t odometry{};
  double* odometry_places[] = {&odometry.speed_mps, &odometry.sigma_speed_mps};
  expect_refused("WM", channel::kOdometry, odometry_places, &odometry);
  registration_t match{};
  double* match_places[] = {&match.q_target_vehicle[1], &match.p_target_vehicle_m[0],
                            &match.information[2][2]};
  expect_refused("WM", channel::kSpRegistration, match_places, &match);
  points_t points{};
  double* points_places[] = {&points.q_rolling_vehicle[0], &points.p_rolling_vehicle_m[2]};
  expect_refused("WM", channel::kSpPoints, points_places, &points);
  nav_state_t nav{};
  double* nav_places[] = {&nav.q_local_vehicle[0], &nav.p_local_vehicle_m[1], &nav.v_world_mps[0],
                          &nav.p_world_vehicle_m[2]};
  expect_refused("BG", channel::kWmNavState, nav_places, &nav);
  expect_refused("SP", channel::kWmNavState, nav_places, &nav);
}

TEST(HostileInput, RepeatedAndBackwardStampsAreRejectedAndReported) {
  const auto expect_refused = [](auto message, const char* channel) {
    SCOPED_TRACE(channel);
    const Bytes repeated = encode(message);
    auto wild = message;
    wild.utime = std::numeric_limits<std::int64_t>::min() + 1;
    message.utime -= 3'000'000;
    const Bytes backward = encode(message);
    message.utime += 3'600'000'000;
    const Bytes future = encode(message);
    for (const Bytes& packet : {repeated, backward, future, encode(wild)}) {
      const Ears ears = drive_with(channel, {packet, packet});
      EXPECT_TRUE(names(ears.events("WM", "input.rejected"), channel));
      EXPECT_EQ(ears.last<nav_state_t>(channel::kWmNavState).mode,
                int{nav_state_t::MODE_GPS_INS_LADAR});
    }
  };
  expect_refused(good<ins_t>(channel::kIns), channel::kIns);
  expect_refused(good<gps_fix_t>(channel::kGpsFix), channel::kGpsFix);
  expect_refused(good<odometry_t>(channel::kOdometry), channel::kOdometry);
  expect_refused(good<registration_t>(channel::kSpRegistration), channel::kSpRegistration);
}

TEST(HostileInput, RepeatedAndOldFacetsAreRejectedAndCounted) {
  auto facet = clean_drive().all<ladar_ranges_t>(channel::kLadarRanges).front();
  facet.seq = 0;  // no copy of a datagram
  const Bytes old = encode(facet);
  facet.facet_count = 0;
  const Bytes unsound = encode(facet);
  const Ears ears = drive_with(channel::kLadarRanges, {old, old, unsound});
  EXPECT_EQ(ears.last<registration_t>(channel::kSpRegistration).account.facets_refused, 3);
  EXPECT_FALSE(ears.events("SP", "facet.stale").empty());
  EXPECT_FALSE(ears.events("SP", "facet.rejected").empty());
}

TEST(HostileInput, AFacetFromTheFutureLosesOneScanOnly) {
  auto facet = one_facet_scan<ladar_ranges_t>(channel::kLadarRanges);
  facet.utime = facet.reference_utime = 5'000'000'000'000'000;
  facet.scan_id = std::numeric_limits<std::int64_t>::max();
  const Ears ears = drive_with(channel::kLadarRanges, {encode(facet)});
  const auto stop = ears.last<registration_t>(channel::kSpRegistration).stop;
  EXPECT_TRUE(registration::usable(static_cast<registration::Stop>(stop))) << int{stop};
}

TEST(HostileInput, RepeatedAndOutdatedCommandsAreNotExecuted) {
  auto command = clean_drive().all<command_t>(channel::kBgCommand).front();
  const Bytes repeated = encode(command);
  command.serial += 1;
  command.utime += 3'600'000'000;
  const Bytes future = encode(command);
  command.utime = std::numeric_limits<std::int64_t>::min();
  const Bytes past = encode(command);
  const Ears ears = drive_with(channel::kBgCommand, {repeated, future, past});
  for (const auto& s : ears.all<status_t>(channel::kBgStatus)) {
    EXPECT_NE(s.echo_serial, command.serial);
  }
  EXPECT_EQ(ears.last<status_t>(channel::kBgStatus).echo_serial,
            clean_drive().last<status_t>(channel::kBgStatus).echo_serial);
}

}  // namespace
}  // namespace rcs::test
