#include "tests/replay/hostile_drive.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "modules/bg/bg_node.h"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/executor.h"
#include "rcs/node/process/cycle_sinks.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tests/replay/hostile_listeners.h"

namespace rcs::test {
namespace {

// Small, so that a drive takes milliseconds; every node runs within a second.
constexpr char kConfig[] = R"(
[world]
datum_lat_deg = 39.0
datum_lon_deg = -77.0
datum_height_m = 100.0
[ladar]
rows = 8
cols = 16
fov_v_deg = 40.0
mount_m = [0.0, 0.0, 1.0]
isolated_m = 0.0
[sp]
source_voxel_m = 1.0
publish_voxel_m = 0.5
[sp.icp]
min_pairs = 20
max_iterations = 5
[sp.map]
capacity = 1000
voxel_m = 2.0
min_points = 4
[wm]
period_ms = 50.0
[wm.align]
patience_ms = 100.0
course_speed_mps = 0.5
[wm.stillness]
accel_mps2 = 0.01
[wm.history]
capacity = 96
[wm.terrain]
size = 64
patch = 32
ahead_m = 4.0
[bg.search]
max_expansions = 200
horizon_m = 6.0
)";

constexpr std::int64_t kBegin_us = 1'000'000'000;
constexpr std::int64_t kHostile_us = kBegin_us + 600'000;
constexpr std::int64_t kEnd_us = kHostile_us + 700'000;
constexpr std::int64_t kBetweenPackets_us = 20'000;
constexpr double kSpeed_mps = 3.0;  // east

double east_m(std::int64_t utime) {
  return kSpeed_mps * 1e-6 * static_cast<double>(utime - kBegin_us);
}

ins_t ins(std::int64_t utime) {
  ins_t m{};
  m.utime = utime;
  m.interval_us = 20'000;
  // An engine vibrates, so that a steady drive is not mistaken for rest.
  m.delta_v_mps[1] = utime / 20'000 % 2 == 0 ? 0.01 : -0.01;
  m.delta_v_mps[2] = 0.02 * 9.80;
  m.valid = 1;
  return m;
}

odometry_t odometry(std::int64_t utime) {
  odometry_t m{};
  m.utime = utime;
  m.interval_us = 50'000;
  m.speed_mps = kSpeed_mps;
  m.sigma_speed_mps = 0.1;
  m.sigma_yaw_rate_radps = 0.1;
  return m;
}

gps_fix_t gps_fix(std::int64_t utime) {
  const LocalFrame world({radians(39.0), radians(-77.0), {100.0}});
  const Geodetic place = world.to_geodetic({east_m(utime), 0.0, 0.0});
  gps_fix_t m{};
  m.utime = utime;
  m.lat_deg = degrees(place.lat_rad);
  m.lon_deg = degrees(place.lon_rad);
  m.height_m = place.height.m;
  to_message(Vec3(0.1, 0.1, 0.2), m.sigma_enu_m);
  m.has_velocity = 1;
  to_message(Vec3(kSpeed_mps, 0.0, 0.0), m.v_enu_mps);
  to_message(Vec3(0.05, 0.05, 0.05), m.sigma_v_enu_mps);
  m.fix_type = gps_fix_t::FIX_FIXED;
  return m;
}

command_t command(std::int64_t utime) {
  command_t m{};
  m.utime = utime;
  m.issuer = "operator";
  m.serial = utime;
  m.kind = command_t::KIND_GOTO;
  m.valid_until_utime = utime + 2'500'000;
  m.frame = command_t::FRAME_WORLD;
  m.waypoint = {{{30.0, 0.0, 0.0}, 3.0, 5.0}};
  m.n = 1;
  return m;
}

/// Range along a direction from a position in the lane: ground, walls to both sides and at the end.
double range_m(const Vec3& from, const Vec3& direction) {
  struct Plane {
    Vec3 normal;
    double offset;
  };
  const Plane planes[] = {{{0.02, 0.0, 1.0}, 0.0},
                          {{0.0, 1.0, 0.0}, -6.0},
                          {{0.0, 1.0, 0.0}, 6.0},
                          {{1.0, 0.1, 0.0}, 40.0}};
  double nearest = 1e9;
  for (const Plane& p : planes) {
    const double range = (p.offset - p.normal.dot(from)) / p.normal.dot(direction);
    if (range > 0.0) nearest = std::min(nearest, range);
  }
  return nearest < 60.0 ? nearest : 0.0;
}

constexpr int kFacets = 2;
constexpr std::int64_t kBetweenFacets_us = 20'000;
constexpr int kRows = 8;
constexpr int kCols = 16;

std::vector<Vec3> facet_directions(int facet) {
  std::vector<Vec3> out;
  for (int row = facet * kRows / kFacets; row < (facet + 1) * kRows / kFacets; ++row) {
    for (int col = 0; col < kCols; ++col) {
      const double elevation = radians(40.0) * ((row + 0.5) / kRows - 0.5);
      const double azimuth = radians(90.0) * (0.5 - (col + 0.5) / kCols);
      out.emplace_back(std::cos(elevation) * std::cos(azimuth),
                       std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    }
  }
  return out;
}

template <class Message>
Message facet_head(std::int64_t utime, int facet) {
  Message m{};
  m.utime = utime;
  m.reference_utime = utime + (kFacets - 1 - facet) * kBetweenFacets_us;
  // Afterwards in steps: the number of a packet can make at most one of them look old.
  const std::int64_t scan = (m.reference_utime - kBegin_us) / 100'000;
  m.scan_id = m.reference_utime < kHostile_us ? scan : 1000 * scan;
  m.facet = static_cast<std::int16_t>(facet);
  m.facet_count = kFacets;
  m.rows = kRows;
  m.cols = kCols;
  return m;
}

ladar_ranges_t ranges(std::int64_t utime, int facet) {
  auto m = facet_head<ladar_ranges_t>(utime, facet);
  m.first_row = static_cast<std::int16_t>(facet * kRows / kFacets);
  m.facet_rows = kRows / kFacets;
  for (const Vec3& d : facet_directions(facet)) {
    m.range_m.push_back(static_cast<float>(range_m({east_m(utime), 0.0, 1.0}, d)));
  }
  m.n = static_cast<std::int32_t>(m.range_m.size());
  return m;
}

ladar_points_t points(std::int64_t utime, int facet) {
  auto m = facet_head<ladar_points_t>(utime, facet);
  for (const Vec3& d : facet_directions(facet)) {
    const Vec3 p = range_m({east_m(utime), 0.0, 1.0}, d) * d;
    m.x_m.push_back(static_cast<float>(p.x()));
    m.y_m.push_back(static_cast<float>(p.y()));
    m.z_m.push_back(static_cast<float>(p.z()));
  }
  m.n = m.n_time = static_cast<std::int32_t>(m.x_m.size());
  m.dt_us.assign(m.x_m.size(), 0);
  return m;
}

struct Item {
  Stamp due;
  std::string channel;
  Bytes data;
};

/// Messages of the sensors and the operator.
std::vector<Item> good_messages() {
  std::vector<Item> items;
  std::vector<std::int64_t> seq(6, 0);
  const auto say = [&](std::size_t writer, const char* channel, auto message) {
    message.seq = ++seq[writer];
    items.push_back({from_utime(message.utime + 1000), channel, encode(message)});
  };
  // INS and GPS first: messages that arrive before WM has begun are late.
  for (std::int64_t t = kBegin_us; t < kEnd_us; t += 10'000) {
    const std::int64_t ms = (t - kBegin_us) / 1000;
    if (ms % 20 == 0) say(0, channel::kIns, ins(t));
    if (ms % 50 == 0 && ms > 200) say(1, channel::kOdometry, odometry(t));
    if (ms % 200 == 0) say(2, channel::kGpsFix, gps_fix(t));
    if (ms % 500 == 50) say(3, channel::kBgCommand, command(t));
    if (ms < 200 || (ms % 100 != 50 && ms % 100 != 70)) continue;
    const int facet = ms % 100 == 50 ? 0 : 1;
    // Every third scan by the other kind of LADAR.
    if (ms / 100 % 3 == 2) {
      say(4, channel::kLadarPoints, points(t, facet));
    } else {
      say(5, channel::kLadarRanges, ranges(t, facet));
    }
  }
  return items;
}

/// The valid messages, and the packets among them.
class Script final : public EventSource {
 public:
  Script(const std::vector<Item>* good, std::string_view channel, const std::vector<Bytes>* packets)
      : good_(*good), channel_(channel), packets_(*packets) {}

  [[nodiscard]] Stamp peek() override { return std::min(next_good(), next_packet()); }
  void take(SourceEvent* event) override {
    hostile_ = next_packet() < next_good();
    event->channel = hostile_ ? channel_ : good_[taken_].channel;
    event->data = hostile_ ? packets_[sent_++] : good_[taken_++].data;
    fresh_ = true;
  }

  /// Evaluated for each delivered message: whether it was sent here and not by a node.
  [[nodiscard]] bool from_outside() { return std::exchange(fresh_, false); }
  [[nodiscard]] bool hostile() const { return hostile_; }

 private:
  [[nodiscard]] Stamp next_good() const {
    return taken_ < good_.size() ? good_[taken_].due : Stamp::max();
  }
  [[nodiscard]] Stamp next_packet() const {
    if (sent_ == packets_.size()) return Stamp::max();
    return from_utime(kHostile_us + kBetweenPackets_us * static_cast<std::int64_t>(sent_));
  }

  const std::vector<Item>& good_;
  std::string channel_;
  const std::vector<Bytes>& packets_;
  std::size_t taken_ = 0;
  std::size_t sent_ = 0;
  bool fresh_ = false;
  bool hostile_ = false;
};

/// Checks the messages of the nodes; messages from outside are only passed to the listener.
class Judge final : public BusTap {
 public:
  Judge(Script* script, BusTap* listener) : script_(*script), listener_(listener) {}

  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t* data,
                  std::size_t size) override {
    const bool outside = script_.from_outside();
    if (!outside) statements_.judge(due, channel, data, size);
    const bool hostile = outside && script_.hostile();
    if (listener_ != nullptr && !hostile) listener_->on_deliver(due, channel, data, size);
  }
  [[nodiscard]] const Statements& statements() const { return statements_; }

 private:
  Script& script_;
  BusTap* listener_;
  Statements statements_{from_utime(kHostile_us + 200'000)};
};

}  // namespace

const char* hostile_drive_config() { return kConfig; }

void hostile_drive(std::string_view channel, const std::vector<Bytes>& packets, BusTap* listener) {
  static const std::vector<Item> good = good_messages();
  static const Result<ParamFile> file = ParamFile::parse(kConfig, "hostile_drive");
  RCS_CHECK(file.ok());
  LocalBus bus;
  Result<std::unique_ptr<Node>> sp = sp::make_sp_node(*file, &bus);
  Result<std::unique_ptr<Node>> wm = wm::make_wm_node(*file, &bus);
  Result<std::unique_ptr<Node>> bg = bg::make_bg_node(*file, &bus);
  RCS_CHECK(sp.ok() && wm.ok() && bg.ok());
  const OtherReaders others(&bus, channel);
  Script script(&good, channel, &packets);
  Judge judge(&script, listener);
  bus.set_tap(&judge);
  CyclePublisher cycles(&bus);
  LockstepTimeline timeline(&bus, &script, from_milliseconds(100.0));
  run({sp->get(), wm->get(), bg->get()}, timeline, &cycles);

  // Of 5 scans, 10 periods of WM and 10 of BG.
  const Statements& said = judge.statements();
  RCS_CHECK(said.registrations >= 3);
  RCS_CHECK(said.beliefs >= 8);
  RCS_CHECK(said.drive_commands >= 8);
}

}  // namespace rcs::test
