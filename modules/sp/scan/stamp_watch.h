#pragma once
// Detects that the stamps of the scans have changed against their arrivals and against the INS:
// their clock has stepped, or their latency has changed. The registration of a scan shows which.

#include <optional>

#include "rcs/base/stamp_lead.h"

namespace rcs::sp {

class StampWatch {
 public:
  /// @param reference  as received
  /// @param arrival  of the last part of the scan
  /// @param newest_ins  stamp of the newest INS sample: a step of all clocks changes no difference
  void add(Stamp reference, Stamp arrival, Stamp newest_ins);
  /// Change against the usual difference; positive: the stamp is ahead. Zero: it is usual.
  [[nodiscard]] Duration changed() const { return changed_; }
  /// To be added to the stamp; none: not decided yet, see decide().
  [[nodiscard]] std::optional<Duration> shift() const;
  /// Of the stamps that changed() is about: whether their clock or their latency has changed.
  void decide(bool clock);

 private:
  StampLead arrival_, ins_;
  Duration changed_{};
  std::optional<Duration> decided_;  // the change that was decided about
  bool clock_ = false;
};

}  // namespace rcs::sp
