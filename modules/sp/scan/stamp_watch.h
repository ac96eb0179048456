#pragma once
// Detects that the stamps of the scans have changed against their arrivals and against the INS. A
// stamp cannot gain on its arrival unless its clock has stepped; a scan with an old stamp is late,
// or its clock has stepped back: its registration shows which of the two.

#include <optional>

#include "rcs/base/stamp.h"

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
  /// Of the stamps that changed() is about: whether their clock has stepped, or they are late.
  void decide(bool clock);

 private:
  /// Lead of the stamps over another time, and the largest usual one: that of the smallest latency.
  struct Lead {
    Stamp stamp{}, other{};
    Duration lead{}, best{};

    void add(Stamp s, Stamp o, bool first);
    void follow(bool known);
  };

  Lead arrival_, ins_;
  int count_ = 0;
  Duration changed_{};
  std::optional<Duration> decided_;  // the change that was decided about
  bool clock_ = false;
};

}  // namespace rcs::sp
