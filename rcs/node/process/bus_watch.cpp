#include "rcs/node/process/bus_watch.h"

#include <fmt/format.h>

#include "lcmtypes/events.h"

namespace rcs {
namespace {

constexpr Duration kReportInterval = from_seconds(10.0);

}  // namespace

BusWatch::BusWatch(LcmBus* bus, std::string_view node)
    : bus_(bus),
      info_{fmt::format("{}_bus", node), kPeriod, Duration::zero()},
      report_(bus, node, kReportInterval) {}

void BusWatch::run(const Cycle& cycle) {
  clock_.advance(cycle.now);
  const UdpmReceiver::Account account = bus_->receipts();
  if (account.total() == reported_) return;
  reported_ = account.total();
  report_.publish(
      cycle.now, event::kBusRejected,
      "not delivered so far: {} malformed datagrams, {} incomplete messages, {} datagrams "
      "of other computers, {} messages because too many waited, {} datagrams because the "
      "kernel's buffer was full",
      account.malformed, account.incomplete, account.foreign, account.dropped, account.lost);
}

}  // namespace rcs
