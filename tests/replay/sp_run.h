#pragma once
// SP alone, in lockstep: what it publishes about the scans of a source.

#include <cstdint>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/sp/sp_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/executor.h"
#include "tests/replay/point_scans.h"

namespace rcs::test {

class Registrations final : public Receiver {
 public:
  explicit Registrations(Bus* bus) { bus->subscribe(channel::kSpRegistration, this); }
  void receive(const std::uint8_t* data, std::size_t size, Stamp /*arrival*/) noexcept override {
    registration_t r{};
    RCS_CHECK(r.decode(data, 0, static_cast<int>(size)) > 0);
    all.push_back(r);
  }
  std::vector<registration_t> all;
};

/// @param ladar  further lines of the section [ladar]
/// @return all registrations, in order
inline std::vector<registration_t> registrations_of(EventSource* source, const std::string& ladar) {
  const Result<sp::SpConfig> config =
      sp::load_sp_config(parsed("[ladar]\nmax_range_m = 80.0\n" + ladar + R"([sp]
budget_ms = 80.0
source_voxel_m = 0.5
map_voxel_m = 0.1
)"));
  RCS_CHECK(config.ok());
  LocalBus bus;
  sp::SpNode node(*config, PriorTerrain(), &bus);
  const Registrations registrations(&bus);
  LockstepTimeline timeline(&bus, source, from_milliseconds(100.0));
  run({&node}, timeline, nullptr);
  return registrations.all;
}

inline bool is_usable(const registration_t& r) {
  return registration::usable(static_cast<registration::Stop>(r.stop));
}

inline Pose pose_of(const registration_t& r) {
  Pose T;
  RCS_CHECK(from_message(r.q_target_vehicle, r.p_target_vehicle_m, &T));
  return T;
}

}  // namespace rcs::test
