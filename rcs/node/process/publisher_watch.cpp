#include "rcs/node/process/publisher_watch.h"

#include <fmt/format.h>

#include <algorithm>

#include "lcmtypes/events.h"

namespace rcs {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);

}  // namespace

PublisherWatch::PublisherWatch(Bus* bus, std::string_view node,
                               const std::vector<const InboxBase*>& inboxes)
    : bus_(bus), node_(node), info_{fmt::format("{}_publishers", node), kPeriod, Duration::zero()} {
  for (const InboxBase* inbox : inboxes) watched_.push_back({inbox, 0, {}});
}

Report* PublisherWatch::report_of(Watched* watched, const Publisher& stranger) {
  std::vector<Stranger>& known = watched->strangers;
  const auto found = std::find_if(known.begin(), known.end(), [&](const Stranger& s) {
    return s.publisher.run_id == stranger.run_id &&
           s.publisher.publisher_id == stranger.publisher_id;
  });
  if (found != known.end()) return &found->report;
  if (known.size() < kStrangers) {
    known.push_back({stranger, Report(bus_, node_, kReportInterval)});
  }
  return &known.back().report;
}

void PublisherWatch::run(const Cycle& cycle) {
  clock_.advance(cycle.now);
  for (Watched& w : watched_) {
    const InboxBase::Account& account = w.inbox->account();
    if (account.rejected == w.reported) continue;
    w.reported = account.rejected;
    const Publisher& owner = w.inbox->owner();
    const Publisher& other = account.rejected_of;
    report_of(&w, other)->publish(
        cycle.now, event::kPublisherRejected,
        "{}: messages of publisher {:x} (run {:x}) rejected, {} so far; the channel belongs to "
        "publisher {:x} (run {:x})",
        w.inbox->channel(), other.publisher_id, other.run_id, account.rejected, owner.publisher_id,
        owner.run_id);
  }
}

}  // namespace rcs
