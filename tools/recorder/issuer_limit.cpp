#include "tools/recorder/issuer_limit.h"

#include <algorithm>
#include <utility>

namespace rcs::recorder {

bool IssuerLimit::note(std::string_view issuer, Stamp now) {
  if (const auto known = issuers_.find(issuer); known != issuers_.end()) {
    known->second.seen = now;
    return true;
  }
  if (issuers_.size() >= kMaxIssuers) {
    const auto silent = std::find_if(issuers_.begin(), issuers_.end(), [now](const auto& entry) {
      return entry.second.suppressed == 0 && now - entry.second.seen >= kForgetAfter;
    });
    if (silent == issuers_.end()) return false;
    issuers_.erase(silent);
  }
  Account account;
  account.seen = account.refilled = now;
  issuers_.emplace(issuer, account);
  return true;
}

bool IssuerLimit::admit(std::string_view issuer, Stamp now) {
  const auto known = issuers_.find(issuer);
  if (pay(known != issuers_.end() ? &known->second : &others_, now)) return true;
  ++suppressed_;
  return false;
}

// The clock may be set: back, nothing is refilled; ahead, at most everything.
bool IssuerLimit::pay(Account* account, Stamp now) {
  const Duration since = std::max(now - account->refilled, Duration::zero());
  account->credit =
      since >= kForgetAfter ? kForgetAfter : std::min(kForgetAfter, account->credit + since);
  account->refilled = now;
  if (account->credit < kInterval) {
    ++account->suppressed;
    return false;
  }
  account->credit -= kInterval;
  return true;
}

std::vector<IssuerLimit::Suppressed> IssuerLimit::take_suppressed() {
  std::vector<Suppressed> all;
  for (auto& [issuer, account] : issuers_) {
    if (account.suppressed == 0) continue;
    all.push_back({issuer, false, std::exchange(account.suppressed, 0)});
  }
  if (others_.suppressed > 0) all.push_back({"", true, std::exchange(others_.suppressed, 0)});
  suppressed_ = 0;
  return all;
}

}  // namespace rcs::recorder
