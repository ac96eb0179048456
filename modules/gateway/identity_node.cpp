#include "modules/gateway/identity_node.h"

#include <fmt/format.h>

#include <utility>

#include "lcmtypes/events.h"

namespace rcs::gateway {

IdentityReport::IdentityReport(dds::Validity validity, std::string vehicle, WallClock wall_clock)
    : validity_(std::move(validity)),
      vehicle_(std::move(vehicle)),
      wall_clock_(wall_clock),
      watch_(validity_.end_utime) {}

void IdentityReport::update(Stamp now, Report* report) {
  using State = IdentityWatch::State;
  const std::int64_t wall_utime = wall_clock_();
  const State state = watch_.state(wall_utime);
  note_.clear();
  if (state == State::kEndsSoon) note_ = "keys expire at " + dds::end_text(validity_);
  if (state == State::kExpired) note_ = "keys expired at " + dds::end_text(validity_);
  if (!watch_.take_due(wall_utime, now)) return;
  const std::string remedy = dds::renewal_text(validity_, vehicle_);
  if (state == State::kExpired) {
    report->publish(now, event::kGatewayIdentityExpired,
                    "{} expired at {}: no operator is connected; {} and restart the gateway",
                    validity_.path, dds::end_text(validity_), remedy);
    return;
  }
  report->publish(now, event::kGatewayIdentityExpires,
                  "{} expires at {}, in {} days; then no operator is connected: {}", validity_.path,
                  dds::end_text(validity_), watch_.days_left(wall_utime), remedy);
}

}  // namespace rcs::gateway
