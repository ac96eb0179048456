#pragma once
// Reports second publishers of a node's channels, and changes of their owners. Live only.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/event_t.hpp"
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
    Report changes;
    std::int64_t reported_changes = 0;  ///< of the owner
    std::int64_t reported = 0;          ///< rejected messages
    std::vector<Stranger> strangers;
  };
  void report_change(Watched* watched, Stamp now);
  void report_rejection(Watched* watched, Stamp now);
  /// Of a publisher of the channel; further ones than kStrangers share one.
  Report* report_of(Watched* watched, const Publisher& stranger);

  static constexpr std::size_t kStrangers = 8;

  Bus* bus_;
  std::string node_;
  NodeInfo info_;
  PeriodicClock clock_{kPeriod};
  std::vector<Watched> watched_;
};

/// What an event publisher.rejected states.
struct Rejection {
  std::string_view channel;
  std::int64_t publisher_id = 0;
  std::int64_t run_id = 0;
};
/// @param m  an event of any code; it must outlive the result
/// @return nullopt: another event
[[nodiscard]] std::optional<Rejection> rejection_of(const event_t& m);

}  // namespace rcs
