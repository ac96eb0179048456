#pragma once
// Reports what arrived on the bus and could not be delivered. Live only.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/node.h"
#include "rcs/node/report.h"

namespace rcs {

/// Runs next to a process's node.
class BusWatch final : public Node {
 public:
  static constexpr Duration kPeriod = from_seconds(1.0);

  BusWatch(LcmBus* bus, std::string_view node);

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }
  void run(const Cycle& cycle) override;

 private:
  const LcmBus* bus_;
  NodeInfo info_;
  PeriodicClock clock_{kPeriod};
  std::int64_t reported_ = 0;
  Report report_;
};

}  // namespace rcs
