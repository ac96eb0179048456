#pragma once
// The newest second of inputs, with the belief after each: late data is put where it belongs and
// everything after it is fused again, so that the order of arrival does not matter.

#include <optional>
#include <vector>

#include "modules/wm/filter.h"

namespace rcs::wm {

class History {
 public:
  explicit History(const Model& model);

  /// Forgets all inputs and goes on from `state`.
  void restart(const FilterState& state);

  /// Puts an input in its place; fuse() takes it in.
  /// @return kAccepted: stored. kLate: before the oldest that is kept. kRepeated: this kind of
  /// input
  ///         was here for this stamp. kInvalid: so far ahead that its clock is doubted.
  Reason insert(const Measurement& measurement);

  /// Brings the belief up to date. A measurement ahead of the INS waits until the INS gets there,
  /// or has been silent for its timeout by the stamps of two other sources.
  /// @param out  one record for each measurement that was fused for the first time
  void fuse(std::vector<Innovation>* out);

  /// Parts with what is older than the lag: nothing can come before it any more. Calls
  /// judge(measurement, next_imu, state after it) once for each input, in order of their stamps; if
  /// it answers with a state, that one is gone on from, and fuse() repeats all since.
  /// @return true when it did so: call fuse(), then this again
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

  /// Changes the oldest state that is kept; fuse() then repeats all since with the changed model.
  template <class F>
  void amend(const Earth& earth, F&& change) {
    model_.earth = earth;
    change(&base_);
    fused_ = 0;
  }

  [[nodiscard]] const Model& model() const { return model_; }

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
