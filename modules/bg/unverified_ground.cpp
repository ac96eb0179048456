#include "modules/bg/unverified_ground.h"

#include <algorithm>
#include <cmath>

#include "modules/bg/outline.h"

namespace rcs::bg {
namespace {

constexpr std::uint8_t kEnough = 2;  // a scan may be incomplete
constexpr std::uint8_t kMissed = 4;

template <class What>
void each_cell(const Grid<std::uint8_t>& grid, What&& what) {
  const Cell first = grid.origin();
  for (int j = first.j; j < first.j + grid.size(); ++j) {
    for (int i = first.i; i < first.i + grid.size(); ++i) what(Cell{i, j});
  }
}

}  // namespace

void UnverifiedGround::begin(double cell_m) {
  int size = 2;
  while (size * cell_m < 2.0 * (params_.far_m + params_.ahead_m)) {
    size *= 2;
  }
  observations_ = moved_ = Grid<std::uint8_t>(size, cell_m);
}

void UnverifiedGround::mark(const Pose2d& vehicle, Scans scans, vj::Terrain* terrain) {
  if (params_.far_m <= 0.0) return;
  if (observations_.size() == 1 || terrain->cell_m != observations_.cell_m()) {
    begin(terrain->cell_m);
  }
  observations_.centre_on(observations_.cell_at(vehicle.x_m, vehicle.y_m));
  here_ = vehicle;
  drive_over(vehicle);
  const LadarView view(vehicle, params_);
  const double blind_m = blind_zone_m(params_, 0.0);
  each_cell(observations_, [&](Cell c) {
    std::uint8_t& observations = observations_.at(c);
    if (observations == kEnough) return;
    const Vec2 at = view.relative((c.i + 0.5) * terrain->cell_m, (c.j + 0.5) * terrain->cell_m);
    const bool blind = at.norm() < blind_m;
    if (!blind && scans != Scans::kNone && view.covers(at)) {
      if (scans == Scans::kNew) ++observations;
      if (scans == Scans::kLost) observations |= kMissed;
      if (observations == (kEnough | kMissed)) observations = kEnough;
    }
    if (!blind || observations < kMissed || !terrain->contains(c)) return;
    vj::Ground& ground = terrain->ground[terrain->index(c)];
    ground.known = ground.obstacle = true;
  });
}

void UnverifiedGround::drive_over(const Pose2d& vehicle) {
  each_point_under(shape_, vehicle, 0.5 * observations_.cell_m(), [this](double x_m, double y_m) {
    std::uint8_t* const observations = observations_.find(observations_.cell_at(x_m, y_m));
    if (observations != nullptr) *observations = kEnough;
  });
}

void UnverifiedGround::move_to_frame_of(const Pose2d& here) {
  if (observations_.size() == 1) return;
  const double turn = here_.heading_rad - here.heading_rad;
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  moved_.centre_on(moved_.cell_at(here.x_m, here.y_m));
  each_cell(moved_, [&](Cell to) {
    const double dx = (to.i + 0.5) * moved_.cell_m() - here.x_m;
    const double dy = (to.j + 0.5) * moved_.cell_m() - here.y_m;
    const std::uint8_t* const from = observations_.find(
        observations_.cell_at(here_.x_m + c * dx - s * dy, here_.y_m + s * dx + c * dy));
    moved_.at(to) = from != nullptr ? *from : 0;
  });
  std::swap(observations_, moved_);
  here_ = here;
}

}  // namespace rcs::bg
