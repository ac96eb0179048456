#include "modules/wm/terrain_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace rcs::wm {
namespace {

constexpr float kNone = -std::numeric_limits<float>::infinity();
constexpr std::size_t kMostSeen = 50'000;  // quarters that one message touches
constexpr double kStart_m = 8.0;           // from its start the vehicle is there
constexpr int kSeenEnough = 3;             // scans
constexpr int kFewest = 6;                 // known cells that make a plane
constexpr int kSupported = 9;  // known cells that speak for one of which nothing was seen

// z = a + b x + c y, x and y in cells from the middle of one.
struct Plane {
  double a = 0.0, b = 0.0, c = 0.0;
  double rms = 0.0;       // of the heights that it goes through
  double leverage = 0.0;  // how much of a is what was seen in the middle, [0, 1]

  [[nodiscard]] double at(double x, double y) const { return a + b * x + c * y; }
};

// Least squares over the known cells of a neighbourhood.
class PlaneFit {
 public:
  void add(int x, int y, double z) {
    ++n_;
    sx_ += x;
    sy_ += y;
    sxx_ += x * x;
    sxy_ += x * y;
    syy_ += y * y;
    sz_ += z;
    sxz_ += x * z;
    syz_ += y * z;
    szz_ += z * z;
  }
  [[nodiscard]] int n() const { return n_; }
  /// Nothing: the known cells lie on a line, or are too few.
  [[nodiscard]] std::optional<Plane> solve() const {
    if (n_ < kFewest) return std::nullopt;
    const double n = n_;
    const double cxx = sxx_ - sx_ * sx_ / n;
    const double cxy = sxy_ - sx_ * sy_ / n;
    const double cyy = syy_ - sy_ * sy_ / n;
    const double cxz = sxz_ - sx_ * sz_ / n;
    const double cyz = syz_ - sy_ * sz_ / n;
    const double det = cxx * cyy - cxy * cxy;
    if (det < 0.5 * n) return std::nullopt;
    Plane plane;
    plane.b = (cyy * cxz - cxy * cyz) / det;
    plane.c = (cxx * cyz - cxy * cxz) / det;
    plane.a = (sz_ - plane.b * sx_ - plane.c * sy_) / n;
    const double czz = szz_ - sz_ * sz_ / n;
    plane.rms = std::sqrt(std::max(0.0, czz - plane.b * cxz - plane.c * cyz) / n);
    const double mx = sx_ / n;
    const double my = sy_ / n;
    plane.leverage = 1.0 / n + (cyy * mx * mx - 2.0 * cxy * mx * my + cxx * my * my) / det;
    return plane;
  }

 private:
  int n_ = 0;
  double sx_ = 0.0, sy_ = 0.0, sxx_ = 0.0, sxy_ = 0.0, syy_ = 0.0;
  double sz_ = 0.0, sxz_ = 0.0, syz_ = 0.0, szz_ = 0.0;
};

}  // namespace

TerrainGrid::TerrainGrid(const TerrainParams& params)
    : params_(params),
      cells_(2 * params.size, 0.5 * params.cell_m),
      index_(2 * params.size, 0.5 * params.cell_m) {
  RCS_CHECK(params.patch > 0 && 2 * params.patch <= params.size);
  seen_.reserve(kMostSeen);
  const std::size_t side = static_cast<std::size_t>(params.patch + 2 * kReach);
  lows_.reserve(side * side);
}

void TerrainGrid::clear() {
  cells_.clear();
  scans_ = 0;
}

void TerrainGrid::insert(const Points& p_vehicle, const Pose& T_local_vehicle) {
  const Cell centre = cells_.cell_at(T_local_vehicle.p.x(), T_local_vehicle.p.y());
  cells_.centre_on(centre);
  index_.centre_on(centre);
  const Mat3f R = T_local_vehicle.rotation().cast<float>();
  const float max_range2 = static_cast<float>(params_.max_range_m * params_.max_range_m);
  seen_.clear();
  const Vec2 here = T_local_vehicle.p.head<2>();
  if (scans_ == 0) start_ = here;
  const bool at_start = (here - start_).norm() < kStart_m;
  const auto near_m = static_cast<float>(at_start ? params_.near_start_m : params_.near_m);
  for (std::size_t k = 0; k < p_vehicle.size(); ++k) {
    const Vec3f p = p_vehicle[k];
    if (p.squaredNorm() > max_range2) continue;
    const Vec3f turned = R * p;
    const Cell cell =
        cells_.cell_at(turned.x() + T_local_vehicle.p.x(), turned.y() + T_local_vehicle.p.y());
    if (!cells_.contains(cell)) continue;
    const float z = static_cast<float>(turned.z() + T_local_vehicle.p.z());
    // What hangs over known ground is neither ground nor in the way.
    const TerrainCell& known = cells_.at(cell);
    if (known.scans > 0 && z > known.low_m + static_cast<float>(params_.overhang_m)) continue;
    int& index = index_.at(cell);
    if (index == 0) {
      if (seen_.size() == kMostSeen) continue;
      const float away = turned.head<2>().norm();
      seen_.push_back({cell, z, z, kNone, away > near_m});
      index = static_cast<int>(seen_.size());
      continue;
    }
    Seen& seen = seen_[static_cast<std::size_t>(index - 1)];
    seen.low_m = std::min(seen.low_m, z);
    seen.second_m = std::max(seen.second_m, std::min(seen.high_m, z));
    seen.high_m = std::max(seen.high_m, z);
  }
  for (const Seen& seen : seen_) {
    index_.at(seen.cell) = 0;
    update(seen);
  }
  ++scans_;
}

// Where no ground was seen yet, the ground around tells what hangs over it.
bool TerrainGrid::overhangs(const Seen& seen) const {
  constexpr int kAround = 3;  // quarters
  for (int y = -kAround; y <= kAround; ++y) {
    for (int x = -kAround; x <= kAround; ++x) {
      const TerrainCell* const q = cells_.find({seen.cell.i + x, seen.cell.j + y});
      if (q != nullptr && q->scans > 0 &&
          seen.low_m > q->low_m + static_cast<float>(params_.overhang_m)) {
        return true;
      }
    }
  }
  return false;
}

void TerrainGrid::update(const Seen& seen) {
  constexpr float kSink = 0.5F;  // of the ground towards a lower point, so that one outlier is none
  constexpr float kRise = 0.03F;  // and towards a higher one: it may have been too low
  constexpr float kUp = 0.6F;     // of the top towards a higher one that was seen
  constexpr float kDown = 0.1F;   // and towards a lower one
  constexpr float kDoubt = 0.6F;  // evidence that a scan takes that saw ground alone
  constexpr float kAlone = 0.3F;  // evidence of a single tall point
  constexpr float kMost = 8.0F;
  TerrainCell& cell = cells_.at(seen.cell);
  cell.ground_seen = cell.ground_seen || seen.ground;
  if (cell.scans == 0) {
    if (overhangs(seen)) return;
    cell.low_m = seen.low_m;
    cell.high_m = seen.high_m;
  } else {
    cell.low_m += (seen.low_m < cell.low_m ? kSink : kRise) * (seen.low_m - cell.low_m);
    // Blades of grass come and go; a rock's top is seen again and again.
    cell.high_m += (seen.high_m > cell.high_m ? kUp : kDown) * (seen.high_m - cell.high_m);
    // An overhang that was taken before the ground below it was known.
    if (cell.high_m > cell.low_m + static_cast<float>(params_.overhang_m)) {
      cell.high_m = seen.low_m;
    }
  }
  const float tall_m = cell.low_m + static_cast<float>(params_.obstacle_m);
  if (seen.second_m > tall_m) {
    cell.evidence = std::min(kMost, cell.evidence + 1.0F);
  } else if (seen.high_m > tall_m) {
    // Alone it may be a mixed pixel: light from an edge and from what lies behind it.
    cell.evidence = std::min(kMost, cell.evidence + kAlone);
  } else {
    cell.evidence = std::max(0.0F, cell.evidence - kDoubt);
  }
  if (cell.scans < std::numeric_limits<std::uint16_t>::max()) ++cell.scans;
}

Cell TerrainGrid::patch(const Pose& T_local_vehicle, std::vector<TerrainAnswer>* out) {
  const Vec3 ahead = T_local_vehicle.q * Vec3::UnitX();
  const double level = std::max(1e-6, ahead.head<2>().norm());
  const Vec2 middle = T_local_vehicle.p.head<2>() + params_.ahead_m / level * ahead.head<2>();
  const int side = params_.patch;
  const Cell first{static_cast<int>(std::floor(middle.x() / params_.cell_m)) - side / 2,
                   static_cast<int>(std::floor(middle.y() / params_.cell_m)) - side / 2};
  lows_.clear();
  for (int j = -kReach; j < side + kReach; ++j) {
    for (int i = -kReach; i < side + kReach; ++i) {
      Low low{false, false, false, 0.0F};
      for (int quarter = 0; quarter < 4; ++quarter) {
        const TerrainCell* const q =
            cells_.find({2 * (first.i + i) + (quarter & 1), 2 * (first.j + j) + (quarter >> 1)});
        if (q == nullptr || q->scans == 0) continue;
        low.m = low.known ? std::min(low.m, q->low_m) : q->low_m;
        low.known = true;
        low.ground = low.ground || q->ground_seen;
        low.sure = low.sure || q->scans >= kSeenEnough;
      }
      lows_.push_back(low);
    }
  }
  out->clear();
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) out->push_back(answer(i, j, {first.i + i, first.j + j}));
  }
  return first;
}

// Of the cell (i, j) of the patch.
TerrainAnswer TerrainGrid::answer(int i, int j, Cell cell) const {
  const auto low = [&](int x, int y) -> const Low& {
    const int at = (j + y + kReach) * (params_.patch + 2 * kReach) + i + x + kReach;
    return lows_[static_cast<std::size_t>(at)];
  };
  PlaneFit fit;
  for (int y = -kReach; y <= kReach; ++y) {
    for (int x = -kReach; x <= kReach; ++x) {
      if (low(x, y).ground) fit.add(x, y, low(x, y).m);
    }
  }
  const Low& self = low(0, 0);
  const std::optional<Plane> ground = fit.solve();
  TerrainAnswer out;
  if (!self.known && (!ground || fit.n() < kSupported)) return out;
  // What stands in a cell whose ground was never seen is held against its own lowest point.
  const bool near_only = self.known && !self.ground;
  const Plane plane = ground && !near_only ? *ground : Plane{self.m};
  out.known = true;
  out.height_m = static_cast<float>(plane.a);
  out.slope_rad = static_cast<float>(std::atan(std::hypot(plane.b, plane.c) / params_.cell_m));
  out.roughness_m = static_cast<float>(plane.rms);
  if (!self.known) return out;

  // A ledge: higher or lower than a neighbour by more than the plane says. Grass whose ground was
  // not seen yet makes none.
  double ledge = 0.0;
  for (const Cell side : {Cell{1, 0}, Cell{-1, 0}, Cell{0, 1}, Cell{0, -1}}) {
    const Low& other = low(side.i, side.j);
    if (!self.ground || !other.ground || !other.sure) continue;
    const double planned = plane.b * side.i + plane.c * side.j;
    ledge = std::max(ledge, std::abs(other.m - self.m - planned));
  }
  // A rock with nothing known behind it tilts the plane towards itself: it is held against the
  // plane through the others.
  Plane others = plane;
  const double h = std::min(0.9, plane.leverage);
  others.a = out.height_m - h / (1.0 - h) * std::max(0.0F, self.m - out.height_m);
  // Grass that is met from above at every scan again is no bush yet.
  const double tall_m = near_only ? 2.0 * params_.obstacle_m : params_.obstacle_m;
  double stands_m = 0.0;  // above the plane, an object by half
  bool seen_enough = false;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int x = quarter & 1;
    const int y = quarter >> 1;
    const TerrainCell* const q = cells_.find({2 * cell.i + x, 2 * cell.j + y});
    if (q == nullptr || q->scans < kSeenEnough) continue;
    seen_enough = true;
    const double below_m = others.at(0.5 * x - 0.25, 0.5 * y - 0.25);
    const double low_m = q->low_m - below_m;
    const double high_m = q->high_m - below_m;
    if (q->ground_seen) stands_m = std::max({stands_m, low_m, 0.5 * high_m});
    out.obstacle |= q->ground_seen && low_m > params_.solid_m;
    out.obstacle |= q->evidence > params_.evidence && high_m > tall_m;
  }
  out.obstacle |= seen_enough && ledge > params_.obstacle_m;
  out.step_m = static_cast<float>(std::max(ledge, stands_m));
  return out;
}

}  // namespace rcs::wm
