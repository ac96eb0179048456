#include "modules/wm/terrain/terrain_grid.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "modules/wm/terrain/ledge.h"
#include "modules/wm/terrain/plane_fits.h"

namespace rcs::wm {
namespace {

constexpr float kNone = -std::numeric_limits<float>::infinity();
constexpr std::size_t kMaxSeen = 50'000;  // quarters that one message touches, at most
constexpr std::size_t kMaxTall = 20'000;
constexpr double kStart_m = 8.0;           // from its start: the vehicle counts as near it
constexpr int kSeenEnough = 3;             // scans
constexpr std::uint8_t kHiddenEnough = 4;  // observations
constexpr std::uint8_t kRaysToGround = 60;
constexpr double kPassable_m = 0.25;   // above the ground: a rock that the vehicle can drive over
constexpr int kSupported = 9;          // known neighbours from which an unseen cell gets a height
constexpr double kInterpolated = 0.5;  // leverage; larger: the neighbours are all on one side

}  // namespace

TerrainGrid::TerrainGrid(const TerrainParams& params)
    : params_(params),
      cells_(2 * params.size, 0.5 * params.cell_m),
      index_(2 * params.size, 0.5 * params.cell_m) {
  RCS_CHECK(params.patch > 0 && 2 * params.patch <= params.size);
  seen_.reserve(kMaxSeen);
  offsets_.reserve(kMaxSeen);
  if (params.upright_m > 0.0) {
    tall_.reserve(kMaxTall);
    upright_now_.reserve(kMaxTall);
    rays_.reserve(kMaxSeen);
  }
  // Whole lanes: the cells beyond the last of the patch are unknown and not published.
  stride_ = (params.patch + kLanes - 1) / kLanes * kLanes + 2 * kReach;
  const auto stride = static_cast<std::size_t>(stride_);
  lows_.resize(stride * static_cast<std::size_t>(params.patch + 2 * kReach));
  for (std::vector<double>* plane : {&n_, &z_, &zz_}) plane->resize(lows_.size());
  columns_.resize(kColumns * stride);
}

void TerrainGrid::clear() {
  cells_.clear();
  tall_.clear();
  scans_ = 0;
}

void TerrainGrid::save_row(std::size_t k, std::byte* out) const {
  const Cell origin = cells_.origin();
  const int mask = cells_.size() - 1;
  const RowHead head{origin.i, origin.j + ((static_cast<int>(k) - origin.j) & mask)};
  std::memcpy(out, &head, sizeof head);
  std::byte* to = out + sizeof head;
  for (int i = head.i; i <= head.i + mask; ++i, to += sizeof(TerrainCell)) {
    std::memcpy(to, &cells_.at({i, head.j}), sizeof(TerrainCell));
  }
}

void TerrainGrid::begin_restore(const Vec2& centre_local, const Vec2& start_local) {
  clear();
  const Cell centre = cells_.cell_at(centre_local.x(), centre_local.y());
  cells_.centre_on({centre.i & ~1, centre.j & ~1});
  start_ = start_local;
}

void TerrainGrid::restore_row(const std::byte* row) {
  RowHead head;
  std::memcpy(&head, row, sizeof head);
  const std::byte* from = row + sizeof head;
  for (int i = head.i; i < head.i + cells_.size(); ++i, from += sizeof(TerrainCell)) {
    TerrainCell cell;
    std::memcpy(&cell, from, sizeof cell);
    if (cell.scans > 0 || cell.hidden > 0) restore({i, head.j}, cell);
  }
}

void TerrainGrid::restore(Cell at, const TerrainCell& cell) {
  TerrainCell* const to = cells_.find(at);
  if (to == nullptr) return;
  *to = cell;
  if (cell.listed != 0 && tall_.size() < kMaxTall) tall_.push_back(at);
  scans_ = 1;  // not empty
}

TerrainAgreement TerrainGrid::agreement(const Points& p_vehicle,
                                        const Pose& T_local_vehicle) const {
  constexpr double kEqual_m = 0.2;
  TerrainAgreement a;
  for (std::size_t k = 0; k < p_vehicle.size(); ++k) {
    const Vec3 p = Vec3f(p_vehicle[k]).cast<double>();
    if (p.norm() > params_.accurate_m) continue;
    const Vec3 at = T_local_vehicle * p;
    ++a.points;
    const TerrainCell* const cell = cells_.find(cells_.cell_at(at.x(), at.y()));
    if (cell == nullptr || cell->scans == 0) continue;
    const auto low_m = static_cast<double>(cell->low_m);
    const auto high_m = std::max(low_m, static_cast<double>(cell->high_m));
    if (at.z() > low_m - kEqual_m && at.z() < high_m + kEqual_m) ++a.agree;
  }
  return a;
}

void TerrainGrid::keep_ahead(const Pose& T_old_new, const Pose& T_new_vehicle) {
  struct Kept {
    Cell cell;
    TerrainCell content;
  };
  std::vector<Kept> kept;
  const Vec2 here = T_new_vehicle.p.head<2>();
  const Vec2 ahead = (T_new_vehicle.q * Vec3::UnitX()).head<2>();
  const double range_m = params_.accurate_m;
  const double edge_m = 0.5 * params_.cell_m;
  const auto lift_m = static_cast<float>(-T_old_new.p.z());
  const Cell first = cells_.cell_at(here.x() - range_m, here.y() - range_m);
  const Cell last = cells_.cell_at(here.x() + range_m, here.y() + range_m);
  for (int j = first.j; j <= last.j; ++j) {
    for (int i = first.i; i <= last.i; ++i) {
      const Vec2 centre = edge_m * Vec2(i + 0.5, j + 0.5);
      const Vec2 away = centre - here;
      if (away.norm() > range_m || away.dot(ahead) < 0.0) continue;
      const Vec3 old = T_old_new * Vec3(centre.x(), centre.y(), 0.0);
      const TerrainCell* const cell = cells_.find(cells_.cell_at(old.x(), old.y()));
      if (cell == nullptr || (cell->scans == 0 && cell->hidden == 0)) continue;
      Kept k{{i, j}, *cell};
      for (float* z : {&k.content.low_m, &k.content.accurate_low_m, &k.content.high_m,
                       &k.content.pass_low_m}) {
        *z += lift_m;
      }
      kept.push_back(k);
    }
  }
  begin_restore(here, here);
  for (const Kept& k : kept) restore(k.cell, k.content);
}

void TerrainGrid::insert(const Points& p_vehicle, const Pose& T_local_vehicle) {
  Cell centre = cells_.cell_at(T_local_vehicle.p.x(), T_local_vehicle.p.y());
  centre = {centre.i & ~1, centre.j & ~1};  // the quarters of a cell enter and leave together
  cells_.centre_on(centre);
  index_.centre_on(centre);
  const Mat3f R = T_local_vehicle.rotation().cast<float>();
  const float max_range2 = static_cast<float>(params_.max_range_m * params_.max_range_m);
  seen_.clear();
  rays_.clear();
  upright_now_.clear();
  const Vec2 here = T_local_vehicle.p.head<2>();
  if (scans_ == 0) start_ = here;
  const bool at_start = (here - start_).norm() < kStart_m;
  const Vec3 ladar = T_local_vehicle * params_.p_vehicle_ladar;
  ladar_ = ladar;
  const auto near_m = static_cast<float>(at_start ? params_.near_start_m : params_.near_m);
  const auto accurate_m = static_cast<float>(params_.accurate_m);
  for (std::size_t k = 0; k < p_vehicle.size(); ++k) {
    const Vec3f p = p_vehicle[k];
    const bool far = p.squaredNorm() > max_range2;
    if (far && params_.upright_m <= 0.0) continue;
    const Vec3f turned = R * p;
    if (params_.upright_m > 0.0) rays_.add(ladar, turned.cast<double>() + T_local_vehicle.p);
    if (far) continue;
    const Cell cell =
        cells_.cell_at(turned.x() + T_local_vehicle.p.x(), turned.y() + T_local_vehicle.p.y());
    if (!cells_.contains(cell)) continue;
    const float z = static_cast<float>(turned.z() + T_local_vehicle.p.z());
    if (params_.vegetation_m > 0.0) {
      look_through(turned.cast<double>() + T_local_vehicle.p, ladar);
    }
    // Points that overhang known ground are neither ground nor obstacles.
    const TerrainCell& known = cells_.at(cell);
    if (known.scans > 0 && z > known.low_m + static_cast<float>(params_.overhang_m)) continue;
    int& index = index_.at(cell);
    if (index == 0) {
      if (seen_.size() == kMaxSeen) continue;
      const float away = turned.head<2>().norm();
      const bool ground = away > near_m;
      seen_.push_back({cell, z, z, kNone, ground, ground && away < accurate_m, 1});
      index = static_cast<int>(seen_.size());
      continue;
    }
    Seen& seen = seen_[static_cast<std::size_t>(index - 1)];
    seen.low_m = std::min(seen.low_m, z);
    seen.second_m = std::max(seen.second_m, std::min(seen.high_m, z));
    seen.high_m = std::max(seen.high_m, z);
    ++seen.points;
  }
  if (const float up_m = offset(); up_m != 0.0F) shift(up_m);
  for (const Seen& seen : seen_) {
    index_.at(seen.cell) = 0;
    update(seen);
  }
  if (params_.edge_range_m > 0.0) {
    for (const Seen& seen : seen_) look_before(seen, ladar.head<2>());
  }
  if (params_.upright_m > 0.0) {
    for (const Seen& seen : seen_) note_upright(seen);
    clear_passed(ladar);
  }
  ++scans_;
}

// In front of a wall the scans do not determine the height of the vehicle: the vehicle in frame
// local rises or sinks, and the ground that it then sees would be a ledge in what was seen before.
// Only bare ground counts: rays may end in grass above ground that was seen from nearer.
float TerrainGrid::offset() {
  constexpr std::size_t kEnough = 60;
  constexpr unsigned kWell = 3;
  constexpr float kBare_m = 0.15F;
  constexpr float kSame_m = 0.08F;
  constexpr std::size_t kOthers = 5;  // one of them may be off
  offsets_.clear();
  for (const Seen& seen : seen_) {
    const TerrainCell& cell = cells_.at(seen.cell);
    const bool known = seen.accurate && cell.confirmed == kWell && cell.upright == 0;
    if (!known || seen.high_m - seen.low_m > kBare_m || cell.high_m - cell.low_m > kBare_m) {
      continue;
    }
    offsets_.push_back(seen.low_m - cell.low_m);
  }
  if (offsets_.size() < kEnough) return 0.0F;
  // What four fifths of them exceed, in the same direction.
  const auto fifth = static_cast<std::ptrdiff_t>(offsets_.size() / kOthers);
  const auto low = offsets_.begin() + fifth;
  std::nth_element(offsets_.begin(), low, offsets_.end());
  if (*low >= kSame_m) return *low;
  const auto high = offsets_.end() - 1 - fifth;
  std::nth_element(offsets_.begin(), high, offsets_.end());
  return *high <= -kSame_m ? *high : 0.0F;
}

void TerrainGrid::shift(float up_m) {
  const Cell first = cells_.origin();
  for (int j = first.j; j < first.j + cells_.size(); ++j) {
    for (int i = first.i; i < first.i + cells_.size(); ++i) {
      TerrainCell& cell = cells_.at({i, j});
      for (float* z : {&cell.low_m, &cell.accurate_low_m, &cell.high_m, &cell.pass_low_m}) {
        *z += up_m;  // unknown: infinite
      }
    }
  }
}

// Where no ground was seen yet, the ground around decides what overhangs it.
bool TerrainGrid::overhangs(const Seen& seen) const {
  constexpr int kAround = 3;  // quarters
  const Cell first = cells_.origin();
  const int last = cells_.size() - 1;
  const auto overhang_m = static_cast<float>(params_.overhang_m);
  const int right = std::min(seen.cell.i + kAround, first.i + last);
  const int top = std::min(seen.cell.j + kAround, first.j + last);
  bool over = false;  // no early exit: the loop is faster without branches
  for (int j = std::max(seen.cell.j - kAround, first.j); j <= top; ++j) {
    for (int i = std::max(seen.cell.i - kAround, first.i); i <= right; ++i) {
      over |= seen.low_m > cells_.at({i, j}).low_m + overhang_m;
    }
  }
  return over;
}

void TerrainGrid::update_low(const Seen& seen, TerrainCell* cell) const {
  constexpr float kSink =
      0.5F;  // of the ground towards a lower point: limits the effect of an outlier
  constexpr float kRise = 0.03F;  // of the ground towards a higher point, in case it was too low
  constexpr unsigned kEnough = 3;
  constexpr float kSame_m = 0.1F;
  // A higher point beside a face does not contradict what was seen at its foot.
  constexpr float kFace_m = 0.2F;
  const auto follow = [&](float low_m, bool face) {
    if (face && seen.low_m > low_m + kFace_m) return low_m;
    return low_m + (seen.low_m < low_m ? kSink : kRise) * (seen.low_m - low_m);
  };
  if (seen.accurate) {
    float* const low_m = &cell->accurate_low_m;
    *low_m = cell->accurate == 0 ? seen.low_m : follow(*low_m, cell->confirmed == kEnough);
    if (cell->accurate < kEnough) ++cell->accurate;
    if (seen.low_m < *low_m + kSame_m && cell->confirmed < kEnough) ++cell->confirmed;
  }
  if (cell->accurate == kEnough) {
    cell->low_m = cell->accurate_low_m;
  } else {
    cell->low_m = cell->scans == 0 ? seen.low_m : follow(cell->low_m, false);
  }
}

void TerrainGrid::update(const Seen& seen) {
  constexpr float kUp = 0.6F;     // of the top towards a higher point
  constexpr float kDown = 0.1F;   // of the top towards a lower point
  constexpr float kDoubt = 0.6F;  // evidence removed by a scan that saw only ground
  constexpr float kAlone = 0.3F;  // evidence of a single tall point
  constexpr float kMax = 8.0F;
  TerrainCell& cell = cells_.at(seen.cell);
  if (seen.ground) cell.ground_seen = 1;
  if (cell.scans == 0 && overhangs(seen)) return;
  update_low(seen, &cell);
  if (cell.scans == 0) {
    cell.high_m = seen.high_m;
  } else {
    // Blades of grass appear and disappear; the top of a rock is seen repeatedly.
    cell.high_m += (seen.high_m > cell.high_m ? kUp : kDown) * (seen.high_m - cell.high_m);
    // An overhang that was inserted before the ground below it was known.
    if (cell.high_m > cell.low_m + static_cast<float>(params_.overhang_m)) {
      cell.high_m = seen.low_m;
    }
  }
  const float tall_m = cell.low_m + static_cast<float>(params_.obstacle_m);
  if (seen.second_m > tall_m) {
    cell.evidence = std::min(kMax, cell.evidence + 1.0F);
  } else if (seen.high_m > tall_m) {
    // A single point may be a mixed pixel: light from an edge and from the surface behind it.
    cell.evidence = std::min(kMax, cell.evidence + kAlone);
  } else {
    cell.evidence = std::max(0.0F, cell.evidence - kDoubt);
  }
  if (cell.scans < std::numeric_limits<std::uint16_t>::max()) ++cell.scans;
}

Cell TerrainGrid::begin_patch(const Pose& T_local_vehicle) {
  const Vec3 ahead = T_local_vehicle.q * Vec3::UnitX();
  const double level = std::max(1e-6, ahead.head<2>().norm());
  const Vec2 middle = T_local_vehicle.p.head<2>() + params_.ahead_m / level * ahead.head<2>();
  first_ = {static_cast<int>(std::floor(middle.x() / params_.cell_m)) - params_.patch / 2,
            static_cast<int>(std::floor(middle.y() / params_.cell_m)) - params_.patch / 2};
  collect_lows({first_.i - kReach, first_.j - kReach});
  return first_;
}

void TerrainGrid::answer_rows(int begin, int end, std::vector<TerrainAnswer>* out) {
  const int side = params_.patch;
  out->resize(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (int j = begin; j < end; ++j) {
    TerrainAnswer* const answers = out->data() + static_cast<std::ptrdiff_t>(j) * side;
    std::fill(answers, answers + side, TerrainAnswer{});
    const std::ptrdiff_t row = (j + kReach) * stride_;
    add_columns(row);
    for (int first = 0; first < side; first += kLanes) {
      const PlaneFits fits = fit_planes(columns_.data() + kReach + first, stride_, params_.cell_m);
      for (int k = 0; k < std::min(kLanes, side - first); ++k) {
        const int i = first + k;
        const Low* const low = lows_.data() + row + kReach + i;
        const bool found = fits.found[k] > 0.0;
        const bool supported = found && fits.n[k] >= kSupported && fits.leverage[k] < kInterpolated;
        if (!low->known && !low->hidden && !supported) continue;
        const double height_m = low->known ? low->m : std::numeric_limits<double>::quiet_NaN();
        const GroundPlane ground = found ? fits.plane(k) : GroundPlane{height_m};
        answers[i] = answer(low, {first_.i + i, first_.j + j}, ground);
      }
    }
  }
}

Cell TerrainGrid::patch(const Pose& T_local_vehicle, std::vector<TerrainAnswer>* out) {
  const Cell first = begin_patch(T_local_vehicle);
  answer_rows(0, params_.patch, out);
  return first;
}

// The lowest heights, and the sums for the planes.
// @param first  lowest cell of the patch with its margin
void TerrainGrid::collect_lows(Cell first) {
  const int side = params_.patch + 2 * kReach;
  const int window = cells_.size() / 2;
  const Cell begin{cells_.origin().i / 2 - first.i, cells_.origin().j / 2 - first.j};
  const int left = std::clamp(begin.i, 0, side);
  const int right = std::clamp(begin.i + window, 0, side);
  std::fill(lows_.begin(), lows_.end(), Low{});
  for (int j = std::max(0, begin.j); j < std::min(side, begin.j + window); ++j) {
    Low* const row = lows_.data() + j * stride_;
    for (int i = left; i < right; ++i) {
      // Without branches, as known cells are scattered; the ring buffer never separates quarters of
      // a cell.
      const TerrainCell* const lower = &cells_.at({2 * (first.i + i), 2 * (first.j + j)});
      const TerrainCell* const upper = &cells_.at({2 * (first.i + i), 2 * (first.j + j) + 1});
      Low low;
      for (const TerrainCell* q : {lower, lower + 1, upper, upper + 1}) {
        low.m = std::min(low.m, q->low_m);
        low.ground |= q->ground_seen & (q->scans > 0);
        low.sure |= q->scans >= kSeenEnough;
        low.hidden |= (q->accurate == 0) & (q->hidden >= kHiddenEnough);
      }
      low.known = low.m < kUnknown_m;
      row[i] = low;
    }
  }
  for (std::size_t k = 0; k < lows_.size(); ++k) {
    const double z = lows_[k].ground ? lows_[k].m : 0.0F;
    n_[k] = lows_[k].ground ? 1.0 : 0.0;
    z_[k] = z;
    zz_[k] = z * z;
  }
}

// @param row  start of the row in n_, z_ and zz_
void TerrainGrid::add_columns(std::ptrdiff_t row) {
  const auto store = [&](const Lanes& lanes, int column, std::ptrdiff_t at) {
    Eigen::Map<Lanes>(columns_.data() + column * stride_ + at) = lanes;
  };
  for (std::ptrdiff_t at = 0; at < stride_; at += kLanes) {
    const Moments n = moments(n_.data() + row + at, stride_);
    const Moments z = moments(z_.data() + row + at, stride_);
    const Moments zz = moments(zz_.data() + row + at, stride_);
    store(n.zeroth, kN, at);
    store(n.first, kY, at);
    store(n.second, kYy, at);
    store(z.zeroth, kZ, at);
    store(z.first, kYz, at);
    store(zz.zeroth, kZz, at);
  }
}

// @param low  of the cell, with those of its neighbours around it
// @param ground  level at the lowest point of the cell if too little is known around it
TerrainAnswer TerrainGrid::answer(const Low* low, Cell cell, const GroundPlane& ground) const {
  const Low& self = *low;
  TerrainAnswer out;
  // A cell whose ground was never seen is compared with its own lowest point.
  const bool near_only = self.known && !self.ground;
  const GroundPlane plane = near_only ? GroundPlane{self.m} : ground;
  out.known = true;
  out.height_m = static_cast<float>(plane.a);
  out.slope_rad = static_cast<float>(plane.slope_rad);
  out.roughness_m = static_cast<float>(plane.rms);
  out.hidden = self.hidden;
  const auto mark = [&](bool obstacle, ObstacleCause cause) {
    if (obstacle && !out.obstacle) out.cause = cause;
    out.obstacle |= obstacle;
  };
  mark(self.hidden, ObstacleCause::kHidden);
  if (!self.known) return out;

  // Grass whose ground was not seen yet is no ledge; the ground below vegetation is seen in few
  // places.
  double ledge = 0.0;
  if (self.ground && !soft(cell)) {
    const auto ledge_along = [&](int i, int j, double rise_m) {
      Profile z_m;
      for (int k = -kReach; k <= kReach; ++k) {
        const Low& other = low[k * (j * stride_ + i)];
        const bool seen = k == 0 || (other.ground && other.sure);
        const bool counts = seen && !soft({cell.i + k * i, cell.j + k * j});
        z_m[static_cast<std::size_t>(k + kReach)] = counts ? other.m : std::nanf("");
      }
      return ledge_height(z_m, rise_m);
    };
    ledge = std::max(ledge_along(1, 0, plane.b), ledge_along(0, 1, plane.c));
  }
  // A rock with unknown terrain behind it tilts the plane towards itself: it is compared with the
  // plane through the other cells.
  GroundPlane others = plane;
  const double h = std::min(0.9, plane.leverage);
  others.a = out.height_m - h / (1.0 - h) * std::max(0.0F, self.m - out.height_m);
  // Grass that is seen from above in scan after scan is not a bush yet.
  const double tall_m = near_only ? 2.0 * params_.obstacle_m : params_.obstacle_m;
  double stands_m = 0.0;  // above the plane, an object by half
  bool seen_enough = false;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const int x = quarter & 1;
    const int y = quarter >> 1;
    const TerrainCell& q = cells_.at({2 * cell.i + x, 2 * cell.j + y});
    if (q.scans < kSeenEnough && q.upright == 0) continue;
    seen_enough = true;
    const double below_m = others.at(0.5 * x - 0.25, 0.5 * y - 0.25);
    const double low_m = q.low_m - below_m;
    const double high_m = q.high_m - below_m;
    const bool tall = (q.evidence > params_.evidence || q.upright > 0) && high_m > tall_m;
    // A ray that passed just above the ground shows that no rock is hidden there. From near there
    // are enough rays for one.
    const bool hides = q.near >= kRaysToGround && q.pass_low_m > below_m + kPassable_m;
    if (!hides && gives_way({2 * cell.i + x, 2 * cell.j + y})) {
      out.vegetation |= tall;
      continue;
    }
    if (q.ground_seen) {
      stands_m = std::max({stands_m, low_m, 0.5 * high_m});
      out.low_m = std::max(out.low_m, static_cast<float>(low_m));
    }
    mark(q.ground_seen && low_m > params_.solid_m, ObstacleCause::kRock);
    mark(tall, ObstacleCause::kTall);
  }
  mark(seen_enough && ledge > params_.ledge_m, ObstacleCause::kLedge);
  out.step_m = static_cast<float>(std::max(ledge, stands_m));
  return out;
}

}  // namespace rcs::wm
