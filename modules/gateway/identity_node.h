#pragma once
// Reports the end of the validity of the vehicle's own keys: events, and a note in the gateway's
// NodeStatus.

#include <cstdint>
#include <string>

#include "modules/gateway/identity_watch.h"
#include "rcs/dds/identity.h"
#include "rcs/node/report.h"

namespace rcs::gateway {

class IdentityReport {
 public:
  /// UTC in microseconds since 1970, in which validity is stated.
  using WallClock = std::int64_t (*)();

  /// @param vehicle  the name of the identity
  IdentityReport(dds::Validity validity, std::string vehicle, WallClock wall_clock);

  /// Once a cycle.
  void update(Stamp now, Report* report);
  /// Empty while the end is far.
  [[nodiscard]] const std::string& note() const { return note_; }

 private:
  dds::Validity validity_;
  std::string vehicle_;
  WallClock wall_clock_;
  IdentityWatch watch_;
  std::string note_;
};

}  // namespace rcs::gateway
