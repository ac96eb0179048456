#include "modules/bg/trail.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {

void Trail::add(const Place& here) {
  here_ = here;
  const Place& last = places_[(count_ + places_.size() - 1) % places_.size()];
  if (count_ > 0 && std::hypot(here.x_m - last.x_m, here.y_m - last.y_m) < kStep_m) return;
  places_[count_ % places_.size()] = here;
  ++count_;
}

void Trail::move_to_frame_of(const Place& here) {
  const double turn = here.heading_rad - here_.heading_rad;
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  for (Place& p : places_) {
    const double dx = p.x_m - here_.x_m;
    const double dy = p.y_m - here_.y_m;
    p.x_m = here.x_m + c * dx - s * dy;
    p.y_m = here.y_m + s * dx + c * dy;
    p.heading_rad += turn;
  }
  here_ = here;
}

void Trail::mark(const Shape& shape, vj::Terrain* terrain) const {
  const double half_m = 0.5 * terrain->cell_m;
  for (std::size_t k = 0; k < std::min(count_, places_.size()); ++k) {
    const Place& p = places_[k];
    const double c = std::cos(p.heading_rad);
    const double s = std::sin(p.heading_rad);
    for (double along = -0.5 * shape.length_m; along <= 0.5 * shape.length_m; along += half_m) {
      for (double aside = -0.5 * shape.width_m; aside <= 0.5 * shape.width_m; aside += half_m) {
        const Cell cell =
            terrain->cell_at(p.x_m + c * along - s * aside, p.y_m + s * along + c * aside);
        if (!terrain->contains(cell)) continue;
        terrain->ground[terrain->index(cell)].known = true;
      }
    }
  }
}

void Trail::lead_back(double most_m, Path* path) const {
  path->clear();
  path->push_back({here_, -1, 0.0, 0.0, 0.0, 0.0});
  for (std::size_t k = 0; k < std::min(count_, places_.size()); ++k) {
    const Place& older = places_[(count_ - 1 - k) % places_.size()];
    PathPoint& newer = path->back();
    const double dx = newer.place.x_m - older.x_m;
    const double dy = newer.place.y_m - older.y_m;
    const double way_m = std::hypot(dx, dy);
    if (way_m < 0.5 * kStep_m) continue;  // the newest place is where the vehicle is
    const bool ahead = dx * std::cos(older.heading_rad) + dy * std::sin(older.heading_rad) > 0.0;
    if (!ahead || newer.s_m + way_m > most_m) break;
    PathPoint point{older, -1, newer.s_m + way_m, 0.0, 0.0, 0.0};
    point.place.curvature_1pm = (newer.place.heading_rad - older.heading_rad) / way_m;
    path->push_back(point);
  }
  if (path->size() < 2) path->clear();
}

}  // namespace rcs::bg
