#include "modules/registration/madhavan_messina_icp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "modules/registration/rigid_motion.h"
#include "rcs/base/kd_tree.h"

namespace rcs::registration {
namespace {

constexpr double kFirstDmax = 20.0;  // in D (Zhang)
constexpr std::size_t kCycle = 8;    // remembered poses
constexpr double kSame_m = 1e-9;     // a recurring pose, within rounding
constexpr double kFar = 1e3;         // in extents of the model and data

struct Statistics {
  double mu_m = 0.0;
  double sigma_m = 0.0;
};

Statistics statistics(const std::vector<float>& distances, double max_m) {
  double n = 0.0;
  double sum = 0.0;
  for (const float d : distances) {
    if (d > max_m) continue;
    n += 1.0;
    sum += d;
  }
  if (n == 0.0) return {};
  const double mu = sum / n;
  double square = 0.0;
  for (const float d : distances) {
    if (d <= max_m) square += (d - mu) * (d - mu);
  }
  return {mu, std::sqrt(square / n)};
}

double extent(const Points& points) {
  double most = 1.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    most = std::max<double>(most, points[i].cwiseAbs().maxCoeff());
  }
  return most;
}

class Registering {
 public:
  Registering(const Points& model, const Points& data, const PaperParams& params)
      : data_(data), model_(model), params_(params), tree_(model), pairs_(data.size()) {}

  /// Step 1 of the paper, at a pose.
  void find_closest(const Pose& T, std::vector<float>* distances) {
    const Mat3 R = T.rotation();
    distances->resize(data_.size());
    for (std::size_t i = 0; i < data_.size(); ++i) {
      const Vec3f p = (R * data_[i].cast<double>() + T.p).cast<float>();
      const KdTree::Closest c = tree_.closest(p);
      pairs_[i] = c.index;
      (*distances)[i] = std::sqrt(c.distance2_m2);
    }
  }

  /// The pseudo-code: D_max from the distances.
  void set_threshold(const std::vector<float>& distances, double D, PaperIteration* it) {
    const double counted_m = params_.gated_statistics ? d_max_m_ : 1e30;
    const auto [mu, sigma] = statistics(distances, counted_m);
    it->mu_m = mu;
    it->sigma_m = sigma;
    if (mu < D) {
      it->branch = PaperBranch::kMu3Sigma;
      d_max_m_ = mu + 3.0 * sigma;
    } else if (mu < 3.0 * D) {
      it->branch = PaperBranch::kMu2Sigma;
      d_max_m_ = mu + 2.0 * sigma;
    } else if (mu < 6.0 * D) {
      it->branch = PaperBranch::kMuSigma;
      d_max_m_ = mu + sigma;
    } else {
      it->branch = PaperBranch::kValley;
      d_max_m_ = histogram_valley(distances, D, params_.gated_statistics ? d_max_m_ : 1e30);
    }
    it->d_max_m = d_max_m_;
  }

  /// Step 2: sums over the pairs, p to q.
  PointPairMoments pair_sums(const Pose& T, const std::vector<float>& distances,
                             PaperIteration* it) const {
    PointPairMoments sums;
    double near = 0.0;
    const Mat3 R = T.rotation();
    for (std::size_t i = 0; i < data_.size(); ++i) {
      const bool accepted = distances[i] <= d_max_m_;
      it->pairs += accepted ? 1 : 0;
      near += accepted ? distances[i] : 0.0;
      if (!accepted && params_.accepted_only) continue;
      const Vec3 at_data = R * data_[i].cast<double>() + T.p;
      const Vec3 at_model = model_[pairs_[i]].cast<double>();
      if (params_.data_to_model) {
        sums.add(at_data, at_model);
      } else {
        sums.add(at_model, at_data);
      }
    }
    it->mean_distance_m = it->pairs > 0 ? near / it->pairs : 0.0;
    return sums;
  }

  void start(double d_max_m) { d_max_m_ = d_max_m; }
  [[nodiscard]] double d_max_m() const { return d_max_m_; }
  [[nodiscard]] const std::vector<std::uint32_t>& pairs() const { return pairs_; }

 private:
  const Points& data_;
  const Points& model_;
  const PaperParams& params_;
  KdTree tree_;
  std::vector<std::uint32_t> pairs_;  // the closest model point of each data point
  double d_max_m_ = 0.0;
};

bool same_pose(const Pose& a, const Pose& b) {
  return (a.p - b.p).norm() < kSame_m && log_so3(a.q.conjugate() * b.q).norm() < kSame_m;
}

}  // namespace

std::string_view name_of(PaperBranch branch) {
  constexpr std::array<std::string_view, 4> kNames = {"mu + 3 sigma", "mu + 2 sigma", "mu + sigma",
                                                      "valley"};
  return kNames[static_cast<std::size_t>(branch)];
}

std::string_view name_of(PaperStop stop) {
  constexpr std::array<std::string_view, 8> kNames = {
      "relative change", "mean distance", "max iterations", "limit cycle",
      "too few",         "degenerate",    "diverged",       "empty"};
  return kNames[static_cast<std::size_t>(stop)];
}

double measured_spacing(const Points& points) {
  constexpr std::size_t kMax = 1000;
  if (points.size() < 2) return 0.0;
  const KdTree tree(points);
  const std::size_t step = std::max<std::size_t>(1, points.size() / kMax);
  std::vector<float> distances;
  for (std::size_t i = 0; i < points.size(); i += step) {
    distances.push_back(std::sqrt(tree.closest_other(points[i]).distance2_m2));
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

double histogram_valley(const std::vector<float>& distances_m, double bin_m, double max_m) {
  constexpr std::size_t kBins = 4096;
  constexpr double kValley = 0.6;  // of the peak
  std::vector<int> bins;
  for (const float d : distances_m) {
    if (!(d <= max_m)) continue;
    const auto bin = std::min(kBins - 1, static_cast<std::size_t>(d / bin_m));
    if (bin >= bins.size()) bins.resize(bin + 1);
    ++bins[bin];
  }
  const auto peak = std::max_element(bins.begin(), bins.end());
  auto valley = peak;
  while (valley != bins.end() && *valley >= kValley * *peak) ++valley;
  const double edge_m = bin_m * static_cast<double>(valley - bins.begin());
  return std::min(std::max(edge_m, bin_m), max_m);
}

PaperResult register_as_in_paper(const Points& model, const Points& data, const Pose& guess,
                                 const PaperParams& params) {
  PaperResult out;
  out.T_model_data = guess;
  if (model.empty() || data.empty()) return out;
  out.spacing_m = params.spacing_m > 0.0 ? params.spacing_m : measured_spacing(model);
  // All points of the model coincide: any distance is as good.
  const double D = out.spacing_m > 0.0 ? out.spacing_m : 1e-3;
  const double far_m = kFar * (extent(model) + extent(data));

  Registering work(model, data, params);
  work.start(kFirstDmax * D);
  std::vector<float> distances;
  work.find_closest(guess, &distances);
  out.distance_before_m = distances;
  Pose& T = out.T_model_data;
  std::deque<Pose> earlier = {guess};
  out.stop = PaperStop::kMaxIterations;
  while (static_cast<int>(out.history.size()) < params.max_iterations) {
    PaperIteration& it = out.history.emplace_back();
    work.set_threshold(distances, D, &it);
    const PointPairMoments sums = work.pair_sums(T, distances, &it);
    if (it.pairs < 3) {
      out.stop = PaperStop::kTooFew;
      break;
    }
    if (params.mean_distance_m > 0.0 && it.mean_distance_m <= params.mean_distance_m) {
      out.stop = PaperStop::kMeanDistance;
      break;
    }
    const RigidMotion motion = params.solver == MotionSolver::kSvd
                                   ? motion_by_svd(sums, params.guard_reflection)
                                   : motion_by_quaternion(sums);
    if (motion.degenerate) {
      out.stop = PaperStop::kDegenerate;
      break;
    }
    // A reflection is not a rigid motion; applied as printed it would mirror the scan.
    if (motion.reflection || !motion.T.allFinite() || motion.T.norm() > far_m) {
      out.stop = PaperStop::kDiverged;
      break;
    }
    const Pose increment{Quat(motion.R).normalized(), motion.T};
    T = increment * T;
    it.moved_m = motion.T.norm();
    it.turned_rad = log_so3(increment.q).norm();
    work.find_closest(T, &distances);

    const Pose all = T * guess.inverse();
    const double small_m = std::max(params.min_move_m, params.relative_change * all.p.norm());
    const double small_rad =
        std::max(params.min_turn_rad, params.relative_change * log_so3(all.q).norm());
    if (params.relative_change > 0.0 && it.moved_m <= small_m && it.turned_rad <= small_rad) {
      out.stop = PaperStop::kRelativeChange;
      break;
    }
    const auto came_back = [&T](const Pose& before) { return same_pose(before, T); };
    if (params.detect_cycles && std::any_of(earlier.begin(), earlier.end(), came_back)) {
      out.stop = PaperStop::kLimitCycle;
      break;
    }
    earlier.push_back(T);
    if (earlier.size() > kCycle) earlier.pop_front();
  }

  out.closest = work.pairs();
  out.d_max_m = work.d_max_m();
  double near = 0.0;
  for (const float d : distances) {
    if (d > out.d_max_m) continue;
    ++out.pairs;
    near += d;
  }
  out.mean_distance_m = out.pairs > 0 ? near / out.pairs : 0.0;
  out.distance_after_m = std::move(distances);
  return out;
}

}  // namespace rcs::registration
