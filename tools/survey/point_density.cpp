#include "tools/survey/point_density.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace rcs::survey {
namespace {

constexpr double kPointsPerBin = 16.0;
constexpr double kMaxBins = 1024.0;  // along an axis
constexpr std::size_t kMaxSample = 100'000;

/// FNV-1a over the bytes of the coordinates, and the finalizer of MurmurHash3, whose low bits
/// depend on all bytes.
std::uint64_t hash_of(const Vec3& p) {
  std::array<unsigned char, 3 * sizeof(double)> bytes{};
  std::memcpy(bytes.data(), p.data(), bytes.size());
  std::uint64_t h = 14695981039346656037ULL;
  for (const unsigned char b : bytes) h = (h ^ b) * 1099511628211ULL;
  h = (h ^ h >> 33U) * 0xff51afd7ed558ccdULL;
  h = (h ^ h >> 33U) * 0xc4ceb9fe1a85ec53ULL;
  return h ^ h >> 33U;
}

}  // namespace

PointDensity::PointDensity(const Vec2& low, const Vec2& high, std::int64_t points) : low_(low) {
  constexpr double kSmallest_m = 0.1;
  const Vec2 extent = (high - low).cwiseMax(kSmallest_m);
  const double n = std::max(static_cast<double>(points), 1.0);
  bin_m_ = std::max(
      {std::sqrt(kPointsPerBin * extent.prod() / n), extent.maxCoeff() / kMaxBins, kSmallest_m});
  width_ = 1 + static_cast<int>(extent.x() / bin_m_);
  height_ = 1 + static_cast<int>(extent.y() / bin_m_);
  surveyed_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
}

void PointDensity::add(const Vec3& p) {
  // The borders of a projected area are curved: points may lie slightly outside of the corners.
  const int i = std::clamp(static_cast<int>((p.x() - low_.x()) / bin_m_), 0, width_ - 1);
  const int j = std::clamp(static_cast<int>((p.y() - low_.y()) / bin_m_), 0, height_ - 1);
  surveyed_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
            static_cast<std::size_t>(i)] = 1;
  counted_.lowest_m = counted_.points == 0 ? p.z() : std::min(counted_.lowest_m, p.z());
  counted_.highest_m = counted_.points == 0 ? p.z() : std::max(counted_.highest_m, p.z());
  ++counted_.points;
  sample(p);
}

void PointDensity::sample(const Vec3& p) {
  const std::uint64_t h = hash_of(p);
  if ((h & mask_) != 0) return;
  ++sampled_;
  distinct_.insert(h);
  if (distinct_.size() < kMaxSample) return;
  // Half of the sample; the share of duplicates is that of the sample so far.
  mask_ = mask_ << 1U | 1U;
  const double share = static_cast<double>(sampled_) / static_cast<double>(distinct_.size());
  for (auto it = distinct_.begin(); it != distinct_.end();) {
    it = (*it & mask_) != 0 ? distinct_.erase(it) : std::next(it);
  }
  sampled_ = std::llround(share * static_cast<double>(distinct_.size()));
}

double PointDensity::largest_hole_m2() const {
  std::vector<std::uint8_t> done = surveyed_;
  std::vector<int> open;
  const auto at = [this](int i, int j) { return j * width_ + i; };
  /// @return number of bins of the hole at (i, j); they are done afterwards
  const auto fill = [&](int i, int j) {
    std::int64_t bins = 0;
    const auto visit = [&](int a, int b) {
      if (a < 0 || b < 0 || a >= width_ || b >= height_) return;
      std::uint8_t& cell = done[static_cast<std::size_t>(at(a, b))];
      if (cell != 0) return;
      cell = 1;
      open.push_back(at(a, b));
    };
    for (visit(i, j); !open.empty(); ++bins) {
      const int a = open.back() % width_;
      const int b = open.back() / width_;
      open.pop_back();
      visit(a - 1, b);
      visit(a + 1, b);
      visit(a, b - 1);
      visit(a, b + 1);
    }
    return bins;
  };
  for (int i = 0; i < width_; ++i) (void)(fill(i, 0) + fill(i, height_ - 1));  // not enclosed
  for (int j = 0; j < height_; ++j) (void)(fill(0, j) + fill(width_ - 1, j));
  std::int64_t largest = 0;
  for (int j = 0; j < height_; ++j) {
    for (int i = 0; i < width_; ++i) largest = std::max(largest, fill(i, j));
  }
  return static_cast<double>(largest) * bin_m_ * bin_m_;
}

DensityMetrics PointDensity::metrics() const {
  DensityMetrics f = counted_;
  f.surveyed_m2 =
      bin_m_ * bin_m_ * static_cast<double>(std::count(surveyed_.begin(), surveyed_.end(), 1));
  if (f.points > 0) f.points_per_m2 = static_cast<double>(f.points) / f.surveyed_m2;
  f.largest_hole_m2 = largest_hole_m2();
  if (sampled_ > 0) {
    f.duplicate_share = 1.0 - static_cast<double>(distinct_.size()) / static_cast<double>(sampled_);
  }
  return f;
}

double cell_of_density(double points_per_m2) {
  constexpr std::array<double, 9> kCells_m = {0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0};
  for (const double cell_m : kCells_m) {
    if (points_per_m2 * cell_m * cell_m >= kPointsPerCell) return cell_m;
  }
  return kCells_m.back();
}

std::vector<std::string> density_warnings(const DensityMetrics& density, double cell_m,
                                          std::int64_t ground_cells) {
  constexpr double kMinPointsPerCell = 2.0;
  constexpr double kMinCoverage = 0.8;
  constexpr double kMaxHole = 0.02;  // of the surveyed area
  constexpr double kMaxDuplicates = 0.01;
  constexpr double kMaxExtent_m = 200e3;
  constexpr double kMinExtent_m = 20.0;
  std::vector<std::string> warnings;
  const double per_cell = density.points_per_m2 * cell_m * cell_m;
  if (per_cell < kMinPointsPerCell) {
    warnings.push_back(fmt::format(
        "{:.2g} points per cell of {:g} m on average: the sigma of a cell cannot be measured; "
        "{:g} m gives {:.0f}",
        per_cell, cell_m, cell_of_density(density.points_per_m2),
        density.points_per_m2 * std::pow(cell_of_density(density.points_per_m2), 2)));
  }
  const double known_m2 = static_cast<double>(ground_cells) * cell_m * cell_m;
  if (known_m2 < kMinCoverage * density.surveyed_m2) {
    warnings.push_back(
        fmt::format("the map has heights in {:.0f} % of the surveyed area: the other cells have no "
                    "ground point",
                    100.0 * known_m2 / density.surveyed_m2));
  }
  if (density.largest_hole_m2 > kMaxHole * density.surveyed_m2) {
    warnings.push_back(fmt::format("a hole of {:.3g} m2 without points is enclosed by the survey",
                                   density.largest_hole_m2));
  }
  if (density.duplicate_share > kMaxDuplicates) {
    warnings.push_back(fmt::format(
        "{:.0f} % of the points repeat the coordinates of another: is a file given twice?",
        100.0 * density.duplicate_share));
  }
  if (density.points > 1 && density.highest_m == density.lowest_m) {
    warnings.push_back(fmt::format("all heights are {:g} m: is the third coordinate the height?",
                                   density.lowest_m));
  }
  const double side_m = std::sqrt(density.surveyed_m2);
  if (side_m > kMaxExtent_m || side_m < kMinExtent_m) {
    warnings.push_back(fmt::format(
        "the surveyed area is {:.3g} x {:.3g} m: check the unit of the coordinates (--crs)", side_m,
        side_m));
  }
  return warnings;
}

}  // namespace rcs::survey
