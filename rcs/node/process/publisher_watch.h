#pragma once
// Reports second publishers of a node's channels. Live only.

#include <string>
#include <string_view>
#include <vector>

#include "rcs/node/bus/inbox.h"
#include "rcs/node/node.h"
#include "rcs/node/report.h"

namespace rcs {

/// Runs next to a process's node.
class PublisherWatch final : public Node {
 public:
  static constexpr Duration kPeriod = from_milliseconds(20.0);

  /// @param inboxes  of the node; they outlive this
  PublisherWatch(Bus* bus, std::string_view node, const std::vector<const InboxBase*>& inboxes);

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }
  void run(const Cycle& cycle) override;

 private:
  /// One a publisher, so that no report suppresses another.
  struct Stranger {
    Publisher publisher;
    Report report;
  };
  struct Watched {
    const InboxBase* inbox;
    std::int64_t reported = 0;  ///< rejected messages
    std::vector<Stranger> strangers;
  };
  /// Of a publisher of the channel; further ones than kStrangers share one.
  Report* report_of(Watched* watched, const Publisher& stranger);

  static constexpr std::size_t kStrangers = 8;

  Bus* bus_;
  std::string node_;
  NodeInfo info_;
  PeriodicClock clock_{kPeriod};
  std::vector<Watched> watched_;
};

}  // namespace rcs
