#include "rcs/node/process/publisher_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

#include "lcmtypes/events.h"

namespace rcs {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
// Of the text of publisher.rejected.
constexpr std::string_view kRejected = ": messages of publisher ";
constexpr std::string_view kOfRun = " (run ";

std::string name_of(const Publisher& publisher) {
  return fmt::format("publisher {} (run {})", id_text(publisher.publisher_id),
                     id_text(publisher.run_id));
}

/// Removes a hexadecimal number from the begin of a text.
std::optional<std::int64_t> take_id(std::string_view* text) {
  std::uint64_t id = 0;
  const char* const end = text->data() + text->size();
  const auto [at, error] = std::from_chars(text->data(), end, id, 16);
  if (error != std::errc()) return std::nullopt;
  text->remove_prefix(static_cast<std::size_t>(at - text->data()));
  return static_cast<std::int64_t>(id);
}

}  // namespace

PublisherWatch::PublisherWatch(Bus* bus, std::string_view node,
                               const std::vector<const InboxBase*>& inboxes)
    : bus_(bus), node_(node), info_{fmt::format("{}_publishers", node), kPeriod, Duration::zero()} {
  for (const InboxBase* inbox : inboxes) {
    watched_.push_back({inbox, Report(bus, node, kReportInterval), 0, 0, {}});
  }
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
    report_change(&w, cycle.now);
    report_rejection(&w, cycle.now);
  }
}

void PublisherWatch::report_change(Watched* watched, Stamp now) {
  const InboxBase& inbox = *watched->inbox;
  const InboxBase::Account& account = inbox.account();
  if (account.owner_changes == watched->reported_changes) return;
  watched->reported_changes = account.owner_changes;
  watched->changes.publish(
      now, event::kPublisherChanged,
      "{}: {} is accepted from now on; {}, to which the channel belonged, was silent for {:.2f} s",
      inbox.channel(), name_of(inbox.owner()), name_of(account.owner_before),
      seconds(account.owner_silent));
}

void PublisherWatch::report_rejection(Watched* watched, Stamp now) {
  const InboxBase& inbox = *watched->inbox;
  const InboxBase::Account& account = inbox.account();
  if (account.rejected == watched->reported) return;
  watched->reported = account.rejected;
  const Publisher& other = account.rejected_of;
  const std::string belongs = inbox.has_owner()
                                  ? name_of(inbox.owner())
                                  : fmt::format("run {}, of which no publisher is known yet",
                                                id_text(bus_->publisher().run_id));
  report_of(watched, other)
      ->publish(now, event::kPublisherRejected,
                "{}{}{}{}{}) rejected, {} so far; the channel belongs to {}", inbox.channel(),
                kRejected, id_text(other.publisher_id), kOfRun, id_text(other.run_id),
                account.rejected, belongs);
}

std::optional<Rejection> rejection_of(const event_t& m) {
  if (m.code != event::kPublisherRejected.code) return std::nullopt;
  std::string_view rest = m.text;
  const std::size_t at = rest.find(kRejected);
  if (at == std::string_view::npos) return std::nullopt;
  Rejection rejection;
  rejection.channel = rest.substr(0, at);
  rest.remove_prefix(at + kRejected.size());
  const std::optional<std::int64_t> publisher = take_id(&rest);
  if (!publisher || rest.substr(0, kOfRun.size()) != kOfRun) return std::nullopt;
  rest.remove_prefix(kOfRun.size());
  const std::optional<std::int64_t> run = take_id(&rest);
  if (!run) return std::nullopt;
  rejection.publisher_id = *publisher;
  rejection.run_id = *run;
  return rejection;
}

}  // namespace rcs
