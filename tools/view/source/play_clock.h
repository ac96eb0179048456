#pragma once
// The moment of a log that is shown: play, pause, seek, speed. Reads no clock.

#include <algorithm>
#include <cmath>

#include "rcs/base/stamp.h"

namespace rcs::view {

class PlayClock {
 public:
  static constexpr double kMinSpeed = 0.05;
  static constexpr double kMaxSpeed = 50.0;

  explicit PlayClock(Duration duration) : duration_(duration) {}

  [[nodiscard]] Duration time() const { return time_; }
  [[nodiscard]] Duration duration() const { return duration_; }
  [[nodiscard]] bool playing() const { return playing_; }
  [[nodiscard]] double speed() const { return speed_; }

  /// At the end of the log: from its begin. @return true: the time jumped
  bool play() {
    const bool at_end = time_ >= duration_;
    if (at_end) time_ = Duration{};
    playing_ = true;
    return at_end;
  }
  void pause() { playing_ = false; }
  /// Limited to the log.
  void seek(Duration time) { time_ = std::clamp(time, Duration{}, duration_); }
  /// Limited to [kMinSpeed, kMaxSpeed]; NaN changes nothing.
  void set_speed(double speed) {
    if (!std::isnan(speed)) speed_ = std::clamp(speed, kMinSpeed, kMaxSpeed);
  }
  /// After `elapsed` of real time. Pauses at the end of the log.
  void advance(Duration elapsed) {
    if (!playing_ || elapsed <= Duration{}) return;
    time_ = std::min(duration_, time_ + from_seconds(seconds(elapsed) * speed_));
    if (time_ >= duration_) playing_ = false;
  }

 private:
  Duration duration_;
  Duration time_{};
  bool playing_ = false;
  double speed_ = 1.0;
};

}  // namespace rcs::view
