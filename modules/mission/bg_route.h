#pragma once
// The places that BG is sent along: a window of them at a time, so that a long route needs no long
// command.

#include <cstddef>
#include <utility>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::mission {

struct RoutePlace {
  Vec3 p = Vec3::Zero();  ///< in the frame of the route
  double radius_m = 5.0;
};

class BgRoute {
 public:
  static constexpr std::size_t kWindow = 48;  ///< places in a command; BG accepts 64

  void begin(std::vector<RoutePlace> places) {
    places_ = std::move(places);
    first_ = done_ = 0;
  }
  void clear() { begin({}); }

  /// BG reports how many of the places that it was sent are done.
  void note(int done) { done_ = std::max(done_, std::min(places_.size(), first_ + size_of(done))); }
  /// BG begins at the first place that it is sent: after another command, at the next one.
  void resume() {
    if (done_ < places_.size()) first_ = done_;
  }
  /// The window is moved once half of it is done: the place that BG drives to is in both.
  void advance() {
    if (done_ - first_ >= kWindow / 2 && first_ + kWindow < places_.size()) first_ = done_;
  }

  [[nodiscard]] bool empty() const { return places_.empty(); }
  [[nodiscard]] bool arrived() const { return !places_.empty() && done_ == places_.size(); }
  [[nodiscard]] std::size_t first() const { return first_; }
  [[nodiscard]] std::size_t last() const { return std::min(places_.size(), first_ + kWindow); }
  [[nodiscard]] std::size_t done() const { return done_; }
  [[nodiscard]] const std::vector<RoutePlace>& places() const { return places_; }

 private:
  static std::size_t size_of(int n) { return n > 0 ? static_cast<std::size_t>(n) : 0; }

  std::vector<RoutePlace> places_;
  std::size_t first_ = 0;
  std::size_t done_ = 0;
};

/// Places each `spacing_m` along a line, its corners and its end included; not its start.
[[nodiscard]] std::vector<Vec2> divided(const std::vector<Vec2>& line, double spacing_m);

/// The first place that is not behind a vehicle at `here`, which drives along the line from `start`
/// through the places: the end of the part of the line that is nearest to it.
/// @param last  place that is not behind it, at the most places.size()
[[nodiscard]] std::size_t first_ahead(const Vec2& start, const std::vector<Vec2>& places,
                                      std::size_t last, const Vec2& here);

}  // namespace rcs::mission
