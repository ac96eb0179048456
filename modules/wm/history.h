#pragma once
// The inputs of the newest second, with the state after each: late data is inserted at its own time
// and all later inputs are fused again, so that the order of arrival does not matter.

#include <optional>
#include <vector>

#include "modules/wm/filter.h"

namespace rcs::wm {

class History {
 public:
  explicit History(const Model& model);

  /// Discards all inputs and continues from `state`.
  void restart(const FilterState& state);

  /// Inserts an input at its time; fuse() fuses it.
  /// @return kAccepted: stored. kLate: older than the oldest that is kept. kRepeated: an input of
  ///   this kind exists for this stamp. kInvalid: so far ahead that its clock is suspect.
  Reason insert(const Measurement& measurement);

  /// Removes the samples of the INS in [since, until); fuse() repeats the later inputs without
  /// them.
  void discard_ins(Stamp since, Stamp until);

  /// Updates the belief. A measurement ahead of the INS waits until the INS reaches its stamp, or
  /// until the stamps of two other sources show that the INS is silent.
  /// @param out  one record for each measurement that was fused for the first time
  void fuse(std::vector<Innovation>* out);

  /// Drops the inputs older than the lag, which no later input can precede. Calls
  /// judge(measurement, next_imu, state after it) once for each, in order of their stamps; if that
  /// returns a state, it replaces the old one, and fuse() repeats all later inputs.
  /// @return true if a state was replaced: call fuse(), then finish() again
  template <class F>
  bool finish(F&& judge) {
    const Stamp keep = head().belief.x.stamp - model_.params.history.lag;
    while (fused_ > 1 && entry(0).measurement.stamp < keep) {
      const std::optional<FilterState> instead =
          judge(entry(0).measurement, next_imu(0), states_[slot(0)]);
      drop_oldest();
      if (!instead) continue;
      base_ = *instead;
      fused_ = 0;
      return true;
    }
    return false;
  }

  [[nodiscard]] const FilterState& head() const;
  /// The newest stored state at or before `stamp`; the oldest kept when there is none.
  [[nodiscard]] const FilterState& at(Stamp stamp) const;

  /// Changes the oldest state that is kept; fuse() then repeats all later inputs with the changed
  /// model.
  template <class F>
  void amend(const Earth& earth, F&& change) {
    model_.earth = earth;
    change(&base_);
    fused_ = 0;
  }

  [[nodiscard]] const Model& model() const { return model_; }
  /// @param stamp  of a final scan. Its scale applies to inputs that have not been fused yet even
  /// if
  ///   they arrive in bursts of kBurst, so the order of arrival does not matter.
  void add_ladar_scale(Stamp stamp, const LadarScale& scale) {
    constexpr Duration kBurst = from_milliseconds(500.0);
    model_.ladar_scales.add(stamp + model_.params.history.lag + kBurst, scale);
  }

 private:
  struct Entry {
    Measurement measurement;
    bool reported = false;
  };
  [[nodiscard]] std::size_t slot(std::size_t i) const { return (first_ + i) % entries_.size(); }
  [[nodiscard]] Entry& entry(std::size_t i) { return entries_[slot(i)]; }
  [[nodiscard]] const Entry& entry(std::size_t i) const { return entries_[slot(i)]; }
  [[nodiscard]] const FilterState& before(std::size_t i) const {
    return i == 0 ? base_ : states_[slot(i - 1)];
  }
  [[nodiscard]] const ImuSample* next_imu(std::size_t i) const;
  [[nodiscard]] bool ins_is_silent(Stamp ins) const;
  void drop_oldest();

  Model model_;
  FilterState base_;  ///< before the oldest entry
  std::vector<Entry> entries_;
  std::vector<FilterState> states_;  ///< after each entry
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  std::size_t fused_ = 0;  ///< entries whose states are valid
};

}  // namespace rcs::wm
