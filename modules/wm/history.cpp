#include "modules/wm/history.h"

#include <algorithm>

#include "rcs/base/check.h"

namespace rcs::wm {

History::History(const Model& model)
    : model_(model),
      entries_(static_cast<std::size_t>(model.params.history.capacity)),
      states_(entries_.size()) {}

void History::restart(const FilterState& state) {
  base_ = state;
  first_ = count_ = fused_ = 0;
}

Reason History::insert(const Measurement& m) {
  const Stamp newest = count_ > 0 ? entry(count_ - 1).measurement.stamp : base_.belief.x.stamp;
  if (m.stamp < base_.belief.x.stamp) return Reason::kLate;
  if (m.stamp > newest + model_.params.history.jump) return Reason::kInvalid;

  const auto goes_before = [&m](const Measurement& other) {
    return m.stamp != other.stamp ? m.stamp < other.stamp : m.value.index() < other.value.index();
  };
  std::size_t place = count_;
  while (place > 0 && goes_before(entry(place - 1).measurement)) --place;
  if (place > 0) {
    const Measurement& left = entry(place - 1).measurement;
    if (left.stamp == m.stamp && left.value.index() == m.value.index()) return Reason::kRepeated;
  }
  if (count_ == entries_.size()) {
    if (place == 0 || fused_ == 0) return Reason::kLate;
    drop_oldest();
    --place;
  }
  for (std::size_t i = count_; i > place; --i) entry(i) = entry(i - 1);
  entry(place) = {m, false};
  ++count_;
  // Measurements between the previous INS sample and the new one were reached by a later sample.
  if (m.imu() != nullptr) {
    while (place > 0 && entry(place - 1).measurement.imu() == nullptr) --place;
  }
  fused_ = std::min(fused_, place);
  return Reason::kAccepted;
}

void History::discard_ins(Stamp since, Stamp until) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Measurement& m = entry(i).measurement;
    if (m.imu() != nullptr && m.stamp >= since && m.stamp < until) {
      // As in insert(): this sample reached the measurements before it.
      std::size_t place = kept;
      while (place > 0 && entry(place - 1).measurement.imu() == nullptr) --place;
      fused_ = std::min(fused_, place);
      continue;
    }
    if (kept != i) entry(kept) = entry(i);
    ++kept;
  }
  count_ = kept;
}

const ImuSample* History::next_imu(std::size_t i) const {
  for (; i < count_; ++i) {
    if (const ImuSample* imu = entry(i).measurement.imu()) return imu;
  }
  return nullptr;
}

// A single clock ahead of the INS must not advance the filter (ADR 19): a second source must
// confirm that the INS is silent.
bool History::ins_is_silent(Stamp ins) const {
  std::size_t kinds = 0;
  std::size_t first_kind = 0;
  for (std::size_t i = count_; i > fused_; --i) {
    const Measurement& m = entry(i - 1).measurement;
    if (m.stamp - ins <= model_.params.history.ins_timeout) break;
    if (kinds == 0) first_kind = m.value.index();
    if (kinds == 0 || m.value.index() != first_kind) ++kinds;
    if (kinds == 2) return true;
  }
  return false;
}

void History::fuse(std::vector<Innovation>* out) {
  for (; fused_ < count_; ++fused_) {
    Entry& e = entry(fused_);
    const FilterState& from = before(fused_);
    const ImuSample* imu = next_imu(fused_);
    const Stamp ins = from.bookkeeping.ins_stamp;
    if (imu == nullptr && ins != Stamp::min() && e.measurement.stamp > from.belief.x.stamp &&
        !ins_is_silent(ins)) {
      break;
    }
    FilterState& state = states_[slot(fused_)];
    state = from;
    Innovations records;
    advance(model_, e.measurement.stamp, imu, &state, &records);
    apply(model_, e.measurement, &state, &records);
    for (int k = 0; k < records.count && !e.reported; ++k) {
      const Innovation& record = records.records[static_cast<std::size_t>(k)];
      if (out->size() < out->capacity()) out->push_back(record);
    }
    e.reported = true;
  }
}

void History::drop_oldest() {
  base_ = states_[slot(0)];
  first_ = slot(1);
  --count_;
  --fused_;
}

const FilterState& History::head() const { return before(fused_); }

const FilterState& History::at(Stamp stamp) const {
  std::size_t i = fused_;
  while (i > 0 && before(i).belief.x.stamp > stamp) --i;
  return before(i);
}

}  // namespace rcs::wm
