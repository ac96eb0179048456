#include "sim/terrain/feature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "sim/base/random.h"

namespace rcs::sim {
namespace {

constexpr double kFade_m = 3.0;      // of steps and ditches, at the ends of their line
constexpr double kReturn = 6.0;      // metres of the way back for a metre of height
constexpr double kDitchSide = 0.35;  // metres across for a metre of depth: 70 deg
constexpr double kLegEnd_m = 12.0;   // free of hazards, at both ends of a leg

double along(double s, double from, double to) {
  return std::clamp((s - from) / (to - from), 0.0, 1.0);
}

double height_of(const Feature& f, const Vec2& p) {
  const Vec2 line = f.b_world - f.a_world;
  const double length_m = line.norm();
  if (length_m <= 0.0) return 0.0;
  const Vec2 ahead = line / length_m;
  const Vec2 from = p - f.a_world;
  const double s = ahead.dot(from);
  const double d = ahead.x() * from.y() - ahead.y() * from.x();  // to the left
  if (s < 0.0 || s > length_m) return 0.0;
  if (f.kind == Feature::Kind::kWall) {
    return std::abs(d) <= 0.5 * f.width_m ? f.height_m : 0.0;
  }
  const double share = std::min({1.0, s / kFade_m, (length_m - s) / kFade_m});
  if (f.kind == Feature::Kind::kDitch) {
    const double half_m = 0.5 * f.width_m;
    const double side_m = std::min(half_m, kDitchSide * f.height_m);
    return -share * f.height_m * along(half_m - std::abs(d), 0.0, side_m);
  }
  const double back_m = kReturn * std::abs(f.height_m);
  const double rise = along(d, 0.0, std::max(f.width_m, 1e-3));
  const double fall = 1.0 - along(d, f.width_m + f.extent_m, f.width_m + f.extent_m + back_m);
  return share * f.height_m * rise * fall;
}

struct HazardKind {
  std::string_view name;
  Feature::Kind kind;
  double height_min_m, height_max_m;
  double width_min_m, width_max_m;
  double gap_min_m = 0.0;    // on the leg; 0: none
  double depth_min_m = 0.0;  // of walls back from both ends; 0: none
  double pen_m = 0.0;        // half of the side of a square around the end of the leg; 0: none
};
constexpr std::array<HazardKind, 12> kHazards = {
    HazardKind{"drop", Feature::Kind::kStep, -4.0, -0.8, 0.1, 0.4},
    HazardKind{"ledge", Feature::Kind::kStep, 0.5, 1.5, 0.1, 0.3},
    HazardKind{"ditch", Feature::Kind::kDitch, 0.8, 1.5, 1.0, 2.5},
    HazardKind{"wall", Feature::Kind::kWall, 0.8, 2.5, 0.3, 0.6},
    // Beyond the limit of the vehicle: 2 m in 2 to 2.6 m, 38 to 45 deg.
    HazardKind{"bank", Feature::Kind::kStep, 2.0, 2.0, 2.0, 2.6},
    // Around the limits of the vehicle: some can be driven over, and some cannot.
    HazardKind{"low_drop", Feature::Kind::kStep, -0.8, -0.2, 0.1, 0.4},
    HazardKind{"low_ledge", Feature::Kind::kStep, 0.2, 0.6, 0.1, 0.3},
    HazardKind{"small_ditch", Feature::Kind::kDitch, 0.3, 0.8, 0.6, 1.2},
    HazardKind{"slope", Feature::Kind::kStep, 2.0, 2.0, 2.8, 5.0},  // 22 to 36 deg
    HazardKind{"gate", Feature::Kind::kWall, 0.8, 2.5, 0.3, 0.6, 4.0},
    HazardKind{"dead_end", Feature::Kind::kWall, 0.8, 2.5, 0.3, 0.6, 0.0, 15.0},
    HazardKind{"pen", Feature::Kind::kWall, 0.8, 2.5, 0.3, 0.6, 0.0, 0.0, 10.0},
};
constexpr double kGapMore_m = 1.5;     // of the widest gap
constexpr double kDeadEndMin_m = 8.0;  // width
constexpr double kDeadEndMax_m = 14.0;

const HazardKind* find(std::string_view name) {
  const auto* const at = std::find_if(kHazards.begin(), kHazards.end(),
                                      [name](const HazardKind& h) { return h.name == name; });
  return at == kHazards.end() ? nullptr : at;
}

}  // namespace

double feature_height(const std::vector<Feature>& features, double x_m, double y_m) {
  double sum = 0.0;
  for (const Feature& f : features) sum += height_of(f, {x_m, y_m});
  return sum;
}

std::string unknown_hazard(const std::vector<std::string>& kinds) {
  for (const std::string& kind : kinds) {
    if (find(kind) == nullptr) return kind;
  }
  return "";
}

std::vector<Feature> draw_hazards(const HazardParams& params,
                                  const std::vector<Vec2>& waypoints_world, std::uint64_t seed) {
  std::vector<Feature> out;
  if (params.kinds.empty()) return out;
  Random random(seed, Stream::kHazards);
  const auto within = [&random](double low, double high) {
    return low + (high - low) * random.uniform();
  };
  for (std::size_t k = 1; k < waypoints_world.size(); ++k) {
    const Vec2 leg = waypoints_world[k] - waypoints_world[k - 1];
    const double length_m = leg.norm();
    const std::size_t which = random.bits() % params.kinds.size();
    const HazardKind* const kind = find(params.kinds[which]);
    const double at_m = within(0.4, 0.6) * length_m;
    const double turn = within(-params.turn_rad, params.turn_rad);
    const double line_m = within(params.length_min_m, params.length_max_m);
    const double shift = within(0.3, 0.7);  // share of the line on the right
    const double height_m = within(kind->height_min_m, kind->height_max_m);
    const double width_m = within(kind->width_min_m, kind->width_max_m);
    if (length_m < 2.0 * kLegEnd_m) continue;
    // From right to left as seen along the leg: the left of the line is behind it; the far side of
    // a step is on the right of its line, so it runs from left to right.
    const Vec2 u = leg / length_m;
    const Vec2 left(-u.y(), u.x());
    const Vec2 across = std::cos(turn) * left + std::sin(turn) * u;
    const Vec2 back(-across.y(), across.x());
    const Vec2 middle = waypoints_world[k - 1] + at_m * u;
    Feature f;
    f.kind = kind->kind;
    f.height_m = height_m;
    f.width_m = width_m;
    f.extent_m = 4.0;
    const auto add = [&out, &f](const Vec2& a_world, const Vec2& b_world) {
      f.a_world = a_world;
      f.b_world = b_world;
      out.push_back(f);
    };
    if (kind->pen_m > 0.0) {
      const Vec2 out_to = kind->pen_m * back;
      const Vec2 side = kind->pen_m * across;
      const Vec2& end = waypoints_world[k];
      add(end + out_to + side, end + out_to - side);
      add(end - out_to + side, end - out_to - side);
      add(end + out_to + side, end - out_to + side);
      add(end + out_to - side, end - out_to - side);
      continue;
    }
    if (kind->depth_min_m > 0.0) {
      const double max_m = std::min(params.depth_max_m, at_m - kLegEnd_m);
      const double depth_m = within(kind->depth_min_m, std::max(kind->depth_min_m, max_m));
      const Vec2 half = 0.5 * within(kDeadEndMin_m, kDeadEndMax_m) * across;
      add(middle + half, middle - half);
      add(middle + half, middle + half + depth_m * back);
      add(middle - half, middle - half + depth_m * back);
      continue;
    }
    const Vec2 a = middle + (1.0 - shift) * line_m * across;
    const Vec2 b = middle - shift * line_m * across;
    if (kind->gap_min_m > 0.0) {
      const double gap_m = within(kind->gap_min_m, kind->gap_min_m + kGapMore_m);
      add(a, middle + 0.5 * gap_m * across);
      add(middle - 0.5 * gap_m * across, b);
      continue;
    }
    add(a, b);
  }
  return out;
}

}  // namespace rcs::sim
