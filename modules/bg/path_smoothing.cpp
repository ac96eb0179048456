#include "modules/bg/path_smoothing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace rcs::bg {
namespace {

constexpr std::size_t kMaxPoints = 160;  // points of a leg; the search ends after some 80
constexpr std::size_t kMinPoints = 8;
constexpr std::size_t kBegin = 3;  // fixed: position, heading and curvature of the vehicle
constexpr std::size_t kEnd = 2;    // fixed: position and heading
constexpr double kFixed = 1e6;     // weight of their displacement
// Weights of the third difference of the positions, which is the change of the curvature times the
// cube of the distance of the points. With the last one, what is shorter than some 9 m is smoothed;
// a factor of 64 doubles that. The first one that leaves enough clearance is used.
constexpr std::array<double, 4> kRigidities = {1536e3, 192e3, 24e3, 3e3};
constexpr int kRounds = 4;
constexpr double kHold = 30.0;      // factor on the weight of a point that must not be moved
constexpr std::size_t kAround = 3;  // points on both sides that are held with it
constexpr double kNearer_m = 0.02;  // rounding
constexpr double kSharper = 1.02;
constexpr double kInGoal = 0.8;  // of its radius; the vehicle deviates from the path
constexpr std::array<double, 4> kThird = {1.0, -3.0, 3.0, -1.0};

/// A symmetric matrix of seven diagonals: entry (k, k - j) is lower[k][j]. Then its LDL factors.
using Band = std::array<std::array<double, 4>, kMaxPoints>;
using Values = std::array<double, kMaxPoints>;

void factorize(std::size_t n, Band* band) {
  Band& a = *band;
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = std::min<std::size_t>(3, k) + 1; j-- > 0;) {
      // Entry (k, m): less the products with the rows before, which both have.
      const std::size_t m = k - j;
      double sum = a[k][j];
      for (std::size_t p = k - std::min<std::size_t>(3, k); p < m; ++p) {
        if (m - p <= 3) sum -= a[k][k - p] * a[m][m - p] * a[p][0];
      }
      a[k][j] = j == 0 ? sum : sum / a[m][0];
    }
  }
}

void solve(std::size_t n, const Band& a, Values* values) {
  Values& x = *values;
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t j = 1; j <= std::min<std::size_t>(3, k); ++j) x[k] -= a[k][j] * x[k - j];
  }
  for (std::size_t k = 0; k < n; ++k) x[k] /= a[k][0];
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = 1; j <= 3 && k + j < n; ++j) x[k] -= a[k + j][j] * x[k + j];
  }
}

/// Minimum of sum weight |p - from|^2 + rigidity |third difference|^2, in each coordinate.
void displace(std::size_t n, double rigidity, const Values& weight, Values* x_m, Values* y_m) {
  Band a{};
  for (std::size_t k = 0; k < n; ++k) {
    a[k][0] = weight[k];
    (*x_m)[k] *= weight[k];
    (*y_m)[k] *= weight[k];
  }
  for (std::size_t k = 0; k + 3 < n; ++k) {
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j <= i; ++j) a[k + i][i - j] += rigidity * kThird[i] * kThird[j];
    }
  }
  factorize(n, &a);
  solve(n, a, x_m);
  solve(n, a, y_m);
}

double difference(double to_rad, double from_rad) {
  return std::remainder(to_rad - from_rad, 2.0 * kPi);
}

class Leg {
 public:
  /// @param points  n of them, driven ahead
  Leg(PathPoint* points, std::size_t n, double rigidity)
      : points_(points), n_(n), rigidity_(rigidity) {
    weight_.fill(1.0);
    for (std::size_t k = 0; k < kBegin; ++k) weight_[k] = kFixed;
    for (std::size_t k = n - kEnd; k < n; ++k) weight_[k] = kFixed;
  }

  void compute() {
    Values x_m{};
    Values y_m{};
    for (std::size_t k = 0; k < n_; ++k) {
      x_m[k] = points_[k].place.x_m;
      y_m[k] = points_[k].place.y_m;
    }
    displace(n_, rigidity_, weight_, &x_m, &y_m);
    for (std::size_t k = 0; k < n_; ++k) {
      Pose2d& p = smooth_[k];
      p = points_[k].place;
      if (k == 0 || k + 1 == n_) continue;
      p.x_m = x_m[k];
      p.y_m = y_m[k];
      p.heading_rad = std::atan2(y_m[k + 1] - y_m[k - 1], x_m[k + 1] - x_m[k - 1]);
    }
    for (std::size_t k = 1; k + 1 < n_; ++k) {
      const Pose2d& before = smooth_[k - 1];
      const Pose2d& after = smooth_[k + 1];
      const double way_m = distance(before, smooth_[k]) + distance(smooth_[k], after);
      smooth_[k].curvature_1pm = difference(after.heading_rad, before.heading_rad) / way_m;
    }
  }

  /// Holds the points that must not be where they are now.
  /// @return there are none
  bool check(const Body& body, const ObstacleDistance& obstacles, const Shape& shape,
             double clearance_m) {
    bool good = true;
    for (std::size_t k = kBegin; k + kEnd < n_; ++k) {
      clearance_m_[k] = body.clearance(obstacles, smooth_[k]);
      const double required_m = std::min(clearance_m, points_[k].clearance_m - kNearer_m);
      const bool sharp = std::abs(smooth_[k].curvature_1pm) > kSharper * shape.max_curvature_1pm;
      if (clearance_m_[k] >= required_m && !sharp) continue;
      good = false;
      hold(k);
    }
    return good;
  }

  /// If the leg leads into the goal, its nearest point is held unless it still does.
  bool check(const Goal& goal) {
    const auto from_goal = [&goal](const Pose2d& p) {
      return std::hypot(p.x_m - goal.x_m, p.y_m - goal.y_m);
    };
    std::size_t nearest = 0;
    double min_m = kInGoal * goal.radius_m;
    for (std::size_t k = 0; k < n_; ++k) {
      if (from_goal(smooth_[k]) <= kInGoal * goal.radius_m) return true;
      if (from_goal(points_[k].place) >= min_m) continue;
      nearest = k;
      min_m = from_goal(points_[k].place);
    }
    if (nearest < kBegin) return true;
    hold(nearest);
    return false;
  }

  void apply() {
    for (std::size_t k = kBegin; k + kEnd < n_; ++k) {
      points_[k].place = smooth_[k];
      points_[k].clearance_m = clearance_m_[k];
    }
  }

 private:
  static double distance(const Pose2d& a, const Pose2d& b) {
    return std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
  }
  void hold(std::size_t k) {
    for (std::size_t i = k - kAround; i <= std::min(n_ - 1, k + kAround); ++i) {
      weight_[i] = std::min(kFixed, weight_[i] * kHold);
    }
  }

  PathPoint* points_;
  std::size_t n_;
  double rigidity_;
  Values weight_{};
  Values clearance_m_{};
  std::array<Pose2d, kMaxPoints> smooth_{};
};

bool smooth_leg(const Body& body, const ObstacleDistance& obstacles, const Shape& shape,
                double clearance_m, const std::optional<Goal>& through, double rigidity,
                std::size_t n, PathPoint* points) {
  Leg leg(points, n, rigidity);
  for (int round = 0; round < kRounds; ++round) {
    leg.compute();
    const bool free = leg.check(body, obstacles, shape, clearance_m);
    if (!free || (through && !leg.check(*through))) continue;
    leg.apply();
    return true;
  }
  return false;
}

double min_clearance(const PathPoint* points, std::size_t n) {
  double min_m = points[0].clearance_m;
  for (std::size_t k = 1; k < n; ++k) min_m = std::min(min_m, points[k].clearance_m);
  return min_m;
}

}  // namespace

void smooth(const Body& body, const ObstacleDistance& obstacles, const Shape& shape,
            const vj::Weights& weights, const std::optional<Goal>& through, Path* path) {
  std::size_t begin = 0;
  while (begin + 1 < path->size()) {
    const int direction = (*path)[begin + 1].direction;
    std::size_t end = begin + 1;
    while (end < path->size() && (*path)[end].direction == direction) ++end;
    const std::size_t n = end - begin;
    if (direction > 0 && n >= kMinPoints && n <= kMaxPoints) {
      PathPoint* const leg = path->data() + begin;
      const double min_m = min_clearance(leg, n);
      for (const double rigidity : kRigidities) {
        // Between obstacles a gentle curve is longer, and may miss the only gap.
        const bool last = rigidity == kRigidities.back();
        if (!last && min_m < weights.near_m) continue;
        const double clearance_m = last ? weights.margin_m : weights.near_m;
        if (smooth_leg(body, obstacles, shape, clearance_m, through, rigidity, n, leg)) break;
      }
    }
    begin = end - 1;
  }
  for (std::size_t k = 1; k < path->size(); ++k) {
    const Pose2d& a = (*path)[k - 1].place;
    const Pose2d& b = (*path)[k].place;
    (*path)[k].s_m = (*path)[k - 1].s_m + std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
  }
}

}  // namespace rcs::bg
