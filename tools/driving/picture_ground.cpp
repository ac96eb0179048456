#include "tools/driving/picture_ground.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace rcs::driving {
namespace {

constexpr int kCellsAcross = 180;  // of the ground's shading
constexpr int kShades = 14;

/// Heights on a lattice over the view, north first, without details that are too small to be
/// visible.
class SmoothGround {
 public:
  SmoothGround(const sim::Relief& relief, const View& view, int cols, int rows, double cell_m)
      : cols_(cols + 2 * kRadius + 1) {
    const int all_rows = rows + 2 * kRadius + 1;
    for (int j = 0; j < all_rows; ++j) {
      for (int i = 0; i < cols_; ++i) {
        z_.push_back(relief.height(view.low_world.x() + (i - kRadius) * cell_m,
                                   view.high_world.y() - (j - kRadius) * cell_m));
      }
    }
  }
  [[nodiscard]] double at(int i, int j) const {
    double sum = 0.0;
    double weights = 0.0;
    for (int b = -kRadius; b <= kRadius; ++b) {
      for (int a = -kRadius; a <= kRadius; ++a) {
        const double w = std::exp(-0.5 * (a * a + b * b));
        const int k = (j + b + kRadius) * cols_ + i + a + kRadius;
        sum += w * z_[static_cast<std::size_t>(k)];
        weights += w;
      }
    }
    return sum / weights;
  }

 private:
  static constexpr int kRadius = 2;
  int cols_;
  std::vector<double> z_;
};

Kind kind_of(const sim::Spheroid& o, double ground_m) {
  const double above_m = o.centre_world.z() - ground_m;
  if (o.extinction_1pm > 0.0) return above_m < o.half_height_m ? Kind::kBush : Kind::kCrown;
  if (o.half_height_m > 3.0 * o.radius_m) return Kind::kTrunk;
  return above_m + o.half_height_m > 0.3 ? Kind::kRock : Kind::kLowRock;
}

}  // namespace

KindStyle style_of(Kind kind) {
  switch (kind) {
    case Kind::kLowRock:
      return {"#8d8d8d", 0.9, 0.9};
    case Kind::kRock:
      return {"#3a3a3a", 1.0, 1.6};
    case Kind::kBush:
      return {"#6b8e23", 0.85, 1.5};
    case Kind::kCrown:
      return {"#2e7d32", 0.35, 2.0};
    case Kind::kTrunk:
      break;
  }
  return {"#5d2f0e", 1.0, 1.8};
}

void add_circle(double x_px, double y_px, double radius_px, const KindStyle& style, SvgOut out) {
  fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"{}\"", x_px, y_px,
                 std::max(radius_px, style.min_px), style.fill);
  if (style.opacity < 1.0) fmt::format_to(out, " fill-opacity=\"{}\"", style.opacity);
  fmt::format_to(out, "/>\n");
}

// Light from the north-west, as on maps: otherwise hills look like hollows. Runs of equal shade are
// one rectangle, and a shade is one path.
void add_ground(const sim::World& world, const View& view, SvgOut out) {
  const double cell_m = (view.high_world - view.low_world).x() / kCellsAcross;
  const int rows = static_cast<int>(std::ceil((view.high_world - view.low_world).y() / cell_m));
  const SmoothGround ground(world.relief(), view, kCellsAcross, rows, cell_m);
  std::array<std::string, kShades> paths;
  const Vec3 light = Vec3(-1.0, 1.0, 1.3).normalized();
  constexpr double kExaggeration = 3.0;
  for (int j = 0; j < rows; ++j) {
    int begin = 0;
    int last = -1;
    for (int i = 0; i <= kCellsAcross; ++i) {
      int shade = -1;
      if (i < kCellsAcross) {
        const double z = ground.at(i, j);
        const Vec3 normal = Vec3(-kExaggeration * (ground.at(i + 1, j) - z) / cell_m,
                                 kExaggeration * (ground.at(i, j + 1) - z) / cell_m, 1.0)
                                .normalized();
        const double lit = std::clamp(normal.dot(light), 0.0, 1.0);
        shade = std::min(kShades - 1, static_cast<int>(lit * kShades));
      }
      if (shade == last) continue;
      if (last >= 0) {
        fmt::format_to(std::back_inserter(paths[static_cast<std::size_t>(last)]),
                       "M{} {}h{}v1h-{}z", begin, j, i - begin, i - begin);
      }
      begin = i;
      last = shade;
    }
  }
  fmt::format_to(out,
                 "<g transform=\"translate({:.1f} {:.1f}) scale({:.4f})\" "
                 "shape-rendering=\"crispEdges\">\n",
                 view.x(view.low_world.x()), view.y(view.high_world.y()), cell_m * view.px_per_m);
  for (int k = 0; k < kShades; ++k) {
    const double share = static_cast<double>(k) / (kShades - 1);
    const auto mix = [share](int dark, int bright) {
      return static_cast<int>(std::lround(dark + share * (bright - dark)));
    };
    const std::string& path = paths[static_cast<std::size_t>(k)];
    if (path.empty()) continue;
    fmt::format_to(out, "<path fill=\"#{:02x}{:02x}{:02x}\" d=\"{}\"/>\n", mix(120, 247),
                   mix(122, 246), mix(104, 236), path);
  }
  fmt::format_to(out, "</g>\n");
}

std::string line_of(const sim::Feature& feature, double px_per_m) {
  using Shape = sim::Feature::Kind;
  const double width_px = feature.kind == Shape::kStep ? 2.5 : feature.width_m * px_per_m;
  return fmt::format("stroke=\"{}\" stroke-width=\"{:.1f}\"{}",
                     feature.kind == Shape::kWall ? "#222" : "#7a3b10", std::max(2.5, width_px),
                     feature.kind == Shape::kStep ? " stroke-dasharray=\"3 2\"" : "");
}

void add_features(const sim::World& world, const View& view, SvgOut out) {
  for (const sim::Feature& f : world.relief().features()) {
    fmt::format_to(out, "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" fill=\"none\" {}/>\n",
                   view.x(f.a_world.x()), view.y(f.a_world.y()), view.x(f.b_world.x()),
                   view.y(f.b_world.y()), line_of(f, view.px_per_m));
  }
}

void add_objects(const sim::World& world, const View& view, SvgOut out) {
  std::vector<sim::Spheroid> objects;
  const Vec2 middle = 0.5 * (view.low_world + view.high_world);
  world.objects_near(middle, 0.5 * (view.high_world - view.low_world).norm(), &objects);
  for (const Kind kind : {Kind::kLowRock, Kind::kRock, Kind::kBush, Kind::kTrunk, Kind::kCrown}) {
    for (const sim::Spheroid& o : objects) {
      const Vec3& p = o.centre_world;
      const bool seen = (p.head<2>() - view.low_world).minCoeff() > o.radius_m &&
                        (view.high_world - p.head<2>()).minCoeff() > o.radius_m;
      if (!seen || kind_of(o, world.relief().height(p.x(), p.y())) != kind) continue;
      add_circle(view.x(p.x()), view.y(p.y()), o.radius_m * view.px_per_m, style_of(kind), out);
    }
  }
}

}  // namespace rcs::driving
