#include "modules/mission/route_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rcs::mission {
namespace {

struct Step {
  int i, j;
};
constexpr std::array<Step, 16> kSteps = {{{1, 0},
                                          {0, 1},
                                          {-1, 0},
                                          {0, -1},
                                          {1, 1},
                                          {-1, 1},
                                          {-1, -1},
                                          {1, -1},
                                          {2, 1},
                                          {1, 2},
                                          {-1, 2},
                                          {-2, 1},
                                          {-2, -1},
                                          {-1, -2},
                                          {1, -2},
                                          {2, -1}}};

/// A line may pass between two cells that touch at a corner only if it may pass both.
bool passes_corner(const RouteMap& map, Cell from, Cell to) {
  return !std::isinf(map.cost({to.i, from.j})) && !std::isinf(map.cost({from.i, to.j}));
}

/// Of the line between two positions; infinite if it leads through an impassable cell, the cells of
/// its ends excepted. Visits every cell on the line (Amanatides and Woo 1987).
double cost_of(const RouteMap& map, const Vec2& a, const Vec2& b, double poverty) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  constexpr double kCorner = 1e-9;
  const double length = (b - a).norm();
  const Vec2 low = map.centre({0, 0}) - Vec2::Constant(0.5 * map.cell_m());
  const Vec2 from = (a - low) / map.cell_m();
  const Vec2 way = (b - a) / map.cell_m();
  const Cell first = map.cell_at(a);
  const Cell last = map.cell_at(b);
  // Shares of the line at which it enters the next column and the next row.
  const auto next = [](double p, int cell, double d) {
    return d > 0.0 ? (cell + 1 - p) / d : d < 0.0 ? (cell - p) / d : kNever;
  };
  double column = next(from.x(), first.i, way.x());
  double row = next(from.y(), first.j, way.y());
  const Cell step = {way.x() > 0.0 ? 1 : -1, way.y() > 0.0 ? 1 : -1};
  Cell c = first;
  double sum = 0.0;
  for (double at = 0.0;;) {
    const double cost = map.cost(c);
    if (std::isinf(cost) && !(c == first || c == last)) return kNever;
    const double end = std::min({column, row, 1.0});
    sum += ((std::isinf(cost) ? 1.0 : cost) + poverty * map.poverty(c)) * (end - at) * length;
    if (end >= 1.0) return sum;
    at = end;
    const Cell before = c;
    const bool both = std::abs(column - row) < kCorner;
    if (both || column < row) {
      c.i += step.i;
      column += std::abs(1.0 / way.x());
    }
    if (both || c.i == before.i) {
      c.j += step.j;
      row += std::abs(1.0 / way.y());
    }
    if (both && !passes_corner(map, before, c)) return kNever;
  }
}

RouteLine shortened(const RouteMap& map, const RouteLine& line, double poverty) {
  if (line.size() < 3) return line;
  // cost from the start to each place, along the line
  std::vector<double> sum(line.size(), 0.0);
  for (std::size_t k = 1; k < line.size(); ++k) {
    const double cost = cost_of(map, line[k - 1], line[k], poverty);
    // From a position in its cell the first step may touch a cell that it passes from its centre.
    sum[k] = sum[k - 1] + (std::isinf(cost) ? (line[k] - line[k - 1]).norm() : cost);
  }
  constexpr double kAsGood = 1.001;
  RouteLine out = {line.front()};
  for (std::size_t k = 0; k + 1 < line.size();) {
    std::size_t next = k + 1;
    // The farthest place that a straight line reaches as cheaply; the line bends slowly, so that a
    // search from the near end would stop too early only at the price of a longer list.
    for (std::size_t far = k + 2; far < line.size(); ++far) {
      if (cost_of(map, line[k], line[far], poverty) > kAsGood * (sum[far] - sum[k])) break;
      next = far;
    }
    out.push_back(line[next]);
    k = next;
  }
  return out;
}

}  // namespace

RouteLine RouteSearch::find(const RouteMap& map, const Vec2& from, const Vec2& to, double poverty) {
  const Cell first = map.cell_at(from);
  const Cell last = map.cell_at(to);
  if (!map.contains(first) || !map.contains(last)) return {};
  const int width = map.width();
  const auto cells = static_cast<std::size_t>(width) * static_cast<std::size_t>(map.height());
  cost_.assign(cells, RouteMap::kNever);
  before_.assign(cells, -1);
  open_.clear();
  const int goal = last.j * width + last.i;
  const auto later = [](const Open& a, const Open& b) {
    return a.estimate > b.estimate || (a.estimate == b.estimate && a.cell > b.cell);
  };
  const auto cell_m = static_cast<float>(map.cell_m());
  const auto remaining = [&](Cell c) {
    return cell_m * std::hypot(static_cast<float>(c.i - last.i), static_cast<float>(c.j - last.j));
  };
  const auto cost_at = [&](Cell c) {
    // The vehicle stands in the first cell and is sent into the last one.
    const float cost = c == first || c == last ? std::min(map.cost(c), 100.0F) : map.cost(c);
    return cost + static_cast<float>(poverty) * map.poverty(c);
  };
  const int start = first.j * width + first.i;
  cost_[static_cast<std::size_t>(start)] = 0.0F;
  open_.push_back({remaining(first), start});
  while (!open_.empty()) {
    std::pop_heap(open_.begin(), open_.end(), later);
    const Open at = open_.back();
    open_.pop_back();
    if (at.cell == goal) break;
    const Cell c = {at.cell % width, at.cell / width};
    const float here = cost_[static_cast<std::size_t>(at.cell)];
    if (at.estimate > here + remaining(c) + 0.01F) continue;  // reached more cheaply meanwhile
    for (const Step& s : kSteps) {
      const Cell n = {c.i + s.i, c.j + s.j};
      if (!map.contains(n)) continue;
      const bool diagonal = std::abs(s.i) == 1 && std::abs(s.j) == 1;
      if (diagonal && !passes_corner(map, c, n)) continue;
      float cost = 0.5F * (cost_at(c) + cost_at(n));
      if (std::abs(s.i) == 2 || std::abs(s.j) == 2) {
        // Both cells that a long step passes.
        const Cell a = {c.i + s.i / 2, c.j + s.j / 2};
        const Cell b = {n.i - s.i / 2, n.j - s.j / 2};
        cost = 0.25F * (cost_at(c) + cost_at(a) + cost_at(b) + cost_at(n));
      }
      if (std::isinf(cost)) continue;
      const float way =
          here + cost * cell_m * std::hypot(static_cast<float>(s.i), static_cast<float>(s.j));
      const auto k = static_cast<std::size_t>(n.j) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(n.i);
      if (way >= cost_[k]) continue;
      cost_[k] = way;
      before_[k] = at.cell;
      open_.push_back({way + remaining(n), static_cast<int>(k)});
      std::push_heap(open_.begin(), open_.end(), later);
    }
  }
  if (start != goal && before_[static_cast<std::size_t>(goal)] < 0) return {};
  RouteLine line = trace(map, start, goal);
  line.front() = from;
  line.back() = to;
  return shortened(map, line, poverty);
}

RouteLine RouteSearch::trace(const RouteMap& map, int from, int to) const {
  RouteLine line;
  for (int at = to; at != from; at = before_[static_cast<std::size_t>(at)]) {
    line.push_back(map.centre({at % map.width(), at / map.width()}));
  }
  line.push_back(map.centre({from % map.width(), from / map.width()}));
  if (line.size() == 1) line.push_back(line.front());
  std::reverse(line.begin(), line.end());
  return line;
}

double length_m(const RouteLine& line) {
  double sum = 0.0;
  for (std::size_t k = 1; k < line.size(); ++k) sum += (line[k] - line[k - 1]).norm();
  return sum;
}

double driving_time_s(const RouteMap& map, const RouteLine& line, double speed_mps) {
  double sum = 0.0;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vec2 way = line[k] - line[k - 1];
    const int n = std::max(1, static_cast<int>(std::ceil(2.0 * way.norm() / map.cell_m())));
    for (int s = 0; s < n; ++s) {
      const Cell c = map.cell_at(line[k - 1] + (s + 0.5) / n * way);
      sum += map.slowness(c) * way.norm() / n / speed_mps;
    }
  }
  return sum;
}

double distance_m(const RouteLine& a, const RouteLine& b) {
  constexpr double kEach_m = 10.0;
  double largest = 0.0;
  for (std::size_t k = 1; k < a.size(); ++k) {
    const int n = std::max(1, static_cast<int>((a[k] - a[k - 1]).norm() / kEach_m));
    for (int s = 0; s <= n; ++s) {
      const Vec2 p = a[k - 1] + static_cast<double>(s) / n * (a[k] - a[k - 1]);
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t m = 1; m < b.size(); ++m) {
        const Vec2 d = b[m] - b[m - 1];
        const double t =
            std::clamp((p - b[m - 1]).dot(d) / std::max(1e-9, d.squaredNorm()), 0.0, 1.0);
        nearest = std::min(nearest, (p - b[m - 1] - t * d).norm());
      }
      largest = std::max(largest, nearest);
    }
  }
  return largest;
}

}  // namespace rcs::mission
