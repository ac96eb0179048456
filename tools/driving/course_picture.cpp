#include "tools/driving/course_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "rcs/base/check.h"
#include "tools/driving/picture_ground.h"
#include "tools/report/svg_plot.h"
#include "tools/report/viridis.h"

namespace rcs::driving {
namespace {

constexpr double kMapWidth_px = 900.0;
constexpr double kMapHeight_px = 640.0;
constexpr double kMargin_m = 12.0;
constexpr double kMarginShare = 0.03;
constexpr double kBorder_px = 16.0;
constexpr double kLegendHeight_px = 92.0;
constexpr double kRow_px = 32.0;  // of the legend

constexpr char kLost[] = "#d62728";
constexpr char kEstimate[] = "#d0118a";
constexpr char kPlan[] = "#1f5fbf";
constexpr char kActor[] = "#b35c00";
constexpr char kChosenRoute[] = "stroke=\"#111\" stroke-width=\"2\" stroke-dasharray=\"9 4\"";
constexpr char kOtherRoute[] = "stroke=\"#8a2be2\" stroke-width=\"2\" stroke-dasharray=\"2 4\"";
constexpr char kRoad[] = "#b9b0a2";

View view_of(const CoursePicture& picture) {
  Vec2 low = picture.samples.front().place_world;
  Vec2 high = low;
  const auto hold = [&](const Vec2& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  };
  for (const CourseSample& s : picture.samples) hold(s.place_world);
  for (const Vec2& p : picture.waypoints_world) hold(p);
  // Of a long course a few metres are less than the mark of a waypoint.
  const double margin_m = std::max(kMargin_m, kMarginShare * (high - low).maxCoeff());
  low -= Vec2::Constant(margin_m);
  high += Vec2::Constant(margin_m);
  // A narrow course gets additional terrain at its sides: the legend needs the width.
  const Vec2 size = high - low;
  const double more_m = std::max(0.0, kMapWidth_px / kMapHeight_px * size.y() - size.x());
  low.x() -= 0.5 * more_m;
  high.x() += 0.5 * more_m;
  const double more_north_m = std::max(0.0, 0.45 * (high - low).x() - size.y());
  low.y() -= 0.5 * more_north_m;
  high.y() += 0.5 * more_north_m;
  const double px_per_m =
      std::min(kMapWidth_px / (high - low).x(), kMapHeight_px / (high - low).y());
  const double top_px = 44.0 + 18.0 * static_cast<double>(picture.facts.size());
  return {low, high, px_per_m, kBorder_px, top_px};
}

void add_style(SvgOut out) {
  fmt::format_to(out,
                 "<style>"
                 "text{{font:13px system-ui,sans-serif;fill:#222}}"
                 ".title{{font-size:17px;font-weight:600}}"
                 ".pin{{font-weight:700;fill:#fff;text-anchor:middle}}"
                 ".line{{fill:none;stroke-linejoin:round;stroke-linecap:round}}"
                 "</style>\n");
}

void add_line(const std::vector<Vec2>& points, const View& view, std::string_view style,
              SvgOut out) {
  if (points.size() < 2) return;
  fmt::format_to(out, "<polyline class=\"line\" {} points=\"", style);
  for (const Vec2& p : points) fmt::format_to(out, "{:.1f},{:.1f} ", view.x(p.x()), view.y(p.y()));
  fmt::format_to(out, "\"/>\n");
}

double top_speed(const CoursePicture& picture) {
  double top_mps = 1.0;
  for (const CourseSample& s : picture.samples) top_mps = std::max(top_mps, s.speed_mps);
  return std::ceil(top_mps - 0.2);
}

/// Runs of samples that agree in `of`, each with the first sample of the next.
template <class Of, class Add>
void for_runs(const std::vector<CourseSample>& samples, const Of& of, const Add& add) {
  std::vector<Vec2> run = {samples.front().place_world};
  for (std::size_t k = 1; k < samples.size(); ++k) {
    run.push_back(samples[k].place_world);
    if (k + 1 < samples.size() && of(samples[k]) == of(samples[k - 1])) continue;
    add(run, of(samples[k - 1]));
    run = {samples[k].place_world};
  }
}

void add_paths(const CoursePicture& picture, const View& view, SvgOut out) {
  for_runs(
      picture.samples, [](const CourseSample& s) { return s.gps; },
      [&](const std::vector<Vec2>& run, bool gps) {
        if (gps) return;
        add_line(run, view,
                 fmt::format("stroke=\"{}\" stroke-width=\"15\" stroke-opacity=\"0.3\"", kLost),
                 out);
      });
  for (const std::vector<Vec2>& plan : picture.plans_world) {
    add_line(plan, view,
             fmt::format("stroke=\"{}\" stroke-width=\"0.8\" stroke-opacity=\"0.45\"", kPlan), out);
  }
  std::vector<Vec2> whole;
  for (const CourseSample& s : picture.samples) whole.push_back(s.place_world);
  add_line(whole, view, "stroke=\"#fff\" stroke-width=\"6.5\"", out);
  const double top_mps = top_speed(picture);
  const int colours = static_cast<int>(report::kViridis.size());
  for_runs(
      picture.samples,
      [&](const CourseSample& s) {
        return std::min(colours - 1, static_cast<int>(colours * s.speed_mps / top_mps));
      },
      [&](const std::vector<Vec2>& run, int colour) {
        add_line(run, view,
                 fmt::format("stroke=\"{}\" stroke-width=\"4\"",
                             report::kViridis[static_cast<std::size_t>(colour)]),
                 out);
      });
  std::vector<Vec2> estimated;
  for (const CourseSample& s : picture.samples) {
    if (s.estimated_world) estimated.push_back(*s.estimated_world);
  }
  add_line(estimated, view,
           fmt::format("stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"5 4\"", kEstimate),
           out);
}

std::string_view style_of(ZoneKind kind) {
  switch (kind) {
    case ZoneKind::kFence:
      return "fill=\"none\" stroke=\"#111\" stroke-width=\"2\" stroke-dasharray=\"10 4 2 4\"";
    case ZoneKind::kKeepOut:
      return "fill=\"#b3261e\" fill-opacity=\"0.25\" stroke=\"#b3261e\" stroke-width=\"2\"";
    case ZoneKind::kRoad:
      return "fill=\"none\" stroke=\"#2a6f3c\" stroke-width=\"2\" stroke-dasharray=\"8 3\"";
    case ZoneKind::kSpeed:
      break;
  }
  return "fill=\"none\" stroke=\"#8a6d00\" stroke-width=\"2\" stroke-dasharray=\"4 4\"";
}

void add_zones(const CoursePicture& picture, const View& view, SvgOut out) {
  for (const CoursePicture::ZoneBorder& zone : picture.zones_world) {
    fmt::format_to(out, "<polygon {} points=\"", style_of(zone.kind));
    for (const Vec2& p : zone.ring_world) {
      fmt::format_to(out, "{:.1f},{:.1f} ", view.x(p.x()), view.y(p.y()));
    }
    fmt::format_to(out, "\"/>\n");
  }
}

void add_roads(const CoursePicture& picture, const View& view, SvgOut out) {
  for (const sim::Road& road : picture.world->relief().roads()) {
    add_line(road.points_world, view,
             fmt::format("stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-opacity=\"0.7\"", kRoad,
                         road.width_m * view.px_per_m),
             out);
  }
}

/// The others first: the chosen one is above them.
void add_routes(const CoursePicture& picture, const View& view, SvgOut out) {
  for (const bool chosen : {false, true}) {
    for (const CoursePicture::Route& route : picture.routes_world) {
      if (route.chosen != chosen) continue;
      add_line(route.points_world, view, chosen ? kChosenRoute : kOtherRoute, out);
    }
  }
}

/// A line with a dot where each actor was at last.
void add_actors(const CoursePicture& picture, const View& view, SvgOut out) {
  for (const std::vector<Vec2>& path : picture.actors_world) {
    if (path.empty()) continue;
    add_line(path, view,
             fmt::format("stroke=\"{}\" stroke-width=\"2.4\" stroke-dasharray=\"1 5\"", kActor),
             out);
    fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n",
                   view.x(path.back().x()), view.y(path.back().y()), kActor);
  }
}

void add_vehicle(const CourseSample& at, const View& view, SvgOut out) {
  constexpr double kLength_m = 3.2;
  constexpr double kWidth_m = 2.0;
  fmt::format_to(out,
                 "<g transform=\"translate({:.1f} {:.1f}) rotate({:.1f}) scale({:.3f})\">"
                 "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"#fff\" "
                 "stroke=\"#111\" stroke-width=\"0.35\"/>"
                 "<path d=\"M0.5 -0.7L1.4 0L0.5 0.7z\" fill=\"#111\"/></g>\n",
                 view.x(at.place_world.x()), view.y(at.place_world.y()), -degrees(at.heading_rad),
                 view.px_per_m, -0.5 * kLength_m, -0.5 * kWidth_m, kLength_m, kWidth_m);
}

void add_cross(double x_px, double y_px, SvgOut out) {
  fmt::format_to(out,
                 "<path d=\"M{:.1f} {:.1f}l12 12m0 -12l-12 12\" stroke=\"{}\" "
                 "stroke-width=\"4\"/>\n",
                 x_px - 6.0, y_px - 6.0, kLost);
}

/// Position of each contact.
int add_hits(const CoursePicture& picture, const View& view, SvgOut out) {
  int hits = 0;
  for (std::size_t k = 1; k < picture.samples.size(); ++k) {
    if (!picture.samples[k].hit) continue;
    const Vec2& p = picture.samples[k].place_world;
    add_cross(view.x(p.x()), view.y(p.y()), out);
    ++hits;
  }
  return hits;
}

void add_pin(double x_px, double y_px, std::string_view text, SvgOut out) {
  fmt::format_to(out,
                 "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9.5\" fill=\"#b3261e\" stroke=\"#fff\" "
                 "stroke-width=\"1.5\"/><text class=\"pin\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
                 x_px, y_px, x_px, y_px + 4.5, text);
}

void add_waypoints(const CoursePicture& picture, const View& view, SvgOut out) {
  for (std::size_t k = 0; k < picture.waypoints_world.size(); ++k) {
    const Vec2& p = picture.waypoints_world[k];
    const double radius_px = picture.radius_m * view.px_per_m;
    fmt::format_to(out,
                   "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" fill=\"none\" "
                   "stroke=\"#b3261e\" stroke-width=\"1.6\" stroke-dasharray=\"4 3\"/>\n",
                   view.x(p.x()), view.y(p.y()), radius_px);
    // Next to the circle, so that its interior is visible.
    add_pin(view.x(p.x()) + 0.7 * radius_px + 8.0, view.y(p.y()) - 0.7 * radius_px - 8.0,
            std::to_string(k + 1), out);
  }
}

void add_scale(const View& view, SvgOut out) {
  const double bar_m = view.px_per_m * 50.0 < 260.0 ? 50.0 : 20.0;
  const double x = kBorder_px + 14.0;
  const double y = view.top_px + view.height_px() - 16.0;
  fmt::format_to(
      out,
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"30\" rx=\"4\" "
      "fill=\"#fff\" fill-opacity=\"0.8\"/>"
      "<path d=\"M{:.1f} {:.1f}v6h{:.1f}v-6\" fill=\"none\" stroke=\"#222\" "
      "stroke-width=\"1.5\"/><text x=\"{:.1f}\" y=\"{:.1f}\">{:.0f} m, north is up</text>\n",
      x - 8.0, y - 20.0, std::max(bar_m * view.px_per_m, 120.0) + 16.0, x, y - 1.0,
      bar_m * view.px_per_m, x + 4.0, y - 5.0, bar_m);
}

/// Of this kind; null: of any.
bool has_feature(const CoursePicture& picture, const sim::Feature::Kind* kind) {
  const auto& features = picture.world->relief().features();
  return std::any_of(features.begin(), features.end(),
                     [kind](const sim::Feature& f) { return kind == nullptr || f.kind == *kind; });
}

/// A border of this kind is in view.
bool shows_zone(const CoursePicture& picture, const View& view, ZoneKind kind) {
  constexpr int kSamples = 64;  // of an edge
  const auto visible = [&view](const std::vector<Vec2>& ring) {
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2 edge = ring[(k + 1) % ring.size()] - ring[k];
      for (int s = 0; s < kSamples; ++s) {
        const Vec2 p = ring[k] + static_cast<double>(s) / kSamples * edge;
        if ((p.array() > view.low_world.array()).all() &&
            (p.array() < view.high_world.array()).all()) {
          return true;
        }
      }
    }
    return false;
  };
  return std::any_of(
      picture.zones_world.begin(), picture.zones_world.end(),
      [&](const CoursePicture::ZoneBorder& z) { return z.kind == kind && visible(z.ring_world); });
}

/// Two rows under the map, and a third one if there are features, zones, roads or routes.
void add_legend(const CoursePicture& picture, const View& view, bool hits, SvgOut out) {
  const double top = view.top_px + view.height_px() + 26.0;
  double x = kBorder_px + 8.0;
  const auto label = [&](double symbol_px, double y, std::string_view text, double width_px) {
    fmt::format_to(out, "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", x + symbol_px, y + 4.5,
                   text);
    x += symbol_px + width_px;
  };
  const auto line = [&](std::string_view style) {
    fmt::format_to(out, "<path class=\"line\" d=\"M{:.1f} {:.1f}h34\" {}/>", x, top, style);
  };
  const double top_mps = top_speed(picture);
  constexpr double kStep_px = 108.0 / report::kViridis.size();
  for (std::size_t k = 0; k < report::kViridis.size(); ++k) {
    fmt::format_to(out, "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"7\" fill=\"{}\"/>",
                   x + kStep_px * static_cast<double>(k), top - 3.5, kStep_px, report::kViridis[k]);
  }
  label(115.0, top, fmt::format("true path, 0 to {:.0f} m/s", top_mps), 175.0);
  line(fmt::format("stroke=\"{}\" stroke-width=\"1.6\" stroke-dasharray=\"5 4\"", kEstimate));
  label(42.0, top, "estimated path", 160.0);
  line(fmt::format("stroke=\"{}\" stroke-width=\"1\"", kPlan));
  label(42.0, top, "plans", 60.0);
  line(fmt::format("stroke=\"{}\" stroke-width=\"15\" stroke-opacity=\"0.3\"", kLost));
  label(50.0, top, "without GPS", 95.0);
  if (!picture.actors_world.empty()) {
    line(fmt::format("stroke=\"{}\" stroke-width=\"2.4\" stroke-dasharray=\"1 5\"", kActor));
    label(42.0, top, "actors", 55.0);
  }
  if (hits) {
    add_cross(x + 8.0, top, out);
    label(22.0, top, "contact", 80.0);
  }

  const double second = top + kRow_px;
  x = kBorder_px + 8.0;
  const auto symbol = [&](Kind kind, double radius_px, std::string_view text, double width_px) {
    add_circle(x + 9.0, second, radius_px, style_of(kind), out);
    label(22.0, second, text, width_px);
  };
  symbol(Kind::kRock, 4.0, "rock", 45.0);
  symbol(Kind::kLowRock, 2.5, "lower than 0.3 m", 132.0);
  add_circle(x + 9.0, second, 9.0, style_of(Kind::kCrown), out);
  symbol(Kind::kTrunk, 2.0, "tree: trunk and crown", 145.0);
  symbol(Kind::kBush, 5.0, "bush", 48.0);
  add_pin(x + 9.0, second, "1", out);
  label(26.0, second, fmt::format("waypoint, reached within {:.0f} m", picture.radius_m), 215.0);
  fmt::format_to(out,
                 "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"22\" height=\"13\" fill=\"#fff\" "
                 "stroke=\"#111\" stroke-width=\"2\"/>",
                 x, second - 6.5);
  label(28.0, second, "vehicle at start and end", 100.0);

  using Feature = sim::Feature::Kind;
  const double third = second + kRow_px;
  x = kBorder_px + 8.0;
  for (const auto& [kind, name] :
       {std::pair{Feature::kWall, "wall"}, std::pair{Feature::kDitch, "ditch"},
        std::pair{Feature::kStep, "edge of a drop, ledge or bank"}}) {
    sim::Feature feature;
    feature.kind = kind;
    if (!has_feature(picture, &kind)) continue;
    fmt::format_to(out, "<path d=\"M{:.1f} {:.1f}h34\" fill=\"none\" {}/>", x, third,
                   line_of(feature, view.px_per_m));
    label(42.0, third, name, 60.0);
  }
  for (const auto& [kind, name] :
       {std::pair{ZoneKind::kFence, "fence"}, std::pair{ZoneKind::kKeepOut, "keep-out"},
        std::pair{ZoneKind::kSpeed, "speed zone"}, std::pair{ZoneKind::kRoad, "mapped road"}}) {
    if (!shows_zone(picture, view, kind)) continue;
    fmt::format_to(out, "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"30\" height=\"12\" {}/>", x,
                   third - 6.0, style_of(kind));
    label(38.0, third, name, 100.0);
  }
  const auto third_line = [&](std::string_view style, std::string_view text, double width_px) {
    fmt::format_to(out, "<path class=\"line\" d=\"M{:.1f} {:.1f}h34\" {}/>", x, third, style);
    label(42.0, third, text, width_px);
  };
  if (!picture.world->relief().roads().empty()) {
    third_line(fmt::format("stroke=\"{}\" stroke-width=\"10\"", kRoad), "road or plain", 100.0);
  }
  if (!picture.routes_world.empty()) {
    third_line(kChosenRoute, "chosen route", 95.0);
    third_line(kOtherRoute, "other candidates", 110.0);
  }
}

}  // namespace

std::string render(const CoursePicture& picture) {
  RCS_CHECK(picture.world != nullptr && picture.samples.size() >= 2);
  const View view = view_of(picture);
  const double width = view.width_px() + 2.0 * kBorder_px;
  const bool third_row = has_feature(picture, nullptr) || !picture.zones_world.empty() ||
                         !picture.routes_world.empty() || !picture.world->relief().roads().empty();
  const double height =
      view.top_px + view.height_px() + kLegendHeight_px + (third_row ? kRow_px : 0.0);
  std::string svg;
  const SvgOut out(svg);
  fmt::format_to(out,
                 "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" "
                 "width=\"{:.0f}\" height=\"{:.0f}\" role=\"img\">\n<title>{}</title>\n",
                 width, height, width, height, report::escape_xml(picture.title));
  add_style(out);
  fmt::format_to(out, "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
  fmt::format_to(out, "<text class=\"title\" x=\"{:.0f}\" y=\"28\">{}</text>\n", kBorder_px,
                 report::escape_xml(picture.title));
  for (std::size_t k = 0; k < picture.facts.size(); ++k) {
    fmt::format_to(out, "<text x=\"{:.0f}\" y=\"{:.0f}\">{}</text>\n", kBorder_px,
                   48.0 + 18.0 * static_cast<double>(k), report::escape_xml(picture.facts[k]));
  }
  fmt::format_to(out,
                 "<clipPath id=\"map\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" "
                 "height=\"{:.1f}\"/></clipPath>\n<g clip-path=\"url(#map)\">\n",
                 kBorder_px, view.top_px, view.width_px(), view.height_px());
  add_ground(*picture.world, view, out);
  add_roads(picture, view, out);
  add_features(*picture.world, view, out);
  add_objects(*picture.world, view, out);
  add_zones(picture, view, out);
  add_paths(picture, view, out);
  add_routes(picture, view, out);
  add_actors(picture, view, out);
  add_vehicle(picture.samples.front(), view, out);
  add_vehicle(picture.samples.back(), view, out);
  add_waypoints(picture, view, out);
  const int hits = add_hits(picture, view, out);
  add_scale(view, out);
  fmt::format_to(out, "</g>\n");
  add_legend(picture, view, hits > 0, out);
  fmt::format_to(out, "</svg>\n");
  return svg;
}

}  // namespace rcs::driving
