#include "modules/sp/wide_search.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

namespace rcs::sp {
namespace {

constexpr float kFewest = 4.0F;     // points of a distribution
constexpr float kThinnest = 0.01F;  // middle standard deviation over the voxel's edge
constexpr float kNoPair = 0.01F;    // of a robust weight: less pulls at nothing
constexpr int kFewestPairs = 20;
constexpr double kStep = 0.005;     // converged: moved by less of a voxel's edge,
constexpr double kStepTurn = 0.05;  // and turned by less of that, per metre
constexpr int kIterations = 12;     // of the finest size, which begins near its answer

// A match is kept while its point has moved less than this share of the voxel's edge.
constexpr float kSearchAgain = 0.04F;

struct Match {
  Vec3f asked = Vec3f::Constant(1e9F);
  const WideMap::Gaussian* gaussian = nullptr;
};

/// Sums at one pose over points to the means of their distributions, eight pairs at a time.
class GaussianSums {
 public:
  explicit GaussianSums(double robust) : per_robust_(static_cast<float>(1.0 / robust)) {
    for (Lane& in : in_) in.setZero();
    for (Lane& sum : sums_) sum.setZero();
  }

  /// @param d  the point from the vehicle, in the map's directions
  /// @param r  the point from the mean
  void add(const Vec3f& d, const Vec3f& r, const std::array<float, 6>& information) {
    for (int axis = 0; axis < 3; ++axis) {
      in_[axis][filled_] = d[axis];
      in_[3 + axis][filled_] = r[axis];
    }
    for (std::size_t k = 0; k < information.size(); ++k) in_[6 + k][filled_] = information[k];
    ++pairs_;
    if (++filled_ == kLanes) flush();
  }

  /// Once. Of (rho, phi): T' = (exp(phi) R, t + rho).
  void finish(Mat6* H, Vec6* b, double* weight) {
    if (filled_ > 0) {
      for (int lane = filled_; lane < kLanes; ++lane) {
        for (Lane& in : in_) in[lane] = 0.0F;
        ghosts_ += 1.0;  // each weighs one, and pulls at nothing
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
  std::array<Lane, 12> in_;    // of the pairs that wait: d, r, information
  std::array<Lane, 28> sums_;  // H, lower triangle by rows; b; weight
  int filled_ = 0;
  int pairs_ = 0;
  double ghosts_ = 0.0;
};

struct Sums {
  Mat6 H;
  Vec6 b;
  double weight = 0.0;
  int pairs = 0;
};

Sums sum(const Points& source, const WideMap& map, std::size_t level, const Pose& T, double robust,
         std::vector<Match>* matches) {
  GaussianSums sums(robust);
  const Mat3f R = T.rotation().cast<float>();
  const Vec3f t = T.p.cast<float>();
  const float again_m = kSearchAgain * static_cast<float>(WideMap::kVoxel_m[level]);
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3f d = R * source[i];
    const Vec3f q = d + t;
    Match& match = (*matches)[i];
    if ((q - match.asked).squaredNorm() > again_m * again_m) {
      match = {q, map.nearest(level, q)};
    }
    if (match.gaussian == nullptr) continue;
    sums.add(d, q - match.gaussian->mean, match.gaussian->information);
  }
  Sums out;
  sums.finish(&out.H, &out.b, &out.weight);
  out.pairs = sums.pairs();
  return out;
}

void descend(const Points& source, const WideMap& map, std::size_t level, int most,
             const WideParams& params, std::vector<Match>* matches, WideAnswer* at) {
  matches->assign(source.size(), Match{});
  const double small_m = kStep * WideMap::kVoxel_m[level];
  for (int k = 0; k < most; ++k) {
    Sums s = sum(source, map, level, at->T_target_vehicle, params.robust, matches);
    ++at->iterations;
    at->used += static_cast<WorkUnits>(source.size());
    if (s.pairs < kFewestPairs) return;
    s.H.diagonal().array() += 1e-6 * s.H.diagonal().maxCoeff();
    const Vec6 step = -s.H.ldlt().solve(s.b);
    if (!step.allFinite()) return;
    Pose& T = at->T_target_vehicle;
    T = {(exp_so3(step.tail<3>()) * T.q).normalized(), T.p + step.head<3>()};
    if (step.head<3>().norm() < small_m && step.tail<3>().norm() < kStepTurn * small_m) return;
  }
}

}  // namespace

WideMap::Level::Level(double voxel, std::size_t capacity)
    : voxel_m(static_cast<float>(voxel)),
      per_m(1.0F / static_cast<float>(voxel)),
      index(capacity) {}

template <class Visit>
void WideMap::Level::add(const Visit& visit_all) {
  visit_all([this](const Moments& m, const Vec3f& origin) {
    const Vec3f p = (m.mean + origin) * per_m;
    const auto fresh = static_cast<std::uint32_t>(moments.size());
    const VoxelKey key = pack_voxel(fast_floor(p.x()), fast_floor(p.y()), fast_floor(p.z()));
    const std::uint32_t number = index.find_or_add(key, fresh);
    if (number == fresh) {
      moments.emplace_back();
      keys.push_back(key);
    }
    moments[number].add(m, origin);
  });
}

void WideMap::Level::fit(const WideParams& params) {
  index = VoxelIndex(moments.size());
  const auto noise = static_cast<float>(params.range_sigma_m * params.range_sigma_m);
  for (std::size_t k = 0; k < moments.size(); ++k) {
    const Moments& m = moments[k];
    if (m.count < kFewest) continue;
    Eigen::SelfAdjointEigenSolver<Mat3f> eigen;
    eigen.computeDirect(m.covariance());
    Vec3f lambda = eigen.eigenvalues().cwiseMax(0.0F);
    if (lambda[1] < kThinnest * kThinnest * voxel_m * voxel_m) continue;
    lambda = lambda.cwiseMax(static_cast<float>(params.flatness) * lambda[2]);
    lambda.array() += noise;
    const Mat3f V = eigen.eigenvectors();
    const Mat3f L = V * lambda.cwiseInverse().asDiagonal() * V.transpose();
    index.find_or_add(keys[k], static_cast<std::uint32_t>(gaussians.size()));
    gaussians.push_back({m.mean, {L(0, 0), L(0, 1), L(0, 2), L(1, 1), L(1, 2), L(2, 2)}});
  }
}

WideMap::WideMap(const RollingMap& map, const WideParams& params) {
  std::size_t finer = map.coarse().size();
  for (std::size_t n = kVoxel_m.size(); n-- > 0;) {
    Level level(kVoxel_m[n], finer);
    if (levels_.empty()) {
      level.add([&map](const auto& visit) { map.coarse().for_each(visit); });
    } else {
      const Level& last = levels_.front();
      level.add([&last](const auto& visit) {
        for (const Moments& m : last.moments) visit(m, Vec3f::Zero());
      });
    }
    level.fit(params);
    finer = level.moments.size();
    levels_.insert(levels_.begin(), std::move(level));
  }
}

const WideMap::Gaussian* WideMap::nearest(std::size_t level, const Vec3f& p) const {
  const Level& l = levels_[level];
  const Vec3f s = p * l.per_m;
  const int i = fast_floor(s.x());
  const int j = fast_floor(s.y());
  const int k = fast_floor(s.z());
  const int di = s.x() - static_cast<float>(i) < 0.5F ? -1 : 1;
  const int dj = s.y() - static_cast<float>(j) < 0.5F ? -1 : 1;
  const int dk = s.z() - static_cast<float>(k) < 0.5F ? -1 : 1;
  const Gaussian* best = nullptr;
  float best2 = 0.0F;
  for (int n = 0; n < 8; ++n) {
    const std::uint32_t number = l.index.find(pack_voxel(
        i + ((n & 1) != 0 ? di : 0), j + ((n & 2) != 0 ? dj : 0), k + ((n & 4) != 0 ? dk : 0)));
    if (number == VoxelIndex::kNone) continue;
    const float d2 = (l.gaussians[number].mean - p).squaredNorm();
    if (best == nullptr || d2 < best2) {
      best = &l.gaussians[number];
      best2 = d2;
    }
  }
  return best;
}

Points thinned(const Points& in, int wanted) {
  // Odd, so that it does not fall in step with the rows of a sensor.
  const std::size_t stride = (in.size() / static_cast<std::size_t>(wanted)) | 1U;
  Points out;
  out.reserve(in.size() / stride + 1);
  for (std::size_t i = 0; i < in.size(); i += stride) out.push_back(in[i]);
  return out;
}

WideAnswer search_wide(const Points& source_vehicle, const WideMap& map, const Pose& guess,
                       const WideParams& params) {
  const Points source = thinned(source_vehicle, params.points);
  constexpr std::size_t kFinest = WideMap::kVoxel_m.size() - 1;
  WideAnswer best;
  best.T_target_vehicle = guess;
  if (source.empty()) return best;
  best.score = -1.0;
  std::vector<Match> matches;
  int iterations = 0;
  WorkUnits used = 0;
  for (const std::size_t from : {std::size_t{0}, kFinest}) {
    WideAnswer a;
    a.T_target_vehicle = guess;
    for (std::size_t level = from; level <= kFinest; ++level) {
      descend(source, map, level, level == kFinest ? kIterations : params.max_iterations, params,
              &matches, &a);
    }
    const Sums s = sum(source, map, kFinest, a.T_target_vehicle, params.robust, &matches);
    a.score = s.weight / static_cast<double>(source.size());
    used += a.used + static_cast<WorkUnits>(source.size());
    iterations += a.iterations;
    if (a.score > best.score) best = a;
  }
  best.iterations = iterations;
  best.used = used;
  return best;
}

}  // namespace rcs::sp
