#include "modules/sp/voxel_scale.h"

#include <algorithm>

namespace rcs::sp {
namespace {

// Chosen on corridors of 2 to 16 m width (docs/experiments/registration/rooms.md).
constexpr double kOfRange = 0.06;
constexpr double kOfNoise = 9.0;
constexpr std::size_t kDistances = 2000;
constexpr double kMuch = 2.0;
constexpr int kLasting = 20;

}  // namespace

double median_range_m(const Points& points, const Vec3& ladar_m, std::vector<float>* buffer) {
  buffer->clear();
  const Vec3f from = ladar_m.cast<float>();
  const std::size_t step = points.size() / kDistances + 1;
  for (std::size_t i = 0; i < points.size(); i += step) {
    buffer->push_back((points[i] - from).norm());
  }
  if (buffer->empty()) return 0.0;
  const auto middle = buffer->begin() + static_cast<std::ptrdiff_t>(buffer->size() / 2);
  std::nth_element(buffer->begin(), middle, buffer->end());
  return static_cast<double>(*middle);
}

double fitting_voxel_m(double median_range_m) { return kOfRange * median_range_m; }

double fitting_scale(double median_range_m, double voxel_m, double noise_m) {
  const double fitting_m = std::max(fitting_voxel_m(median_range_m), kOfNoise * noise_m);
  return std::min(1.0, fitting_m / voxel_m);
}

bool VoxelScale::unsuitable(double fitting) {
  const bool suits = fitting < kMuch * scale_ && scale_ < kMuch * fitting;
  unfit_ = suits ? 0 : unfit_ + 1;
  return unfit_ >= kLasting;
}

}  // namespace rcs::sp
