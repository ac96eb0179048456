#include "modules/bg/unchecked_ground.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

constexpr std::uint8_t kLooks = 2;  // a scan may be incomplete
constexpr std::uint8_t kMissed = 4;

template <class What>
void each_cell(const Grid<std::uint8_t>& grid, What&& what) {
  const Cell first = grid.origin();
  for (int j = first.j; j < first.j + grid.size(); ++j) {
    for (int i = first.i; i < first.i + grid.size(); ++i) what(Cell{i, j});
  }
}

}  // namespace

void UncheckedGround::begin(double cell_m) {
  int size = 2;
  while (size * cell_m < 2.0 * (params_.far_m + params_.ahead_m)) size *= 2;
  looks_ = moved_ = Grid<std::uint8_t>(size, cell_m);
}

void UncheckedGround::mark(const Place& vehicle, Scans scans, vj::Terrain* terrain) {
  if (params_.far_m <= 0.0) return;
  if (looks_.size() == 1 || terrain->cell_m != looks_.cell_m()) begin(terrain->cell_m);
  looks_.centre_on(looks_.cell_at(vehicle.x_m, vehicle.y_m));
  here_ = vehicle;
  drive_over(vehicle);
  const double blind_m = blind_zone_m(params_, 0.0);
  each_cell(looks_, [&](Cell c) {
    std::uint8_t& looks = looks_.at(c);
    if (looks == kLooks) return;
    const double cell_m = looks_.cell_m();
    const Bearing to =
        bearing_from_ladar((c.i + 0.5) * cell_m, (c.j + 0.5) * cell_m, vehicle, params_);
    const bool blind = to.range_m < blind_m;
    if (!blind && is_in_sight(to, params_)) {
      if (scans == Scans::kNew) ++looks;
      if (scans == Scans::kLost) looks |= kMissed;
      if (looks == (kLooks | kMissed)) looks = kLooks;
    }
    if (!blind || looks < kMissed || !terrain->contains(c)) return;
    vj::Ground& ground = terrain->ground[terrain->index(c)];
    ground.known = ground.obstacle = true;
  });
}

void UncheckedGround::drive_over(const Place& vehicle) {
  const double c = std::cos(vehicle.heading_rad);
  const double s = std::sin(vehicle.heading_rad);
  const double step_m = 0.5 * looks_.cell_m();
  for (double along = -0.5 * shape_.length_m; along <= 0.5 * shape_.length_m; along += step_m) {
    for (double aside = -0.5 * shape_.width_m; aside <= 0.5 * shape_.width_m; aside += step_m) {
      const Cell cell =
          looks_.cell_at(vehicle.x_m + c * along - s * aside, vehicle.y_m + s * along + c * aside);
      if (std::uint8_t* const looks = looks_.find(cell)) *looks = kLooks;
    }
  }
}

void UncheckedGround::move_to_frame_of(const Place& here) {
  if (looks_.size() == 1) return;
  const double turn = here_.heading_rad - here.heading_rad;
  const double c = std::cos(turn);
  const double s = std::sin(turn);
  moved_.centre_on(moved_.cell_at(here.x_m, here.y_m));
  each_cell(moved_, [&](Cell to) {
    const double dx = (to.i + 0.5) * moved_.cell_m() - here.x_m;
    const double dy = (to.j + 0.5) * moved_.cell_m() - here.y_m;
    const std::uint8_t* const from =
        looks_.find(looks_.cell_at(here_.x_m + c * dx - s * dy, here_.y_m + s * dx + c * dy));
    moved_.at(to) = from != nullptr ? *from : 0;
  });
  std::swap(looks_, moved_);
  here_ = here;
}

}  // namespace rcs::bg
