#include "modules/sp/scan/column_sampler.h"

#include "modules/registration/voxel_key.h"
#include "rcs/base/check.h"

namespace rcs::sp {

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
    const auto [lowest, fresh] = table_.find_or_add(registration::pack_voxel(
        registration::fast_floor(q.x() * per_m_), registration::fast_floor(q.y() * per_m_), 0));
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
  registration::VoxelKey last = ~registration::VoxelKey{0};
  float min_m = 0.0F;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const Vec3f p = in[i];
    const Vec3f q = level_ * p;
    const registration::VoxelKey key = registration::pack_voxel(
        registration::fast_floor(q.x() * per_m_), registration::fast_floor(q.y() * per_m_), 0);
    if (key != last) {  // neighbours in the scan are mostly in one column
      last = key;
      min_m = table_.find_or_add(key).first->height_m + above;
    }
    if (q.z() > min_m) out->push_back(p);
  }
}

}  // namespace rcs::sp
