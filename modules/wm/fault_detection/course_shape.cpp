#include "modules/wm/fault_detection/course_shape.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/pose.h"

namespace rcs::wm {
namespace {

constexpr Duration kSpacing = from_milliseconds(180.0);
constexpr Duration kGap = from_seconds(1.5);  // begins again after it
constexpr Duration kRateGap = from_seconds(0.1);
constexpr double kSlowest_mps = 2.0;  // at which a velocity has a course
constexpr Duration kWindow = from_seconds(20.0);
constexpr std::size_t kFewest = 40;                // in the window: two fixes a second
constexpr int kBegins = 12;                        // of a fault, tried over the time
constexpr Duration kShortest = from_seconds(3.0);  // growth of a heading error
constexpr double kNoise_mps = 0.02;                // no residual is smaller

/// Residual sum of squares of a linear model by its normal equations.
template <int N>
class LeastSquares {
 public:
  void add(const Vec<N>& row, double value) {
    H_ += row * row.transpose();
    g_ += value * row;
    sum2_ += value * value;
  }
  [[nodiscard]] double residual() const {
    Mat<N, N> H = H_;
    H.diagonal().array() += 1e-6;  // what does not occur stays zero
    return std::max(0.0, sum2_ - g_.dot(H.ldlt().solve(g_)));
  }

 private:
  Mat<N, N> H_ = Mat<N, N>::Zero();
  Vec<N> g_ = Vec<N>::Zero();
  double sum2_ = 0.0;
};

}  // namespace

void CourseShape::turn(Stamp stamp, double heading_radps) {
  const bool first = turned_ == Stamp::min();
  const bool stepped_back = !first && turned_ - stamp > kRateGap;
  if (!first && stamp <= turned_ && !stepped_back) return;
  if (stepped_back || (!first && stamp - turned_ > kRateGap)) count_ = 0;
  if (!first && !stepped_back) {
    heading_rad_ += heading_radps * seconds(std::min(stamp - turned_, kRateGap));
  }
  turned_ = stamp;
}

void CourseShape::add(Stamp stamp, const Vec2& v_fix_mps, double wheels_mps) {
  if (v_fix_mps.norm() < kSlowest_mps || wheels_mps < kSlowest_mps) {
    count_ = 0;
    return;
  }
  Sample now{stamp, std::atan2(v_fix_mps.y(), v_fix_mps.x()), v_fix_mps.norm(), 0.0,
             v_fix_mps.norm() - wheels_mps};
  const double apart_rad = now.course_rad - heading_rad_;
  if (count_ > 0) {
    const Sample& last = sample(count_ - 1);
    if (stamp < last.stamp || stamp - last.stamp > kGap) {
      count_ = 0;
    } else if (stamp - last.stamp < kSpacing) {
      return;
    }
  }
  now.turned_rad = count_ > 0 ? sample(count_ - 1).turned_rad +
                                    wrap_angle(apart_rad - sample(count_ - 1).turned_rad)
                              : apart_rad;
  samples_[count_++ % kSamples] = now;
}

std::size_t CourseShape::in_window() const {
  std::size_t n = 0;
  const Stamp oldest = count_ > 0 ? sample(count_ - 1).stamp - kWindow : Stamp::min();
  while (n < std::min(count_, kSamples) && sample(count_ - 1 - n).stamp >= oldest) ++n;
  return n;
}

template <class F>
double CourseShape::residual_of_angle(const F& angle) const {
  const std::size_t n = in_window();
  const double origin_rad = sample(count_ - n).turned_rad;
  LeastSquares<2> across;
  LeastSquares<1> ahead;
  for (std::size_t k = count_ - n; k < count_; ++k) {
    const Sample& s = sample(k);
    across.add(s.speed_mps * Vec2(1.0, angle(s.stamp)), s.speed_mps * (s.turned_rad - origin_rad));
    ahead.add(Vec<1>(1.0), s.beyond_mps);
  }
  return across.residual() + ahead.residual();
}

double CourseShape::residual_of_turn(Stamp begin, Stamp end) const {
  return residual_of_angle(
      [=](Stamp stamp) { return std::max(0.0, seconds(std::min(stamp, end) - begin)); });
}

double CourseShape::residual_of_turned_fixes(Stamp begin) const {
  return residual_of_angle([=](Stamp stamp) { return stamp > begin ? 1.0 : 0.0; });
}

double CourseShape::residual_of_drift(Stamp begin) const {
  const std::size_t n = in_window();
  const double origin_rad = sample(count_ - n).turned_rad;
  LeastSquares<4> drift;  // error of the heading and of the scale of the wheels before, velocity
  for (std::size_t k = count_ - n; k < count_; ++k) {
    const Sample& s = sample(k);
    const double drifts = s.stamp > begin ? 1.0 : 0.0;
    const double sine = drifts * std::sin(s.course_rad);
    const double cosine = drifts * std::cos(s.course_rad);
    drift.add(Vec<4>(s.speed_mps, 0.0, -sine, cosine), s.speed_mps * (s.turned_rad - origin_rad));
    drift.add(Vec<4>(0.0, 1.0, cosine, sine), s.beyond_mps);
  }
  return drift.residual();
}

std::optional<double> CourseShape::gyro_against_fixes() const {
  const std::size_t n = in_window();
  if (n < kFewest) return std::nullopt;
  const Stamp first = sample(count_ - n).stamp;
  const Stamp last = sample(count_ - 1).stamp;
  const Duration step = (last - first) / kBegins;
  double turn = std::numeric_limits<double>::max();
  double drift = turn;
  for (int k = 0; k < kBegins; ++k) {
    const Stamp begin = first + k * step;
    for (int j = k + 1; j <= kBegins; ++j) {
      const Stamp end = j == kBegins ? last : first + j * step;
      if (end - begin >= kShortest) turn = std::min(turn, residual_of_turn(begin, end));
    }
    drift = std::min({drift, residual_of_drift(begin), residual_of_turned_fixes(begin)});
  }
  const double floor = 2.0 * static_cast<double>(n) * kNoise_mps * kNoise_mps;
  return static_cast<double>(n) * std::log((drift + floor) / (turn + floor));
}

}  // namespace rcs::wm
