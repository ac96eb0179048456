#include "modules/wm/terrain/moving_objects.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace rcs::wm {
namespace {

constexpr std::size_t kMaxObjects = 128;
constexpr int kGap = 2;             // cells between those of one cluster, at most, plus one
constexpr double kLargest_m = 7.0;  // a larger cluster is no person and no vehicle
constexpr double kGate_m = 1.0;     // from the predicted to the observed centre
constexpr double kForget_s = 1.0;   // what stands still is found again
constexpr double kUnseen_s = 6.0;   // what moves, and has left the view, goes on
constexpr int kMissed = 8;
constexpr int kMemory = 8;            // scans that the velocity is the mean of, about
constexpr double kSlowest_mps = 0.3;  // the seen part of what stands still changes, too
constexpr double kFastest_mps = 8.0;
constexpr double kGoneShare = 0.08;  // of its cells

}  // namespace

double MovingObject::distance(const Vec2& place, double from_s, double for_s) const {
  const double speed = v.norm();
  const Vec2 u = speed > 0.0 ? Vec2(v / speed) : Vec2(Vec2::UnitX());
  const Vec2 to = place - (p + (from_s - seen_s) * v);
  const double ahead_m = u.dot(to);
  const double beyond_m = std::max({0.0, -along_m - ahead_m, ahead_m - along_m - for_s * speed});
  const double aside_m = std::max(0.0, std::abs(u.x() * to.y() - u.y() * to.x()) - across_m);
  return std::hypot(beyond_m, aside_m);
}

MovingObjects::MovingObjects(double cell_m, std::size_t max_cells) : cell_m_(cell_m) {
  order_.reserve(max_cells);
  clusters_.reserve(max_cells);
  objects_.reserve(kMaxObjects);
}

// Each cluster grows from its first cell: cells that are near one of its own are swapped behind it.
void MovingObjects::cluster(const std::vector<Cell>& cells) {
  order_.assign(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(
                                                   std::min(cells.size(), order_.capacity())));
  clusters_.clear();
  for (std::size_t begin = 0; begin < order_.size();) {
    std::size_t end = begin + 1;
    for (std::size_t at = begin; at < end; ++at) {
      const Cell own = order_[at];
      for (std::size_t k = end; k < order_.size(); ++k) {
        if (std::abs(order_[k].i - own.i) > kGap || std::abs(order_[k].j - own.j) > kGap) continue;
        std::swap(order_[k], order_[end++]);
      }
    }
    Vec2 low = centre_of(order_[begin]);
    Vec2 high = low;
    Vec2 sum = Vec2::Zero();
    for (std::size_t k = begin; k < end; ++k) {
      const Vec2 p = centre_of(order_[k]);
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
      sum += p;
    }
    if ((high - low).maxCoeff() <= kLargest_m) {
      clusters_.push_back({begin, end, sum / static_cast<double>(end - begin), false});
    }
    begin = end;
  }
}

void MovingObjects::follow(double time_s) {
  for (MovingObject& o : objects_) {
    const Vec2 expected = o.p + (time_s - o.seen_s) * o.v;
    Cluster* nearest = nullptr;
    double nearest_m = kGate_m;
    for (Cluster& c : clusters_) {
      const double away_m = (c.centre - expected).norm();
      if (c.used || away_m > nearest_m) continue;
      nearest = &c;
      nearest_m = away_m;
    }
    if (nearest != nullptr) update(*nearest, time_s, &o);
    if (nearest != nullptr) nearest->used = true;
  }
  objects_.erase(std::remove_if(objects_.begin(), objects_.end(),
                                [&](const MovingObject& o) {
                                  const double unseen_s = time_s - o.seen_s;
                                  return unseen_s > (o.moves ? kUnseen_s : kForget_s) ||
                                         unseen_s < 0.0 || o.missed >= kMissed;
                                }),
                 objects_.end());
  for (const Cluster& c : clusters_) {
    if (c.used || objects_.size() == kMaxObjects) continue;
    MovingObject& o = objects_.emplace_back();
    o.p = c.centre;
    o.seen_s = time_s;
    o.scans = 1;
    remember(c, time_s, &o);
  }
}

// A filter of position and velocity whose gains are those of a least-squares line through its first
// observations, and of a fading memory then (Brookner, Tracking and Kalman Filtering Made Easy,
// 1998, expanding-memory filter).
void MovingObjects::update(const Cluster& cluster, double time_s, MovingObject* object) const {
  MovingObject& o = *object;
  const double dt_s = time_s - o.seen_s;
  if (dt_s <= 0.0) return;
  o.scans = std::min(o.scans + 1, kMemory);
  const double n = o.scans;
  const double g = 2.0 * (2.0 * n - 1.0) / (n * (n + 1.0));
  const double h = 6.0 / (n * (n + 1.0));
  const Vec2 expected = o.p + dt_s * o.v;
  const Vec2 off = cluster.centre - expected;
  o.p = expected + g * off;
  o.v += h / dt_s * off;
  if (o.v.norm() > kFastest_mps) o.v *= kFastest_mps / o.v.norm();
  o.seen_s = time_s;
  const double speed = o.v.norm();
  const Vec2 u = speed > 0.0 ? Vec2(o.v / speed) : Vec2(Vec2::UnitX());
  o.along_m = o.across_m = 0.5 * cell_m_;
  for (std::size_t k = cluster.begin; k < cluster.end; ++k) {
    const Vec2 from = centre_of(order_[k]) - cluster.centre;
    o.along_m = std::max(o.along_m, std::abs(u.dot(from)) + 0.5 * cell_m_);
    o.across_m =
        std::max(o.across_m, std::abs(u.x() * from.y() - u.y() * from.x()) + 0.5 * cell_m_);
  }
  if (time_s - o.before_s >= 2.0 * kAgo_s) remember(cluster, time_s, &o);
}

// Of what stands still, different parts are seen from different places, but rays never pass where
// it was seen.
void MovingObjects::judge(std::size_t gone, double time_s, MovingObject* object) const {
  MovingObject& o = *object;
  const double share =
      static_cast<double>(gone) / static_cast<double>(std::max<std::size_t>(1, o.before_n));
  const bool left = gone >= 1 && share >= kGoneShare;
  // Until the next cells are remembered, it moves while it is fast enough.
  o.moves = o.v.norm() >= kSlowest_mps && (left || (o.moves && time_s - o.before_s < 2.0 * kAgo_s));
}

void MovingObjects::remember(const Cluster& cluster, double time_s, MovingObject* object) const {
  object->before_s = time_s;
  object->before_n = std::min(cluster.end - cluster.begin, MovingObject::kCells);
  // Of a large cluster every second or third, so that all of it is covered.
  for (std::size_t k = 0; k < object->before_n; ++k) {
    object->before[k] =
        order_[cluster.begin + k * (cluster.end - cluster.begin) / object->before_n];
  }
}

}  // namespace rcs::wm
