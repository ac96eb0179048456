#include "modules/sp/scan/stamp_watch.h"

#include <algorithm>

namespace rcs::sp {
namespace {

constexpr int kKnown = 20;  // scans after which the usual difference is known
constexpr Duration kAhead = from_milliseconds(40.0);
constexpr Duration kBehind = from_milliseconds(100.0);  // a busy computer delays scans by less
// Of the changes against the arrivals and against the INS, if the scans are their cause.
constexpr Duration kAlike = from_milliseconds(50.0);
constexpr Duration kFollow = from_milliseconds(5.0);  // a scan

Duration abs(Duration d) { return d < Duration::zero() ? -d : d; }

/// A clock that has stepped must not become the usual one.
void follow(bool known, StampLead* lead) {
  if (known && lead->lead - lead->best > kAhead) return;
  lead->follow(known ? std::optional<Duration>(kFollow) : std::nullopt);
}

}  // namespace

void StampWatch::add(Stamp reference, Stamp arrival, Stamp newest_ins) {
  const bool known = arrival_.count >= kKnown;
  arrival_.add(reference, arrival);
  ins_.add(reference, newest_ins);
  const Duration by_arrival = arrival_.lead - arrival_.best;
  const Duration by_ins = ins_.lead - ins_.best;
  const bool unusual = by_arrival > kAhead || by_arrival < -kBehind;
  // The INS may fall silent meanwhile.
  const bool goes_on = changed_ != Duration::zero() && abs(by_arrival - changed_) < kAlike;
  const bool by_scans = known && unusual && (goes_on || abs(by_arrival - by_ins) < kAlike);
  changed_ = by_scans ? by_arrival : Duration::zero();
  const bool of_all_clocks = known && unusual && !by_scans && abs(by_ins) < kAhead;
  if (of_all_clocks) arrival_.best = arrival_.lead;
  if (!decided_ || abs(changed_ - *decided_) > kAlike) decided_.reset();
  follow(known, &arrival_);
  follow(known, &ins_);
}

std::optional<Duration> StampWatch::shift() const {
  if (changed_ == Duration::zero()) return Duration::zero();
  if (!decided_) return std::nullopt;
  return clock_ ? -*decided_ : Duration::zero();
}

void StampWatch::decide(bool clock) {
  decided_ = changed_;
  clock_ = clock;
  if (clock || changed_ < Duration::zero()) return;
  // A smaller latency is the usual one from now on.
  for (StampLead* lead : {&arrival_, &ins_}) lead->best = lead->lead;
  changed_ = Duration::zero();
}

}  // namespace rcs::sp
