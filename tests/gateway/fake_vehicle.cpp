#include "tests/gateway/fake_vehicle.h"

#include <algorithm>
#include <cstdlib>

#include "lcmtypes/channels.h"
#include "rcs/base/check.h"

namespace rcs::gateway::test {
namespace {

/// Of one run with the gateway, which inherits the variable.
std::unique_ptr<LcmBus> open_bus() {
  (void)setenv(kRunIdVariable, "1", 1);  // NOLINT(concurrency-mt-unsafe): one thread yet
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  RCS_CHECK(bus.ok());
  return std::move(bus).value();
}

}  // namespace

FakeVehicle::FakeVehicle()
    : bus_(open_bus()),
      timeline_(bus_.get(), &stop_),
      nav_states_(bus_.get(), channel::kWmNavState),
      wm_cycles_(bus_.get(), channel::kWmCycle),
      bg_(bus_.get(), "bg", channel::kBgCommand, channel::kBgStop, channel::kBgStatus,
          SubordinateParams{}),
      mission_(bus_.get(), "mission", channel::kMissionCommand, channel::kBgStop,
               channel::kMissionStatus, SubordinateParams{}) {
  nav_state_.mode = nav_state_t::MODE_GPS_INS_LADAR;
  nav_state_.pose_valid = 1;
  nav_state_.world_valid = 1;
  nav_state_.q_world_vehicle[0] = 1.0;
  nav_state_.q_local_vehicle[0] = 1.0;
  nav_state_.p_world_vehicle_m[1] = -7.5;
  for (int i = 0; i < 6; ++i) nav_state_.cov_world_pose[i][i] = 0.25;
  nav_state_.datum_lat_deg = 39.125;
  nav_state_.datum_lon_deg = -77.25;
  wm_cycle_.node = "wm";
  wm_cycle_.overruns = 3;
}

bool FakeVehicle::run_until(const std::function<bool()>& done, Duration limit) {
  const Stamp end = timeline_.now() + limit;
  while (timeline_.now() < end) {
    while (timeline_.advance(clock_.next()) == Timeline::Step::kDelivered) {
    }
    const Stamp now = timeline_.now();
    if (!clock_.due(now)) return done();  // stopped from outside
    clock_.advance(now);
    cycle(now);
    if (done()) return true;
  }
  return false;
}

void FakeVehicle::cycle(Stamp now) {
  nav_state_.utime = to_utime(now);
  nav_state_.p_world_vehicle_m[0] += 0.1;
  nav_states_.publish(&nav_state_);
  wm_cycle_.utime = to_utime(now);
  wm_cycles_.publish(&wm_cycle_);

  bg_.take(now);
  for (const stop_t& stop : bg_.stops()) latch_.engage(stop);
  if (bg_.is_new()) commands_.push_back(*bg_.command());
  const command_t* const c = bg_.command();
  const bool lasting = c != nullptr && (c->kind == command_t::KIND_GOTO ||
                                        c->kind == command_t::KIND_EMERGENCY_STOP);
  StatusReport report{status_t::STATUS_DONE, "at rest", __LINE__, "", 0, 0};
  if (bg_.is_new() && c->kind == command_t::KIND_RELEASE) {
    (void)latch_.release(c->stop_id, c->issuer, false, Stamp::max());
    (void)latch_.step(now);
    bg_.release_stops(latch_.take_released());
  } else if (lasting && bg_.valid(now)) {
    report.status = status_t::STATUS_EXEC;
    report.state = "obeying";
  } else if (lasting) {
    report.status = status_t::STATUS_ERROR;
    report.reason = "the command is over";
  }
  report.stops = &latch_.stops();
  if (latch_.engaged()) report.emergency_stop = status_t::STOP_PERSISTED;
  bg_.report(now, report);

  mission_.take(now);
  if (mission_.is_new()) tasks_.push_back(*mission_.command());
  const bool on_task = mission_.valid(now) && mission_.command()->kind != command_t::KIND_HALT;
  mission_.report(now, {on_task ? status_t::STATUS_EXEC : status_t::STATUS_DONE,
                        on_task ? "DRIVING" : "HOLDING", __LINE__, "", 0, 0});
}

bool FakeVehicle::has_taken(std::int8_t kind) const {
  return std::any_of(commands_.begin(), commands_.end(),
                     [&](const command_t& c) { return c.kind == kind; });
}

bool FakeVehicle::commanded() const { return bg_.valid(timeline_.now()); }

}  // namespace rcs::gateway::test
