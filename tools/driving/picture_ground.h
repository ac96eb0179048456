#pragma once
// The simulated world from above, as parts of an SVG: the ground and its objects.

#include <iterator>
#include <string>

#include "sim/terrain/world.h"

namespace rcs::driving {

using SvgOut = std::back_insert_iterator<std::string>;

/// Metres east and north to pixels right and down.
struct View {
  Vec2 low_world;
  Vec2 high_world;
  double px_per_m;
  double left_px;
  double top_px;

  [[nodiscard]] double x(double east_m) const {
    return left_px + (east_m - low_world.x()) * px_per_m;
  }
  [[nodiscard]] double y(double north_m) const {
    return top_px + (high_world.y() - north_m) * px_per_m;
  }
  [[nodiscard]] double width_px() const { return (high_world - low_world).x() * px_per_m; }
  [[nodiscard]] double height_px() const { return (high_world - low_world).y() * px_per_m; }
};

/// Kinds of objects that a picture distinguishes.
enum class Kind { kLowRock, kRock, kBush, kCrown, kTrunk };

struct KindStyle {
  const char* fill;
  double opacity;
  double min_px;
};

[[nodiscard]] KindStyle style_of(Kind kind);

void add_circle(double x_px, double y_px, double radius_px, const KindStyle& style, SvgOut out);

/// Hill shading of the bare ground.
void add_ground(const sim::World& world, const View& view, SvgOut out);
/// Walls, ditches and edges that the scenario places.
void add_features(const sim::World& world, const View& view, SvgOut out);
/// Attributes of the line of a feature in pictures.
[[nodiscard]] std::string line_of(const sim::Feature& feature, double px_per_m);
/// Rocks, bushes and trees, true to scale where they can be seen.
void add_objects(const sim::World& world, const View& view, SvgOut out);

}  // namespace rcs::driving
