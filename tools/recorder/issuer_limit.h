#pragma once
// How many lines of the audit log the commands of one issuer may have: a flood of commands must not
// displace what was logged before. Pure.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::recorder {

class IssuerLimit {
 public:
  /// Lines at once; afterwards one in kInterval.
  static constexpr int kBurst = 300;
  static constexpr Duration kInterval = from_milliseconds(500.0);
  /// Further issuers share one limit. One that is silent for kForgetAfter gives its place away.
  static constexpr std::size_t kMaxIssuers = 16;
  static constexpr Duration kForgetAfter = kBurst * kInterval;

  /// Call it for every message of the issuer, also for repetitions.
  /// @return the issuer has a limit of its own
  bool note(std::string_view issuer, Stamp now);
  /// @return a line of the issuer may be stored; if not, it is counted
  [[nodiscard]] bool admit(std::string_view issuer, Stamp now);

  [[nodiscard]] bool suppresses() const { return suppressed_ > 0; }
  struct Suppressed {
    std::string issuer;  ///< empty, and of_others: of those without a limit of their own
    bool of_others = false;
    std::int64_t lines = 0;
  };
  /// The lines that were not admitted since the last call, by issuer.
  [[nodiscard]] std::vector<Suppressed> take_suppressed();

 private:
  struct Account {
    Stamp seen;
    Stamp refilled;
    Duration credit = kForgetAfter;  ///< of a line: kInterval
    std::int64_t suppressed = 0;
  };
  static bool pay(Account* account, Stamp now);

  std::map<std::string, Account, std::less<>> issuers_;
  Account others_;
  std::int64_t suppressed_ = 0;
};

}  // namespace rcs::recorder
