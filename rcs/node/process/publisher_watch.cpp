#include "rcs/node/process/publisher_watch.h"

#include <fmt/format.h>

#include "lcmtypes/events.h"

namespace rcs {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);

}  // namespace

PublisherWatch::PublisherWatch(Bus* bus, std::string_view node,
                               const std::vector<const InboxBase*>& inboxes)
    : info_{fmt::format("{}_publishers", node), kPeriod, Duration::zero()} {
  for (const InboxBase* inbox : inboxes) {
    watched_.push_back({inbox, 0, Report(bus, node, kReportInterval)});
  }
}

void PublisherWatch::run(const Cycle& cycle) {
  clock_.advance(cycle.now);
  for (Watched& w : watched_) {
    const InboxBase::Account& account = w.inbox->account();
    if (account.rejected == w.reported) continue;
    w.reported = account.rejected;
    const Publisher& owner = w.inbox->owner();
    const Publisher& other = account.rejected_of;
    w.report.publish(cycle.now, event::kPublisherRejected,
                     "{}: messages of publisher {:x} (run {:x}) rejected, {} so far; the channel "
                     "belongs to publisher {:x} (run {:x})",
                     w.inbox->channel(), other.publisher_id, other.run_id, account.rejected,
                     owner.publisher_id, owner.run_id);
  }
}

}  // namespace rcs
