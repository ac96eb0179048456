#include "modules/sp/prior/scan_ground.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rcs::sp {
namespace {

constexpr double kRadius_m = 48.0;  // ground beyond is sparse, and tilted by the error of the pose
constexpr int kSide = static_cast<int>(2.0 * kRadius_m / kScanGroundCell_m);
constexpr int kEnough = 10;     // cells for a plane
constexpr int kFirstSteps = 2;  // half of the smallest window, in cells
constexpr int kMaxSteps = 8;    // largest half of the window, in cells
constexpr int kRounds = 4;
// Residual of robust weight 1/4: kerbs and cars are not the plane.
constexpr double kOff_m = 0.08;
constexpr double kFirstOff_m = 0.15;  // in the first round, next to the middle
constexpr double kFirstSlope = 0.2;   // and its growth with the distance
constexpr double kNoise_m = 0.02;     // of the height of a cell
// Prior of a slope: across a single line of points the scan determines none.
constexpr double kSlopeSigma = 0.05;

// A cell that is higher than others by more than a step and the steepest ground is an object.
constexpr double kStep_m = 0.15;
constexpr double kSteepest = 0.5;
constexpr int kObjectSteps = 8;  // half of the window, in cells
constexpr int kLower = 2;        // so many lower cells

struct Window {
  int i = 0, j = 0, half = 0;
};

template <class Use>
void for_each_cell(const Window& w, const std::vector<ScanGroundWorkspace::Bin>& bins,
                   const std::vector<ScanGroundCell>& cells, const Use& use) {
  for (int j = std::max(0, w.j - w.half); j <= std::min(kSide - 1, w.j + w.half); ++j) {
    for (int i = std::max(0, w.i - w.half); i <= std::min(kSide - 1, w.i + w.half); ++i) {
      const std::int32_t cell = bins[static_cast<std::size_t>(j * kSide + i)].cell;
      if (cell >= 0) use(cells[static_cast<std::size_t>(cell)].p);
    }
  }
}

/// Slope of a robust plane through the cells of a window. The first
/// weights are those of deviations from a level plane through the middle: a car next to it is
/// higher than a slope of the ground.
Vec2 plane_slope(const Window& w, const ScanGroundCell& middle,
                 const std::vector<ScanGroundWorkspace::Bin>& bins,
                 const std::vector<ScanGroundCell>& cells) {
  Vec3 plane = Vec3::Zero();
  double variance = kNoise_m * kNoise_m;
  for (int round = 0; round < kRounds; ++round) {
    const double prior = variance / (kSlopeSigma * kSlopeSigma);
    Mat3 A = Vec3(1e-9, prior, prior).asDiagonal();
    Vec3 b = Vec3::Zero();
    double square = 0.0, weight = 0.0;
    for_each_cell(w, bins, cells, [&](const Vec3& p) {
      const Vec3 d = p - middle.p;
      const Vec3 t(1.0, d.x(), d.y());
      const double r = d.z() - plane.dot(t);
      const double off_m = round == 0 ? kFirstOff_m + kFirstSlope * d.head<2>().norm() : kOff_m;
      const double k = 1.0 + (r / off_m) * (r / off_m);
      A += t * t.transpose() / (k * k);
      b += t * (d.z() / (k * k));
      square += r * r / (k * k);
      weight += 1.0 / (k * k);
    });
    plane = A.ldlt().solve(b);
    // A plane that misses its middle is that of something else.
    variance = kNoise_m * kNoise_m + square / weight + plane[0] * plane[0];
  }
  return plane.tail<2>();
}

/// Whether a cell is above the ground around it: some other cells are lower than a slope of the
/// ground allows (slope-based filter, Vosselman, 2000). One lower cell may be a wrong range.
bool above_ground(const Window& w, const Vec3& p, const std::vector<ScanGroundWorkspace::Bin>& bins,
                  const std::vector<ScanGroundCell>& cells) {
  int lower = 0;
  for_each_cell(w, bins, cells, [&](const Vec3& other) {
    const Vec3 d = p - other;
    if (d.z() > kStep_m + kSteepest * d.head<2>().norm()) ++lower;
  });
  return lower >= kLower;
}

}  // namespace

void find_scan_ground(const Points& lowest_vehicle, const Mat3& R_level_vehicle,
                      ScanGroundWorkspace* workspace, std::vector<ScanGroundCell>* cells) {
  std::vector<ScanGroundWorkspace::Bin>& bins = workspace->bins;
  bins.assign(static_cast<std::size_t>(kSide) * kSide, {});
  cells->clear();
  const Mat3f R = R_level_vehicle.cast<float>();
  const auto index = [](float v) {
    return static_cast<int>(std::floor((v + kRadius_m) / kScanGroundCell_m));
  };
  for (std::size_t k = 0; k < lowest_vehicle.size(); ++k) {
    const Vec3f p = R * lowest_vehicle[k];
    if (!(p.head<2>().cwiseAbs().maxCoeff() < kRadius_m)) continue;
    ScanGroundWorkspace::Bin& bin =
        bins[static_cast<std::size_t>(index(p.y()) * kSide + index(p.x()))];
    bin.sum += p;
    ++bin.points;
  }
  for (ScanGroundWorkspace::Bin& bin : bins) {
    if (bin.points == 0) continue;
    bin.cell = static_cast<std::int32_t>(cells->size());
    cells->push_back({bin.sum.cast<double>() / bin.points, Vec2::Zero()});
  }
  std::vector<char>& object = workspace->object;
  object.clear();
  for (const ScanGroundCell& cell : *cells) {
    const Window w{index(static_cast<float>(cell.p.x())), index(static_cast<float>(cell.p.y())),
                   kObjectSteps};
    object.push_back(above_ground(w, cell.p, bins, *cells) ? 1 : 0);
  }
  std::size_t kept = 0;
  for (ScanGroundWorkspace::Bin& bin : bins) {
    if (bin.cell < 0) continue;
    const auto k = static_cast<std::size_t>(bin.cell);
    bin.cell = -1;
    if (object[k] != 0) continue;
    bin.cell = static_cast<std::int32_t>(kept);
    (*cells)[kept++] = (*cells)[k];
  }
  cells->resize(kept);
  for (ScanGroundCell& cell : *cells) {
    Window w{index(static_cast<float>(cell.p.x())), index(static_cast<float>(cell.p.y())),
             kFirstSteps};
    for (; w.half <= kMaxSteps; ++w.half) {
      int n = 0;
      for_each_cell(w, bins, *cells, [&n](const Vec3& /*p*/) { ++n; });
      if (n < kEnough) continue;
      cell.slope = plane_slope(w, cell, bins, *cells);
      break;
    }
  }
}

}  // namespace rcs::sp
