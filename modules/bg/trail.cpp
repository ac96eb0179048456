#include "modules/bg/trail.h"

#include <algorithm>
#include <cmath>

#include "modules/bg/outline.h"

namespace rcs::bg {

void Trail::add(const Pose2d& here) {
  here_ = here;
  const Pose2d& last = places_[(count_ + places_.size() - 1) % places_.size()];
  if (count_ > 0 && std::hypot(here.x_m - last.x_m, here.y_m - last.y_m) < kStep_m) return;
  places_[count_ % places_.size()] = here;
  ++count_;
}

void Trail::move_to_frame_of(const Pose2d& here) {
  const double turn = here.heading_rad - here_.heading_rad;
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  for (Pose2d& p : places_) {
    const double dx = p.x_m - here_.x_m;
    const double dy = p.y_m - here_.y_m;
    p.x_m = here.x_m + c * dx - s * dy;
    p.y_m = here.y_m + s * dx + c * dy;
    p.heading_rad += turn;
  }
  here_ = here;
}

void Trail::mark(const Shape& shape, vj::Terrain* terrain) const {
  for (std::size_t k = 0; k < std::min(count_, places_.size()); ++k) {
    each_point_under(shape, places_[k], 0.5 * terrain->cell_m, [terrain](double x_m, double y_m) {
      const Cell cell = terrain->cell_at(x_m, y_m);
      if (terrain->contains(cell)) terrain->ground[terrain->index(cell)].known = true;
    });
  }
}

void Trail::lead_back(double max_m, Path* path) const {
  path->clear();
  path->push_back({here_, -1, 0.0, 0.0, 0.0, 0.0});
  for (std::size_t k = 0; k < std::min(count_, places_.size()); ++k) {
    const Pose2d& older = places_[(count_ - 1 - k) % places_.size()];
    PathPoint& newer = path->back();
    const double dx = newer.place.x_m - older.x_m;
    const double dy = newer.place.y_m - older.y_m;
    const double way_m = std::hypot(dx, dy);
    if (way_m < 0.5 * kStep_m) continue;  // the newest place is where the vehicle is
    const bool ahead = dx * std::cos(older.heading_rad) + dy * std::sin(older.heading_rad) > 0.0;
    if (!ahead || newer.s_m + way_m > max_m) break;
    PathPoint point{older, -1, newer.s_m + way_m, 0.0, 0.0, 0.0};
    point.place.curvature_1pm = (newer.place.heading_rad - older.heading_rad) / way_m;
    path->push_back(point);
  }
  if (path->size() < 2) path->clear();
}

}  // namespace rcs::bg
