#pragma once
// Detects silent inputs by the node time of their arrivals. When all sensors are silent, the sensor
// time of the belief stands still, so that no age in sensor time grows.

#include <array>

#include "rcs/base/stamp.h"

namespace rcs::wm {

enum class Input : int { kIns = 0, kGps = 1, kOdometry = 2, kLadar = 3 };
constexpr std::size_t kInputs = 4;

class InputWatch {
 public:
  /// An input that was accepted: new in sensor time, and plausible.
  void add(Input input, Stamp stamp, Stamp arrival);
  /// The same, if its stamp is newer than the newest, or so far from it that the clock has stepped.
  void add_newer(Input input, Stamp stamp, Stamp arrival);

  /// Time since the newest arrival of the input; negative: it has never arrived.
  [[nodiscard]] Duration silence(Input input, Stamp now) const;
  /// Longest silence that is not reported: three periods, at least 200 ms.
  [[nodiscard]] Duration limit(Input input) const;
  /// The input has arrived before, and its silence exceeds the limit.
  [[nodiscard]] bool silent(Input input, Stamp now) const;
  /// Excess of the silence of all inputs but odometry over the limit of the fastest of them; zero
  /// or less: some input is received. Wheels alone do not move the filter.
  [[nodiscard]] Duration all_silent_for(Stamp now) const;

 private:
  struct Arrivals {
    Stamp stamp = Stamp::min();    ///< sensor time of the newest
    Stamp arrival = Stamp::min();  ///< node time of the newest
    Duration period{};             ///< low-passed, sensor time; 0: unknown
  };
  [[nodiscard]] const Arrivals& of(Input input) const {
    return arrivals_[static_cast<std::size_t>(input)];
  }
  std::array<Arrivals, kInputs> arrivals_;
};

}  // namespace rcs::wm
