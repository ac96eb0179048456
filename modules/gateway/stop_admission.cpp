#include "modules/gateway/stop_admission.h"

#include <algorithm>
#include <utility>

namespace rcs::gateway {

StopAdmission::Verdict StopAdmission::judge(std::string_view operator_id, bool engage) {
  const auto has = [operator_id](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), operator_id) != names.end();
  };
  if (has(writers_) || has(others_)) return Verdict::kStored;
  if (others_.size() < kMaxOthers) {
    others_.emplace_back(operator_id);
    return Verdict::kStored;
  }
  ++not_stored_;
  unnamed_stop_ = unnamed_stop_ || engage;
  return engage ? Verdict::kUnnamedStop : Verdict::kDropped;
}

bool StopAdmission::take_unnamed_stop() { return std::exchange(unnamed_stop_, false); }

}  // namespace rcs::gateway
