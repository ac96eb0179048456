#pragma once
// A rolling 2-D grid of fixed size: a window onto an unbounded lattice of cells that moves with the
// vehicle. A move costs one write for each cell that enters, independently of the window's size.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "rcs/base/check.h"

namespace rcs {

/// Index of a lattice cell; cell (i, j) covers [i, i+1) x [j, j+1) times the cell's edge.
struct Cell {
  int i = 0;
  int j = 0;
  friend bool operator==(Cell a, Cell b) { return a.i == b.i && a.j == b.j; }
};

/// The cell index of a coordinate in units of a cell. Limited to +-2^30, which is beyond every
/// window and map, also for NaN: converting a larger value to int is undefined.
inline int cell_index(double v) {
  constexpr double kFar = 1 << 30;
  const double bounded = v > -kFar ? (v < kFar ? v : kFar) : -kFar;
  return static_cast<int>(std::floor(bounded));
}

template <class T>
class Grid {
 public:
  /// @param size  cells along each side, a power of two (so that wrapping is a mask)
  /// @param cell_m  edge of a cell [m], > 0
  Grid(int size, double cell_m, const T& empty = T())
      : size_(size), mask_(size - 1), cell_m_(cell_m), empty_(empty), data_(area(size), empty) {
    RCS_CHECK(size > 0 && (size & (size - 1)) == 0 && cell_m > 0.0);
  }

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] double cell_m() const { return cell_m_; }
  [[nodiscard]] Cell origin() const { return origin_; }  ///< the window's lowest cell

  [[nodiscard]] Cell cell_at(double x_m, double y_m) const {
    return {cell_index(x_m / cell_m_), cell_index(y_m / cell_m_)};
  }
  [[nodiscard]] bool contains(Cell c) const {
    return c.i >= origin_.i && c.i < origin_.i + size_ && c.j >= origin_.j &&
           c.j < origin_.j + size_;
  }

  /// The cell's value; `c` must lie in the window.
  [[nodiscard]] T& at(Cell c) { return data_[slot(c)]; }
  [[nodiscard]] const T& at(Cell c) const { return data_[slot(c)]; }

  /// The value, or null outside the window.
  [[nodiscard]] T* find(Cell c) { return contains(c) ? &at(c) : nullptr; }
  [[nodiscard]] const T* find(Cell c) const { return contains(c) ? &at(c) : nullptr; }

  /// Moves the window so that `centre` is in its middle; cells that enter are empty.
  void centre_on(Cell centre) { move_to({centre.i - size_ / 2, centre.j - size_ / 2}); }

  void move_to(Cell origin) {
    if (std::abs(origin.i - origin_.i) >= size_ || std::abs(origin.j - origin_.j) >= size_) {
      std::fill(data_.begin(), data_.end(), empty_);
      origin_ = origin;
      return;
    }
    while (origin_.i < origin.i) clear_column(origin_.i++);
    while (origin_.i > origin.i) clear_column(--origin_.i);
    while (origin_.j < origin.j) clear_row(origin_.j++);
    while (origin_.j > origin.j) clear_row(--origin_.j);
  }

  void clear() { std::fill(data_.begin(), data_.end(), empty_); }

 private:
  static std::size_t area(int size) {
    return static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  }
  [[nodiscard]] std::size_t slot(Cell c) const {
    return static_cast<std::size_t>(c.j & mask_) * static_cast<std::size_t>(size_) +
           static_cast<std::size_t>(c.i & mask_);
  }
  // The cell that leaves on one side and the one that enters on the other share a slot.
  void clear_column(int i) {
    for (int j = 0; j < size_; ++j) data_[slot({i, j})] = empty_;
  }
  void clear_row(int j) {
    for (int i = 0; i < size_; ++i) data_[slot({i, j})] = empty_;
  }

  int size_;
  int mask_;
  double cell_m_;
  T empty_;
  Cell origin_;
  std::vector<T> data_;
};

}  // namespace rcs
