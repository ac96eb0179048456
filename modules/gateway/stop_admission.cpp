#include "modules/gateway/stop_admission.h"

#include <algorithm>

namespace rcs::gateway {

StopAdmission::Verdict StopAdmission::judge(const Sample& sample) {
  if (sample.vehicle != vehicle_) {
    ++not_stored_;
    return Verdict::kDropped;
  }
  if (const std::string* const by = operator_of(sample.writer)) {
    if (*by == sample.operator_id && !by->empty()) return Verdict::kStored;
  } else if (std::find(others_.begin(), others_.end(), sample.operator_id) != others_.end()) {
    return Verdict::kStored;
  } else if (others_.size() < kMaxOthers) {
    others_.emplace_back(sample.operator_id);
    return Verdict::kStored;
  }
  ++not_stored_;
  (sample.engage ? unnamed_stop_ : refused_release_) = true;
  return sample.engage ? Verdict::kUnnamedStop : Verdict::kDropped;
}

void StopAdmission::set_writers(const std::vector<Writer>& writers) {
  for (const Writer& writer : writers) {
    const auto known = std::find_if(writers_.begin(), writers_.end(),
                                    [&](const Writer& w) { return w.handle == writer.handle; });
    if (known == writers_.end()) {
      writers_.push_back(writer);
    } else if (known->operator_id.empty()) {
      known->operator_id = writer.operator_id;  // it was not known at once
    }
  }
  const auto exists = [&writers](const Writer& writer) {
    return std::any_of(writers.begin(), writers.end(),
                       [&](const Writer& w) { return w.handle == writer.handle; });
  };
  for (auto w = writers_.begin(); w != writers_.end() && writers_.size() > kMaxWriters;) {
    w = exists(*w) ? w + 1 : writers_.erase(w);
  }
}

const std::string* StopAdmission::operator_of(std::uint64_t writer) const {
  const auto found = std::find_if(writers_.begin(), writers_.end(),
                                  [writer](const Writer& w) { return w.handle == writer; });
  return found == writers_.end() ? nullptr : &found->operator_id;
}

}  // namespace rcs::gateway
