#include "modules/bg/hidden_ground.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

constexpr double kMargin_m = 0.6;       // beyond the lowest ray on level ground
constexpr double kSteepest_rad = 0.02;  // of the lowest ray below level ground
constexpr int kUnknownAround = 4;       // of eight: single cells are missed by chance
constexpr std::uint8_t kLooks = 2;      // a scan may be incomplete

}  // namespace

double blind_zone_m(const SightParams& params, double lifted_rad) {
  const double below_rad = std::max(kSteepest_rad, params.lowest_rad - lifted_rad);
  return params.height_m / std::tan(below_rad) + kMargin_m;
}

void HiddenGround::mark(const Pose2d& vehicle, double pitch_rad, double roll_rad, bool looked,
                        vj::Terrain* terrain) {
  if (params_.far_m <= 0.0 || terrain->width < 3 || terrain->height < 3) return;
  if (hidden_.cell_m() != terrain->cell_m) hidden_ = Grid<std::uint8_t>(512, terrain->cell_m);
  hidden_.centre_on(terrain->cell_at(vehicle.x_m, vehicle.y_m));
  // With the nose down, the ground ahead may fall as the vehicle does: nothing is gained.
  const double lifted_rad =
      std::max(0.0, pitch_rad) +
      std::abs(roll_rad) * std::sin(std::min(0.5 * kPi, params_.half_angle_rad));
  const LadarView view(vehicle, params_);
  const double blind_m = blind_zone_m(params_, lifted_rad);
  const auto unknown_around = [terrain](Cell c) {
    int count = 0;
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        if (i == 0 && j == 0) continue;
        count += terrain->at({c.i + i, c.j + j}).known ? 0 : 1;
      }
    }
    return count;
  };
  const auto each = [terrain](auto&& what) {
    for (int j = 0; j < terrain->height; ++j) {
      for (int i = 0; i < terrain->width; ++i) {
        what(Cell{terrain->first.i + i, terrain->first.j + j});
      }
    }
  };
  // First all marks, then the obstacles, which count as known.
  each([&](Cell c) {
    std::uint8_t* const mark = hidden_.find(c);
    if (mark == nullptr) return;
    if (terrain->at(c).known) {
      *mark = 0;
      return;
    }
    if (!looked || *mark >= kLooks) return;
    const Vec2 at = view.relative((c.i + 0.5) * terrain->cell_m, (c.j + 0.5) * terrain->cell_m);
    const bool in_sight = at.norm() > blind_m && view.covers(at);
    if (in_sight && unknown_around(c) >= kUnknownAround) ++*mark;
  });
  each([&](Cell c) {
    const std::uint8_t* const mark = hidden_.find(c);
    if (mark == nullptr || *mark < kLooks) return;
    vj::Ground& ground = terrain->ground[terrain->index(c)];
    ground.known = ground.obstacle = true;
  });
}

}  // namespace rcs::bg
