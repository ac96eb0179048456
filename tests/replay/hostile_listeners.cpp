#include "tests/replay/hostile_listeners.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/bg/bg_config.h"
#include "modules/gateway/sample_conversion.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/command_port.h"
#include "sim/simulator.h"
#include "tools/rcs/vehicle/top_screen.h"

namespace rcs::test {
namespace {

bool finite(double v) { return std::isfinite(v); }

template <std::size_t N>
bool finite(const double (&values)[N]) {
  return std::all_of(std::begin(values), std::end(values), [](double v) { return finite(v); });
}

template <std::size_t N, std::size_t M>
bool finite(const double (&rows)[N][M]) {
  return std::all_of(std::begin(rows), std::end(rows), [](const auto& row) { return finite(row); });
}

bool finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

template <std::size_t N>
bool covariance(const double (&c)[N][N]) {
  bool good = finite(c);
  for (std::size_t i = 0; i < N; ++i) good = good && c[i][i] >= 0.0;
  return good;
}

bool pose(const double (&q)[4], const double (&p)[3]) {
  Pose T;
  return from_message(q, p, &T);
}

template <class T>
bool decode(const std::uint8_t* data, std::size_t size, T* m) {
  return m->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
}

/// On a plane, without a LADAR: only its drive commands are tested here.
sim::Scenario plane() {
  sim::Scenario s;
  s.duration_s = 3.0;
  s.course.waypoints_world = {{0.0, 0.0}, {50.0, 0.0}};
  s.world.rocks.per_m2 = 0.0;
  s.world.vegetation.bushes_per_m2 = 0.0;
  s.world.vegetation.trees_per_m2 = 0.0;
  s.world.vegetation.grass_height_m = 0.0;
  s.commanded = true;
  s.ladar = sim::LadarKind::kNone;
  return s;
}

}  // namespace

void Statements::judge(Stamp due, std::string_view channel, const std::uint8_t* data,
                       std::size_t size) {
  const int count = due >= count_from_ ? 1 : 0;
  const auto take = [&](auto message) {
    RCS_CHECK(decode(data, size, &message));
    judge(message, count);
  };
  if (channel == channel::kSpRegistration) take(registration_t{});
  if (channel == channel::kSpPoints) take(points_t{});
  if (channel == channel::kWmNavState) take(nav_state_t{});
  if (channel == channel::kWmInnovation) take(innovation_t{});
  if (channel == channel::kWmIntegrity) take(integrity_t{});
  if (channel == channel::kWmSubfilter) take(subfilter_t{});
  if (channel == channel::kWmMapPatch) take(map_patch_t{});
  if (channel == channel::kBgDrive) take(drive_t{});
  if (channel == channel::kBgPlan) take(plan_t{});
  if (channel == channel::kWmEvent) {
    event_t m{};
    RCS_CHECK(decode(data, size, &m));
    clock_stepped_ = clock_stepped_ || m.code == "clock.step";
  }
}

void Statements::judge(const registration_t& m, int count) {
  RCS_CHECK(pose(m.q_target_vehicle, m.p_target_vehicle_m));
  RCS_CHECK(covariance(m.information) && finite(m.observability));
  RCS_CHECK(finite(m.mean_distance_m) && finite(m.rms_m) && finite(m.overlap));
  RCS_CHECK(finite(m.correction_m) && finite(m.correction_rad));
  RCS_CHECK(m.used_units <= m.granted_units);
  if (m.target == registration_t::TARGET_ROLLING) registrations += count;
}

void Statements::judge(const points_t& m, int /*count*/) {
  RCS_CHECK(pose(m.q_rolling_vehicle, m.p_rolling_vehicle_m));
  RCS_CHECK(finite(m.x_m) && finite(m.y_m) && finite(m.z_m));
}

void Statements::judge(const nav_state_t& m, int count) {
  RCS_CHECK(pose(m.q_world_vehicle, m.p_world_vehicle_m));
  RCS_CHECK(pose(m.q_local_vehicle, m.p_local_vehicle_m));
  RCS_CHECK(pose(m.q_rolling_vehicle, m.p_rolling_vehicle_m));
  RCS_CHECK(covariance(m.cov_world_pose) && covariance(m.cov_rolling_pose) &&
            covariance(m.cov_v_world));
  RCS_CHECK(finite(m.v_world_mps) && finite(m.rate_vehicle_radps) && finite(m.accel_vehicle_mps2));
  RCS_CHECK(finite(m.gyro_bias_radps) && finite(m.accel_bias_mps2) && finite(m.prior_map_bias_m));
  RCS_CHECK(finite(m.wheel_scale) && finite(m.last_reset_m) && finite(m.distance_since_gps_m));
  RCS_CHECK(m.publish_utime >= belief_published_);
  RCS_CHECK(m.utime >= belief_utime_ || clock_stepped_);
  belief_published_ = m.publish_utime;
  belief_utime_ = m.utime;
  clock_stepped_ = false;
  beliefs += count;
}

void Statements::judge(const innovation_t& m, int /*count*/) {
  RCS_CHECK(finite(m.nis) && finite(m.gate) && finite(m.innovation) && finite(m.sigma));
}

void Statements::judge(const integrity_t& m, int /*count*/) {
  const bool bounded = m.validity == integrity_t::VALID_WORLD;
  RCS_CHECK(finite(m.protection_horizontal_m) == bounded);
  RCS_CHECK(finite(m.protection_vertical_m) == bounded && finite(m.sigma_in_60s_m) == bounded);
  RCS_CHECK(finite(m.gps_test_ratio) && finite(m.ladar_test_ratio));
  RCS_CHECK(finite(m.alert_in_s));
}

void Statements::judge(const subfilter_t& m, int /*count*/) {
  RCS_CHECK(pose(m.q_world_vehicle, m.p_world_vehicle_m) && covariance(m.cov_world_pose));
  RCS_CHECK(m.branch_utime <= m.utime);
}

void Statements::judge(const map_patch_t& m, int /*count*/) {
  RCS_CHECK(m.n == m.width * m.height && finite(m.base_m) && m.cell_m > 0.0);
}

void Statements::judge(const drive_t& m, int count) {
  static const bg::BgConfig limits;  // configuration of the drive
  RCS_CHECK(std::abs(m.speed_mps) <= limits.max_speed_mps);
  RCS_CHECK(std::abs(m.curvature_1pm) <= limits.shape.max_curvature_1pm);
  RCS_CHECK(m.accel_limit_mps2 > 0.0 && m.accel_limit_mps2 <= limits.accel_mps2);
  RCS_CHECK(m.utime > drive_utime_);
  RCS_CHECK(m.valid_until_utime == m.utime + limits.drive_valid.count());
  drive_utime_ = m.utime;
  drive_commands += count;
}

void Statements::judge(const plan_t& m, int /*count*/) {
  std::int64_t utime = m.utime;
  for (const plan_point_t& p : m.point) {
    RCS_CHECK(finite(p.p_m) && finite(p.yaw_rad) && finite(p.speed_mps) && p.utime >= utime);
    utime = p.utime;
  }
  RCS_CHECK(finite(m.cost));
}

struct OtherReaders::Readers {
  explicit Readers(LocalBus* bus)
      : superior(bus, "NOBODY_COMMAND", "NOBODY_STOP", channel::kBgStatus, "operator", {}),
        processes(bus, channel::kSpProcess,
                  [this](const process_t& m, Stamp t) { top.on_process(m, t); }),
        cycles(bus, channel::kSpCycle, [this](const cycle_t& m, Stamp t) { top.on_cycle(m, t); }),
        events(bus, channel::kWmEvent, [this](const event_t& m, Stamp t) { top.on_event(m, t); }),
        statuses(bus, channel::kBgStatus,
                 [this](const status_t& m, Stamp t) {
                   top.on_status(m, t);
                   superior.step(t);
                   (void)superior.progress(t);
                 }),
        beliefs(bus, channel::kWmNavState,
                [this](const nav_state_t& m, Stamp t) {
                  top.on_nav(m, t);
                  view_from_outside(m);
                }),
        commands(bus, channel::kBgDrive,
                 [this](const drive_t& /*m*/, Stamp t) { move_vehicle_to(t); }) {}

  static void view_from_outside(const nav_state_t& m) {
    rcs_VehicleState out{};
    if (!gateway::to_sample(m, Duration(0), &out)) return;
    RCS_CHECK(finite(out.p_world_vehicle_m) && finite(out.cov_world_pose));
  }

  void move_vehicle_to(Stamp t) {
    if (!vehicle) return;
    SourceEvent event;
    while (vehicle->peek() <= t) {
      vehicle->take(&event);
      truth_t truth{};
      if (event.channel != channel::kSimTruth) continue;
      RCS_CHECK(decode(event.data.data(), event.data.size(), &truth));
      RCS_CHECK(pose(truth.q_world_vehicle, truth.p_world_vehicle_m));
    }
    const sim::DriveModel& model = vehicle->commanded_vehicle()->model();
    const sim::DriveParams limits;
    RCS_CHECK(model.speed_mps() <= limits.speed_max_mps &&
              model.speed_mps() >= -limits.reverse_max_mps);
    RCS_CHECK(std::abs(model.curvature_1pm()) <= limits.curvature_max_1pm);
  }

  evaluation::TopModel top;
  CommandPort superior;
  std::optional<sim::Simulator> vehicle;
  Tap<process_t> processes;
  Tap<cycle_t> cycles;
  Tap<event_t> events;
  Tap<status_t> statuses;
  Tap<nav_state_t> beliefs;
  Tap<drive_t> commands;
};

OtherReaders::OtherReaders(LocalBus* bus, std::string_view channel)
    : readers_(std::make_unique<Readers>(bus)) {
  if (channel != channel::kBgDrive) return;  // its world takes a long time to generate
  readers_->vehicle.emplace(plane());
  readers_->vehicle->listen(bus, Duration(0));
}

OtherReaders::~OtherReaders() {
  const evaluation::TopView view = readers_->top.view(from_utime(1'002'000'000));
  RCS_CHECK(!cli::plain_text(cli::top_lines(view)).empty());
}

}  // namespace rcs::test
