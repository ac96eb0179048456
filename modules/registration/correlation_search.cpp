#include "modules/registration/correlation_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>

#include "modules/registration/voxel_key.h"
#include "rcs/base/check.h"

namespace rcs::registration {
namespace {

constexpr std::size_t kFewest = 20;  // structure points of the model
constexpr std::size_t kKept = 1000;  // best cells of all headings
constexpr int kApartCells = 2;       // candidates nearer than this,
constexpr double kApart_rad = 0.06;  // and turned by less, count as one
constexpr int kLanes = 32;           // bytes that one instruction adds

int padded(int n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// Occupied cells of the model in its levelled frame, with an empty margin on every side.
class Cells {
 public:
  Cells(const std::vector<Vec3f>& points, const CorrelationParams& params, int margin)
      : per_m_(1.0F / static_cast<float>(params.cell_m)),
        margin_(margin),
        slack_(fast_floor(static_cast<float>(params.slack_m) * per_m_)) {
    Vec3f highest = points[0];
    lowest_ = points[0];
    for (const Vec3f& p : points) {
      lowest_ = lowest_.cwiseMin(p);
      highest = highest.cwiseMax(p);
    }
    const Vec3f extent = (highest - lowest_) * per_m_;
    width_ = padded(fast_floor(extent.x()) + 1 + 2 * margin) + kLanes;
    depth_ = fast_floor(extent.y()) + 1 + 2 * margin;
    layers_ = fast_floor(extent.z()) + 1 + 2 * slack_;
    occupied_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(depth_) *
                         static_cast<std::size_t>(layers_),
                     0);
    for (const Vec3f& p : points) {
      const Vec3f c = (p - lowest_) * per_m_;
      const int x = fast_floor(c.x()) + margin;
      const int y = fast_floor(c.y()) + margin;
      const int z = fast_floor(c.z());
      for (int k = 0; k <= 2 * slack_; ++k) occupied_[index(x, y, z + k)] = 1;
    }
  }

  /// Adds the cells around `p`, `side` x `side` of them, to the rows of `sums`; nothing if they are
  /// not all within the margins.
  void add_around(const Vec3f& p, int side, int row, std::vector<std::uint8_t>* sums) const {
    const Vec3f c = (p - lowest_) * per_m_;
    constexpr float kFar = 1e6F;
    if (!(c.cwiseAbs().maxCoeff() < kFar)) return;
    const int half = side / 2;
    const int x = fast_floor(c.x()) + margin_ - half;
    const int y = fast_floor(c.y()) + margin_ - half;
    const int z = fast_floor(c.z()) + slack_;
    if (x < 0 || y < 0 || z < 0 || x + row > width_ || y + side > depth_ || z >= layers_) return;
    const std::uint8_t* from = &occupied_[index(x, y, z)];
    std::uint8_t* to = sums->data();
    for (int j = 0; j < side; ++j, from += width_, to += row) {
      for (int i = 0; i < row; ++i) to[i] = static_cast<std::uint8_t>(to[i] + from[i]);
    }
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(depth_) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(x);
  }

  float per_m_;
  int margin_;
  int slack_;  // cells
  Vec3f lowest_;
  int width_ = 0;
  int depth_ = 0;
  int layers_ = 0;
  std::vector<std::uint8_t> occupied_;  // 0 or 1
};

struct Peak {
  int count;
  int turn, x, y;  // steps from the base
};

bool is_better(const Peak& a, const Peak& b) {
  // Of equals the nearest to the base, then in a fixed order.
  const auto far = [](const Peak& p) { return p.turn * p.turn + p.x * p.x + p.y * p.y; };
  return std::make_tuple(-a.count, far(a), a.turn, a.x, a.y) <
         std::make_tuple(-b.count, far(b), b.turn, b.x, b.y);
}

/// The best of all peaks that are added.
class Best {
 public:
  void add(const Peak& peak) {
    if (is_full_ && !is_better(peak, worst_)) return;
    peaks_.push_back(peak);
    if (peaks_.size() < 4 * kKept) return;
    std::nth_element(peaks_.begin(), peaks_.begin() + kKept - 1, peaks_.end(), is_better);
    peaks_.resize(kKept);
    worst_ = peaks_.back();
    is_full_ = true;
  }
  [[nodiscard]] int worst() const { return worst_.count; }  ///< a peak must not have less
  [[nodiscard]] std::vector<Peak> sorted() {
    std::sort(peaks_.begin(), peaks_.end(), is_better);
    return peaks_;
  }

 private:
  std::vector<Peak> peaks_;
  Peak worst_{};
  bool is_full_ = false;
};

std::vector<Peak> distinct(const std::vector<Peak>& peaks, const CorrelationParams& params) {
  std::vector<Peak> out;
  for (const Peak& p : peaks) {
    if (out.size() == static_cast<std::size_t>(params.candidates)) break;
    const bool is_new = std::none_of(out.begin(), out.end(), [&](const Peak& other) {
      return std::abs(p.x - other.x) <= kApartCells && std::abs(p.y - other.y) <= kApartCells &&
             std::abs(wrap_angle((p.turn - other.turn) * params.turn_step_rad)) < kApart_rad;
    });
    if (is_new) out.push_back(p);
  }
  return out;
}

}  // namespace

std::vector<Hypothesis> correlate(const PreparedCloud& model, const PreparedCloud& data,
                                  const Pose& base, const SearchRegion& region,
                                  const CorrelationParams& params) {
  RCS_CHECK(data.test_points().size() < 256);  // counted in bytes
  // Levelled frame: the model's, turned so that up() is z.
  const Quat level = Quat::FromTwoVectors(model.up().cast<double>(), Vec3::UnitZ());
  const Mat3f L = level.toRotationMatrix().cast<float>();
  const Vec3f centre = (level * base.p).cast<float>();
  const auto reach_m = static_cast<float>(params.range_m + region.radius_m);
  const auto height_m = static_cast<float>(params.height_m);
  std::vector<Vec3f> near;
  for (std::size_t i = 0; i < model.structure().size(); ++i) {
    const Vec3f p = L * model.structure()[i];
    const Vec3f from = p - centre;
    if (from.head<2>().norm() < reach_m && std::abs(from.z()) < height_m) near.push_back(p);
  }
  if (near.size() < kFewest || data.test_points().empty()) return {};

  const int half = static_cast<int>(std::ceil(region.radius_m / params.cell_m));
  const int side = 2 * half + 1;
  const int row = padded(side);
  const Cells cells(near, params, 2 * half);
  const int turns = static_cast<int>(std::ceil(region.turn_rad / params.turn_step_rad - 1e-9));
  std::vector<std::uint8_t> sums(static_cast<std::size_t>(side) * static_cast<std::size_t>(row));
  Best best;
  for (int turn = -turns; turn <= turns; ++turn) {
    const Quat q = exp_so3(Vec3(0.0, 0.0, turn * params.turn_step_rad)) * level * base.q;
    const Mat3f R = q.toRotationMatrix().cast<float>();
    std::fill(sums.begin(), sums.end(), std::uint8_t{0});
    for (std::size_t i = 0; i < data.test_points().size(); ++i) {
      cells.add_around(R * data.test_points()[i] + centre, side, row, &sums);
    }
    const std::uint8_t* sum = sums.data();
    for (int j = 0; j < side; ++j, sum += row) {
      const int most = *std::max_element(sum, sum + side);
      if (most == 0 || most < best.worst()) continue;
      for (int i = 0; i < side; ++i) {
        if (sum[i] > 0) best.add({sum[i], turn, i - half, j - half});
      }
    }
  }

  std::vector<Hypothesis> out;
  for (const Peak& p : distinct(best.sorted(), params)) {
    const Quat turned = exp_so3(Vec3(0.0, 0.0, p.turn * params.turn_step_rad)) * level * base.q;
    const Vec3 shift = level.conjugate() * (params.cell_m * Vec3(p.x, p.y, 0.0));
    const Pose at = {(level.conjugate() * turned).normalized(), base.p + shift};
    out.push_back({on_common_ground(model, data, at),
                   p.count / static_cast<double>(data.test_points().size())});
  }
  return out;
}

}  // namespace rcs::registration
