#include "modules/registration/coarse_search.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <utility>

#include "modules/registration/voxel_sampler.h"

namespace rcs::registration {
namespace {

constexpr float kNoPair = 0.01F;  // a smaller robust weight counts as zero
constexpr int kFewestPairs = 20;
constexpr double kStep = 0.005;     // converged: moved by less than this share of a voxel's edge,
constexpr double kStepTurn = 0.05;  // and turned by less than this share of it, per metre
constexpr int kIterations = 12;     // of the finest size, which begins near its result
// A match is kept while its point has moved less than this share of the voxel's edge.
constexpr float kSearchAgain = 0.04F;

/// Sums at one pose over points to the means of their distributions, eight pairs at a time.
class GaussianSums {
 public:
  explicit GaussianSums(double robust) : per_robust_(static_cast<float>(1.0 / robust)) {
    for (Lane& in : in_) in.setZero();
    for (Lane& sum : sums_) sum.setZero();
  }

  /// @param d  from the vehicle to the point, along the map's axes
  /// @param r  from the mean to the point
  void add(const Vec3f& d, const Vec3f& r, const std::array<float, 6>& information) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      in_[k][filled_] = d[axis];
      in_[3 + k][filled_] = r[axis];
    }
    for (std::size_t k = 0; k < information.size(); ++k) in_[6 + k][filled_] = information[k];
    ++pairs_;
    if (++filled_ == kLanes) flush();
  }

  /// Call it once. Of (rho, phi): T' = (exp(phi) R, t + rho).
  void finish(Mat6* H, Vec6* b, double* weight) {
    if (filled_ > 0) {
      for (int lane = filled_; lane < kLanes; ++lane) {
        for (Lane& in : in_) in[lane] = 0.0F;
        ghosts_ += 1.0;  // each has weight one and no residual
      }
      flush();
    }
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j <= i; ++j, ++k) (*H)(i, j) = (*H)(j, i) = double{sums_[k].sum()};
    }
    for (int i = 0; i < 6; ++i, ++k) (*b)[i] = double{sums_[k].sum()};
    *weight = double{sums_[k].sum()} - ghosts_;
  }
  [[nodiscard]] int pairs() const { return pairs_; }

 private:
  static constexpr int kLanes = 8;
  using Lane = Eigen::Array<float, kLanes, 1>;

  void flush() {
    const Lane& x = in_[0];
    const Lane& y = in_[1];
    const Lane& z = in_[2];
    const std::array<std::array<const Lane*, 3>, 3> L = {
        {{&in_[6], &in_[7], &in_[8]}, {&in_[7], &in_[9], &in_[10]}, {&in_[8], &in_[10], &in_[11]}}};
    std::array<Lane, 3> Lr;
    for (std::size_t i = 0; i < 3; ++i) {
      Lr[i] = *L[i][0] * in_[3] + *L[i][1] * in_[4] + *L[i][2] * in_[5];
    }
    const Lane u = in_[3] * Lr[0] + in_[4] * Lr[1] + in_[5] * Lr[2];
    const Lane k = (1.0F + per_robust_ * u).inverse();
    const Lane w = (k * k < kNoPair).select(Lane::Zero(), k * k);
    // J = [I, -hat(d)]: rows of L J, and of hat(d) L J.
    std::array<std::array<Lane, 6>, 6> h;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) h[i][j] = w * *L[i][j];
      h[i][3] = h[i][2] * y - h[i][1] * z;
      h[i][4] = h[i][0] * z - h[i][2] * x;
      h[i][5] = h[i][1] * x - h[i][0] * y;
    }
    for (std::size_t j = 0; j < 6; ++j) {
      h[3][j] = y * h[2][j] - z * h[1][j];
      h[4][j] = z * h[0][j] - x * h[2][j];
      h[5][j] = x * h[1][j] - y * h[0][j];
    }
    std::size_t n = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j <= i; ++j, ++n) sums_[n] += h[i][j];
    }
    const std::array<Lane, 3> b = {w * Lr[0], w * Lr[1], w * Lr[2]};
    for (std::size_t i = 0; i < 3; ++i) sums_[n++] += b[i];
    sums_[n++] += y * b[2] - z * b[1];
    sums_[n++] += z * b[0] - x * b[2];
    sums_[n++] += x * b[1] - y * b[0];
    sums_[n] += w;
    filled_ = 0;
  }

  float per_robust_;
  std::array<Lane, 12> in_;    // of the waiting pairs: d, r, information
  std::array<Lane, 28> sums_;  // H, lower triangle by rows; b; weight
  int filled_ = 0;
  int pairs_ = 0;
  double ghosts_ = 0.0;
};

}  // namespace

Descent::Descent(Points source_vehicle, const WideMap* map, double robust)
    : source_(std::move(source_vehicle)), map_(map), robust_(robust) {
  forget_matches();
}

void Descent::forget_matches() {
  matches_.assign(source_.size(), Match{Vec3f::Constant(1e9F), nullptr});
}

Descent::Sums Descent::sum(std::size_t level, const Pose& T) {
  if (level != level_) forget_matches();
  level_ = level;
  used_ += static_cast<WorkUnits>(source_.size());
  GaussianSums sums(robust_);
  const Mat3f R = T.rotation().cast<float>();
  const Vec3f t = T.p.cast<float>();
  const float confirm_m = kSearchAgain * static_cast<float>(WideMap::kVoxel_m[level]);
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const Vec3f d = R * source_[i];
    const Vec3f q = d + t;
    Match& match = matches_[i];
    if ((q - match.asked).squaredNorm() > confirm_m * confirm_m) {
      match = {q, map_->nearest(level, q)};
    }
    if (match.gaussian == nullptr) continue;
    sums.add(d, q - match.gaussian->mean, match.gaussian->information);
  }
  Sums out;
  sums.finish(&out.H, &out.b, &out.weight);
  out.pairs = sums.pairs();
  return out;
}

void Descent::descend(std::size_t level, int most, Pose* T) {
  const double small_m = kStep * WideMap::kVoxel_m[level];
  for (int k = 0; k < most; ++k) {
    Sums s = sum(level, *T);
    ++iterations_;
    if (s.pairs < kFewestPairs) return;
    s.H.diagonal().array() += 1e-6 * s.H.diagonal().maxCoeff();
    const Vec6 step = -s.H.ldlt().solve(s.b);
    if (!step.allFinite()) return;
    *T = {(exp_so3(step.tail<3>()) * T->q).normalized(), T->p + step.head<3>()};
    if (step.head<3>().norm() < small_m && step.tail<3>().norm() < kStepTurn * small_m) return;
  }
}

double Descent::score(std::size_t level, const Pose& T) {
  return source_.empty() ? 0.0 : sum(level, T).weight / static_cast<double>(source_.size());
}

WideAnswer search_wide(const Points& source_vehicle, const WideMap& map, const Pose& guess,
                       const WideParams& params) {
  Descent descent(thinned(source_vehicle, params.points), &map, params.robust);
  constexpr std::size_t kFinest = WideMap::kVoxel_m.size() - 1;
  WideAnswer best;
  best.score = -1.0;
  for (const std::size_t from : {std::size_t{0}, kFinest}) {
    Pose T = guess;
    for (std::size_t level = from; level <= kFinest; ++level) {
      descent.descend(level, level == kFinest ? kIterations : params.max_iterations, &T);
    }
    const double score = descent.score(kFinest, T);
    if (score > best.score) {
      best.score = score;
      best.T_target_vehicle = T;
    }
  }
  best.iterations = descent.iterations();
  best.used = descent.used();
  return best;
}

}  // namespace rcs::registration
