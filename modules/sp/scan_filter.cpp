#include "modules/sp/scan_filter.h"

#include <algorithm>

#include "modules/sp/voxel_key.h"
#include "rcs/base/check.h"

namespace rcs::sp {
namespace {

struct Knot {
  Mat3f R = Mat3f::Identity();
  Vec3f t = Vec3f::Zero();
};

}  // namespace

void deskew(const MotionTable& motion, Scan* scan) {
  const std::size_t n = scan->points.size();
  RCS_CHECK(scan->dt_us.size() == n && motion.T_reference_vehicle.size() >= 2);
  const auto last_knot = static_cast<std::int64_t>(motion.T_reference_vehicle.size()) - 2;
  const float per_step = 1.0F / static_cast<float>(motion.step.count());
  std::int64_t current = -1;
  Knot a;
  Knot b;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int64_t since = scan->dt_us[i] - motion.first.count();
    const std::int64_t k = std::clamp(since / motion.step.count(), std::int64_t{0}, last_knot);
    if (k != current) {  // points come nearly in order of time: seldom
      const Pose& T0 = motion.T_reference_vehicle[static_cast<std::size_t>(k)];
      const Pose& T1 = motion.T_reference_vehicle[static_cast<std::size_t>(k) + 1];
      a = {T0.rotation().cast<float>(), T0.p.cast<float>()};
      b = {T1.rotation().cast<float>(), T1.p.cast<float>()};
      current = k;
    }
    const float u = static_cast<float>(since - k * motion.step.count()) * per_step;
    const Vec3f p = scan->points[i];
    const Vec3f p0 = a.R * p + a.t;
    const Vec3f p1 = b.R * p + b.t;
    const Vec3f moved = p0 + u * (p1 - p0);
    scan->points.x[i] = moved.x();
    scan->points.y[i] = moved.y();
    scan->points.z[i] = moved.z();
  }
  std::fill(scan->dt_us.begin(), scan->dt_us.end(), 0);
}

void keep_evenly(std::size_t most, Points* points) {
  const std::size_t n = points->size();
  if (n <= most) return;
  for (std::size_t k = 0; k < most; ++k) {
    const std::size_t from = k * n / most;
    points->x[k] = points->x[from];
    points->y[k] = points->y[from];
    points->z[k] = points->z[from];
  }
  points->resize(most);
}

void VoxelSampler::sample(const Points& in, double voxel_m, Points* out) {
  RCS_CHECK(voxel_m > 0.0);
  out->clear();
  const std::size_t n = in.size();
  table_.begin(n);
  const float per_m = 1.0F / static_cast<float>(voxel_m);
  VoxelKey last = ~VoxelKey{0};
  for (std::size_t i = 0; i < n; ++i) {
    const VoxelKey key = pack_voxel(fast_floor(in.x[i] * per_m), fast_floor(in.y[i] * per_m),
                                    fast_floor(in.z[i] * per_m));
    if (key == last) continue;  // neighbours in the scan are mostly neighbours in space
    last = key;
    if (table_.find_or_add(key).second) out->push_back(in[i]);
  }
}

void ColumnSampler::sample(const Points& in, const Vec3& up_vehicle, double column_m, Points* out) {
  RCS_CHECK(column_m > 0.0);
  out->clear();
  const std::size_t n = in.size();
  table_.begin(n);
  per_m_ = 1.0F / static_cast<float>(column_m);
  level_ = Quat::FromTwoVectors(up_vehicle, Vec3::UnitZ()).toRotationMatrix().cast<float>();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3f p = in[i];
    const Vec3f q = level_ * p;
    const auto [lowest, fresh] =
        table_.find_or_add(pack_voxel(fast_floor(q.x() * per_m_), fast_floor(q.y() * per_m_), 0));
    if (fresh) {
      *lowest = {static_cast<std::uint32_t>(out->size()), q.z()};
      out->push_back(p);
    } else if (q.z() < lowest->height_m) {
      lowest->height_m = q.z();
      out->x[lowest->kept] = p.x();
      out->y[lowest->kept] = p.y();
      out->z[lowest->kept] = p.z();
    }
  }
}

void ColumnSampler::standing(const Points& in, double above_m, Points* out) {
  out->clear();
  const auto above = static_cast<float>(above_m);
  VoxelKey last = ~VoxelKey{0};
  float least_m = 0.0F;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vec3f p = in[i];
    const Vec3f q = level_ * p;
    const VoxelKey key = pack_voxel(fast_floor(q.x() * per_m_), fast_floor(q.y() * per_m_), 0);
    if (key != last) {  // neighbours in the scan are mostly of one column
      last = key;
      least_m = table_.find_or_add(key).first->height_m + above;
    }
    if (q.z() > least_m) out->push_back(p);
  }
}

}  // namespace rcs::sp
