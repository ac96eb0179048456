#pragma once
// A value over time with bounded memory, for plots.

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "rcs/base/stamp.h"

namespace rcs::view {

/// Keeps the largest (or the smallest) value of each interval, so that a plot shows every
/// exceedance. When there are too many intervals, they become twice as long.
class ValueSeries {
 public:
  static constexpr std::size_t kMaxIntervals = 12'000;
  static constexpr double kFirstInterval_s = 0.1;

  enum class Keep { kLargest, kSmallest };

  explicit ValueSeries(Keep keep = Keep::kLargest) : keep_(keep) {}

  struct Entry {
    double time_s = 0.0;  ///< of the value that is kept
    double value = 0.0;
  };

  /// @param time  not before that of the last call; values that are not finite are omitted
  void add(Duration time, double value) {
    if (!std::isfinite(value)) return;
    const double t = seconds(time);
    const long long interval = interval_of(t);
    if (!entries_.empty() && interval == last_interval_) {
      if (beyond(value, entries_.back().value)) entries_.back() = {t, value};
      return;
    }
    last_interval_ = interval;
    entries_.push_back({t, value});
    if (entries_.size() > kMaxIntervals) halve();
  }

  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }
  [[nodiscard]] int halvings() const { return halvings_; }

 private:
  [[nodiscard]] bool beyond(double a, double b) const {
    return keep_ == Keep::kLargest ? a > b : a < b;
  }
  /// Values of 10 Hz lie on the limits of the intervals, and rounding must not join two of them.
  [[nodiscard]] long long interval_of(double time_s) const {
    return static_cast<long long>(time_s / interval_s_ + 1e-6);
  }
  void halve() {
    interval_s_ *= 2.0;
    ++halvings_;
    std::vector<Entry> kept;
    kept.reserve(entries_.size() / 2 + 1);
    long long last = -1;
    for (const Entry& e : entries_) {
      const long long interval = interval_of(e.time_s);
      if (!kept.empty() && interval == last) {
        if (beyond(e.value, kept.back().value)) kept.back() = e;
      } else {
        kept.push_back(e);
      }
      last = interval;
    }
    last_interval_ = last;
    entries_ = std::move(kept);
  }

  Keep keep_;
  std::vector<Entry> entries_;
  double interval_s_ = kFirstInterval_s;
  long long last_interval_ = -1;
  int halvings_ = 0;
};

}  // namespace rcs::view
