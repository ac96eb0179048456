#include "tools/studies/figures/scan_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "rcs/base/check.h"
#include "tools/base/statistics.h"

namespace rcs::studies {
namespace {

using report::Projection;
using report::Series;

constexpr double kStray = 0.01;          // share of the ranges on either side
constexpr std::size_t kMaxPairs = 1300;  // a line of the plot has 4000 vertices
constexpr double kColumn_m = 0.5;        // of the search for structure
constexpr double kLevel_m = 0.25;
constexpr int kGroundCubes = 2;  // of a column: ground and grass
constexpr double kWheelRadius_m = 0.35;

using Cell = std::pair<int, int>;  // row, column

/// Range of the nearest return of each cell.
std::map<Cell, double> ranges_of(const Points& points_ladar, const ImageShape& shape) {
  RCS_CHECK(shape.rows > 0 && shape.cols > 0 && shape.width_rad > 0.0 && shape.height_rad > 0.0);
  std::map<Cell, double> nearest;
  for (std::size_t i = 0; i < points_ladar.size(); ++i) {
    const Vec3 p = points_ladar[i].cast<double>();
    const double u = (shape.left_rad - std::atan2(p.y(), p.x())) / shape.width_rad * shape.cols;
    const double elevation_rad = std::atan2(p.z(), std::hypot(p.x(), p.y()));
    const double v = (elevation_rad - shape.lowest_rad) / shape.height_rad * shape.rows;
    if (!(u >= 0.0 && u < shape.cols && v >= 0.0 && v < shape.rows)) continue;
    const Cell at{static_cast<int>(v), static_cast<int>(u)};
    const auto [cell, added] = nearest.try_emplace(at, p.norm());
    if (!added) cell->second = std::min(cell->second, p.norm());
  }
  return nearest;
}

std::vector<double> sorted_ranges(const Points& points_ladar, const ImageShape& shape) {
  std::vector<double> sorted;
  for (const auto& [cell, range_m] : ranges_of(points_ladar, shape)) sorted.push_back(range_m);
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

/// Adds a closed polygon, after a gap.
void add_polygon(const std::vector<Vec3>& corners_vehicle, const Pose& T_picture_vehicle,
                 Projection projection, Series* s) {
  const std::size_t n = corners_vehicle.size();
  for (std::size_t i = 0; i <= n; ++i) {
    const Vec3 p = T_picture_vehicle * corners_vehicle[i % n];
    s->x.push_back(p.x());
    s->y.push_back(p[static_cast<int>(projection)]);
  }
  s->x.push_back(std::nan(""));
  s->y.push_back(std::nan(""));
}

std::vector<Vec3> wheel(double axle_m, double ground_m) {
  constexpr int kCorners = 24;
  std::vector<Vec3> corners;
  for (int k = 0; k < kCorners; ++k) {
    const double angle = 2.0 * kPi * k / kCorners;
    corners.emplace_back(axle_m + kWheelRadius_m * std::cos(angle), 0.0,
                         ground_m + kWheelRadius_m * (1.0 + std::sin(angle)));
  }
  return corners;
}

using Column = std::pair<int, int>;

/// Occupied cubes of each column.
std::map<Column, int> occupied(const Points& points) {
  std::set<std::tuple<int, int, int>> cubes;
  std::map<Column, int> columns;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = points[i].cast<double>();
    const Column c{static_cast<int>(std::floor(p.x() / kColumn_m)),
                   static_cast<int>(std::floor(p.y() / kColumn_m))};
    const int level = static_cast<int>(std::floor(p.z() / kLevel_m));
    if (cubes.emplace(c.first, c.second, level).second) ++columns[c];
  }
  return columns;
}

/// Structure of each column of both clouds: cubes above those of the ground.
std::map<Column, int> common_structure(const Points& a, const Points& b) {
  const std::map<Column, int> of_b = occupied(b);
  std::map<Column, int> common;
  for (const auto& [column, cubes] : occupied(a)) {
    const auto other = of_b.find(column);
    if (other == of_b.end()) continue;
    common[column] = std::max(0, std::min(cubes, other->second) - kGroundCubes);
  }
  return common;
}

/// Structure, then columns, of a window of columns.
std::pair<int, int> content(const std::map<Column, int>& structure, const Column& low,
                            const Column& high) {
  std::pair<int, int> sum{0, 0};
  for (int i = low.first; i <= high.first; ++i) {
    for (auto it = structure.lower_bound({i, low.second});
         it != structure.end() && it->first <= Column{i, high.second}; ++it) {
      sum.first += it->second;
      ++sum.second;
    }
  }
  return sum;
}

}  // namespace

RangeLimits common_limits(const Points& a, const Points& b, const ImageShape& shape) {
  const std::vector<double> of_a = sorted_ranges(a, shape);
  const std::vector<double> of_b = sorted_ranges(b, shape);
  if (of_a.empty() || of_b.empty()) return {};
  const double low = std::max(tools::percentile(of_a, kStray), tools::percentile(of_b, kStray));
  const double high =
      std::min(tools::percentile(of_a, 1.0 - kStray), tools::percentile(of_b, 1.0 - kStray));
  return {low, std::max(low, high)};
}

report::Plot range_image(const std::string& title, const Points& points_ladar,
                         const ImageShape& shape, const RangeLimits& limits) {
  report::Plot plot;
  plot.title = title;
  plot.x_label =
      fmt::format("column from the left, {:.2f} deg each", degrees(shape.width_rad / shape.cols));
  plot.y_label = fmt::format("row, {:.2f} deg", degrees(shape.height_rad / shape.rows));
  plot.equal_scales = true;
  plot.window = report::Window{0.0, double(shape.cols), 0.0, double(shape.rows)};
  plot.height_px = 90 + static_cast<int>(720.0 * shape.rows / shape.cols);
  report::CellMap map;
  map.value_label = "range [m]";
  map.log = true;
  for (const auto& [at, range_m] : ranges_of(points_ladar, shape)) {
    map.cells.push_back({at.second, at.first, std::clamp(range_m, limits.low_m, limits.high_m)});
  }
  plot.map = std::move(map);
  return plot;
}

Series vehicle_outline(const std::string& label, report::Colour colour, const VehicleShape& vehicle,
                       const Pose& T_picture_ladar, Projection projection) {
  Series s{label, colour, report::SeriesStyle::kLine, {}, {}, {}};
  const Pose T_picture_vehicle = T_picture_ladar * vehicle.T_ladar_vehicle;
  const VehicleShape& v = vehicle;
  if (projection == Projection::kAbove) {
    const double nose = v.front - std::min(1.0, 0.25 * (v.front - v.rear));
    add_polygon({{v.front, v.half_width, v.ground},
                 {v.front, -v.half_width, v.ground},
                 {v.rear, -v.half_width, v.ground},
                 {v.rear, v.half_width, v.ground}},
                T_picture_vehicle, projection, &s);
    add_polygon(
        {{nose, v.half_width, v.ground}, {v.front, 0.0, v.ground}, {nose, -v.half_width, v.ground}},
        T_picture_vehicle, projection, &s);
    return s;
  }
  const double belly = v.ground + kWheelRadius_m;
  add_polygon(
      {{v.front, 0.0, belly}, {v.front, 0.0, v.roof}, {v.rear, 0.0, v.roof}, {v.rear, 0.0, belly}},
      T_picture_vehicle, projection, &s);
  for (const double axle : {v.front_axle, v.rear_axle}) {
    add_polygon(wheel(axle, v.ground), T_picture_vehicle, projection, &s);
  }
  return s;
}

Series pair_lines(const std::string& label, report::Colour colour, const Points& from,
                  const Points& to, Projection projection) {
  RCS_CHECK(from.size() == to.size());
  Series s{label, colour, report::SeriesStyle::kLine, {}, {}, {}};
  const std::size_t step = 1 + from.size() / kMaxPairs;
  for (std::size_t i = 0; i < from.size(); i += step) {
    for (const Vec3f& p : {from[i], to[i]}) {
      s.x.push_back(static_cast<double>(p.x()));
      s.y.push_back(static_cast<double>(p[static_cast<int>(projection)]));
    }
    s.x.push_back(std::nan(""));
    s.y.push_back(std::nan(""));
  }
  return s;
}

Series big_dots(report::Colour colour, const Points& points, Projection projection) {
  Series s = pair_lines("", colour, points, points, projection);
  s.style = report::SeriesStyle::kThickLine;  // has round ends
  return s;
}

Points moved(const Points& points, const Pose& T_picture_points) {
  Points out;
  out.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.push_back((T_picture_points * points[i].cast<double>()).cast<float>());
  }
  return out;
}

bool inside(const report::Window& window, const Vec3f& point) {
  const Vec3 p = point.cast<double>();
  return p.x() >= window.x_low && p.x() <= window.x_high && p.y() >= window.y_low &&
         p.y() <= window.y_high;
}

Points inside(const report::Window& window, const Points& points) {
  Points out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (inside(window, points[i])) out.push_back(points[i]);
  }
  return out;
}

report::Window detail_window(const Points& a, const Points& b, double width_m, double height_m) {
  const std::map<Column, int> structure = common_structure(a, b);
  const int half_x = static_cast<int>(0.5 * width_m / kColumn_m);
  const int half_y = static_cast<int>(0.5 * height_m / kColumn_m);
  Column best{0, 0};
  std::pair<int, int> most{-1, -1};
  for (const auto& [centre, cubes] : structure) {
    const std::pair<int, int> found =
        content(structure, {centre.first - half_x, centre.second - half_y},
                {centre.first + half_x, centre.second + half_y});
    if (found > most) {
      most = found;
      best = centre;
    }
  }
  const double x = (best.first + 0.5) * kColumn_m;
  const double y = (best.second + 0.5) * kColumn_m;
  return {x - 0.5 * width_m, x + 0.5 * width_m, y - 0.5 * height_m, y + 0.5 * height_m};
}

}  // namespace rcs::studies
