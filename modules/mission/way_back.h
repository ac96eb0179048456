#pragma once
// The way that the vehicle has come, for its return without GPS: positions in frame rolling, which
// keeps the map that was made on the way out (modules/registration/map_archive.h), and in frame
// world for what was driven in another map.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"

namespace rcs::mission {

struct Breadcrumb {
  Vec3 p_rolling = Vec3::Zero();
  std::int32_t epoch = -1;  ///< of frame rolling; < 0: none
  Vec3 p_world = Vec3::Zero();
  bool in_world = false;  ///< p_world is known
};

/// A part of the way back in one frame.
struct WayPart {
  bool rolling = false;  ///< in frame rolling of `epoch`; else in frame world
  std::int32_t epoch = -1;
  std::vector<Vec3> places;
  bool to_the_start = false;  ///< the last place is where the way began
};

class WayBack {
 public:
  /// The vehicle turns by at most 15 degrees between two of them, so that a curve through them is
  /// that which it drove.
  static constexpr double kEach_m = 1.5;
  /// 30 km; then each second one is kept. BG does not join places that are more than 3.5 m apart
  /// (modules/bg/way_back.h): of ways beyond 60 km it searches a path to each.
  static constexpr std::size_t kMaxCrumbs = 20'000;

  WayBack() { crumbs_.reserve(kMaxCrumbs); }

  /// Notes the position if it is far enough from the last one. The first one after a return,
  /// completed or not, is noted behind the place of the way that is nearest to it.
  void note(const Breadcrumb& here);
  /// Another frame world has begun.
  void move_world(const Pose& T_now_before);
  [[nodiscard]] bool empty() const { return crumbs_.empty(); }
  [[nodiscard]] const std::vector<Breadcrumb>& crumbs() const { return crumbs_; }

  /// The first part of the way from here to the start: up to the first change of frame, without
  /// the loops that the vehicle drove.
  /// @param epoch  of frame rolling now
  /// @return no places: nothing was driven, or what follows was driven in another map and its
  ///   position in frame world is not known
  [[nodiscard]] WayPart first_part(std::int32_t epoch) const;

  /// first_part() has places.
  [[nodiscard]] bool begins_in(std::int32_t epoch) const {
    return !crumbs_.empty() &&
           (crumbs_.back().in_world || (epoch >= 0 && crumbs_.back().epoch == epoch));
  }

  /// The vehicle begins to return, or goes on with it: what was driven after the place of the way
  /// nearest to `here` has been driven back.
  /// @return distance to that place [m]; infinite: none is in this frame
  double begin_return(const Breadcrumb& here);

 private:
  [[nodiscard]] static double distance_m(const Breadcrumb& a, const Breadcrumb& b);
  double cut(const Breadcrumb& here);

  std::vector<Breadcrumb> crumbs_;  // oldest first
  bool returns_ = false;            // since the last note()
};

}  // namespace rcs::mission
