#include "modules/registration/prepared_cloud.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "modules/registration/voxel_sampler.h"

namespace rcs::registration {
namespace {

// Smallest cosine between up() and a normal of the ground, at first and finally: the mean of a wide
// cone leans towards slopes and kerbs.
constexpr float kWideCone = 0.9F;
constexpr std::array<float, 2> kNarrowCones = {0.97F, 0.99F};
// Least |z| of the normal of the ground: the sensor is tilted by less than 40 deg. A wall is no
// ground, however many returns it has.
constexpr float kUpright = 0.77F;
constexpr int kFewestOfGround = 20;  // points
constexpr float kRarest = 0.1F;      // mean squared cosine of a normal to the others
constexpr float kNotStructure = 0.9F;
constexpr std::size_t kGroundPoints = 300;  // of a cloud that are kept
constexpr double kGroundVoxel_m = 0.5;      // spread: a roof nearby has most of the returns
constexpr std::size_t kNearest = 75;        // of these, which give the height of the ground
// Of these the share below the ground is 1 / kLowShare, not half: roofs are level, too.
constexpr std::ptrdiff_t kLowShare = 3;
constexpr float kOnSurface_m = 0.3F;  // distance of a point to its own surface
constexpr std::size_t kFewest = 50;   // structure points

RollingMap map_of(const Points& model, RollingMapParams params) {
  const auto most = std::max(1000, static_cast<int>(model.size()));
  // Dense scans have many points in a voxel, and tables that are too large cost time.
  constexpr int kDense = 20'000;
  params.capacity = most > kDense ? most / 4 : most;
  RollingMap map(params);
  map.insert(model, Pose{});
  if (!map.full() || params.capacity == most) return map;
  params.capacity = most;
  RollingMap larger(params);
  larger.insert(model, Pose{});
  return larger;
}

/// Normals of the surfaces on which the points lie; zero: none.
std::vector<Vec3f> normals_of(const Points& points, RollingMap* map) {
  std::vector<Vec3f> normals(points.size(), Vec3f::Zero());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Surface s{};
    if (!map->nearest_surface(points[i], &s)) continue;
    if (std::abs(s.normal.dot(points[i] - s.mean)) < kOnSurface_m) normals[i] = s.normal;
  }
  return normals;
}

/// Normals within the cone about `up`, and their mean as the new `up`.
int follow(const std::vector<Vec3f>& normals, float least, Vec3f* up) {
  Vec3f sum = Vec3f::Zero();
  int count = 0;
  for (const Vec3f& n : normals) {
    const float cosine = n.dot(*up);
    if (std::abs(cosine) <= least) continue;
    sum += cosine > 0.0F ? n : Vec3f(-n);
    ++count;
  }
  if (count > 0) *up = sum.normalized();
  return count;
}

/// Of the frequent normals the one that is nearest to the z axis; zero: none is upright.
Vec3f normal_of_ground(const std::vector<Vec3f>& normals) {
  Mat3f scatter = Mat3f::Zero();
  for (const Vec3f& n : normals) scatter += n * n.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3f> axes(scatter);
  std::array<Vec3f, 4> modes;  // between as many walls as ground the axes point to neither
  std::array<int, modes.size()> counts{};
  for (std::size_t k = 0; k < modes.size(); ++k) {
    modes[k] = k == 3 ? Vec3f(Vec3f::UnitZ())
                      : Vec3f(axes.eigenvectors().col(static_cast<Eigen::Index>(k)));
    for (int pass = 0; pass < 3; ++pass) counts[k] = follow(normals, kWideCone, &modes[k]);
  }
  int most = 0;
  const auto upright = [&](std::size_t k) { return std::abs(modes[k].z()) >= kUpright; };
  for (std::size_t k = 0; k < modes.size(); ++k) {
    if (upright(k)) most = std::max(most, counts[k]);
  }
  if (most < kFewestOfGround) return Vec3f::Zero();
  Vec3f up = Vec3f::Zero();
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const bool frequent = upright(k) && 2 * counts[k] >= most;
    if (frequent && std::abs(modes[k].z()) >= std::abs(up.z())) up = modes[k];
  }
  for (const float least : kNarrowCones) follow(normals, least, &up);
  return up.z() < 0.0F ? Vec3f(-up) : up;
}

/// Weights of points with these normals (zero: none); their sum is 1. In a street most normals
/// point across it; along it a few surfaces decide, which must not be outweighed by the others.
std::vector<float> weights_of(const std::vector<Vec3f>& normals) {
  Mat3f scatter = Mat3f::Zero();
  int count = 0;
  for (const Vec3f& n : normals) {
    scatter += n * n.transpose();
    count += n.isZero() ? 0 : 1;
  }
  if (count > 0) scatter /= static_cast<float>(count);
  std::vector<float> weights;
  weights.reserve(normals.size());
  float sum = 0.0F;
  for (const Vec3f& n : normals) {
    const float alike = n.isZero() ? 1.0F / 3.0F : n.dot(scatter * n);
    weights.push_back(1.0F / std::max(alike, kRarest));
    sum += weights.back();
  }
  for (float& w : weights) w /= sum;
  return weights;
}

/// Weighted shares of `points` that are on a surface of the other cloud, and where its scan saw
/// through.
Plausibility shares(const Points& points, const std::vector<float>& weights, const Pose& T,
                    RollingMap* map, const RangeView& view, float tolerance_m) {
  Plausibility out;
  const Mat3f R = T.rotation().cast<float>();
  const Vec3f t = T.p.cast<float>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f q = R * points[i] + t;
    Surface s{};
    if (map->nearest_surface(q, &s) && std::abs(s.normal.dot(q - s.mean)) < tolerance_m) {
      out.explained += double{weights[i]};
    } else if (view.passed_through(q)) {
      out.contradicted += double{weights[i]};
    }
  }
  return out;
}

}  // namespace

PreparedCloudParams::PreparedCloudParams() {
  // One scan is the whole model: few points must suffice.
  map.min_points = 4;
  map.max_thickness = 0.3;
  map.min_extent = 0.05;
  map.radius_m = 500.0;
}

PreparedCloud::PreparedCloud(const Points& points, const PreparedCloudParams& params)
    : PreparedCloud(params, points.size() > static_cast<std::size_t>(params.dense_points)
                                ? thinned(points, static_cast<int>(points.size() / 3))
                                : points) {}

PreparedCloud::PreparedCloud(const PreparedCloudParams& params, const Points& used)
    : map_(map_of(used, params.map)), view_(used) {
  Points examined = thinned(used, params.points);
  const std::vector<Vec3f> normals = normals_of(examined, &map_);
  const Vec3f normal = normal_of_ground(normals);
  if (!normal.isZero()) up_ = normal;
  Points ground;
  structure_.reserve(examined.size());
  for (std::size_t i = 0; i < examined.size(); ++i) {
    const Vec3f p = examined[i];
    if (std::abs(normals[i].dot(up_)) <= kNotStructure) {
      structure_.push_back(p);
    } else {
      ground.push_back(p);
    }
  }
  if (normal.isZero()) ground.clear();
  VoxelSampler().sample(ground, kGroundVoxel_m, &ground_);
  keep_evenly(kGroundPoints, &ground_);
  if (structure_.size() < kFewest) structure_ = std::move(examined);
  // Spread in space: a near vehicle that moves along has most of the points in some streets.
  VoxelSampler().sample(structure_, params.test_voxel_m, &test_points_);
  keep_evenly(static_cast<std::size_t>(params.test_points), &test_points_);
  weights_ = weights_of(normals_of(test_points_, &map_));
}

float PreparedCloud::ground_m(const Vec3f& p) const {
  if (ground_.empty()) return 0.0F;
  std::vector<std::pair<float, float>> by_distance;  // squared horizontal distance, height
  by_distance.reserve(ground_.size());
  for (std::size_t i = 0; i < ground_.size(); ++i) {
    const Vec3f d = ground_[i] - p;
    const float along = d.dot(up_);
    by_distance.emplace_back(d.squaredNorm() - along * along, up_.dot(ground_[i]));
  }
  const auto nearest = static_cast<std::ptrdiff_t>(std::min(kNearest, by_distance.size()));
  std::nth_element(by_distance.begin(), by_distance.begin() + (nearest - 1), by_distance.end());
  const auto low = by_distance.begin() + nearest / kLowShare;
  std::nth_element(by_distance.begin(), low, by_distance.begin() + nearest,
                   [](const auto& a, const auto& b) { return a.second < b.second; });
  return low->second;
}

Plausibility plausibility(PreparedCloud* model, PreparedCloud* data, const Pose& T_model_data,
                          double tolerance_m) {
  const auto tolerance = static_cast<float>(tolerance_m);
  const Plausibility there = shares(data->test_points(), data->weights(), T_model_data,
                                    model->map(), model->view(), tolerance);
  const Plausibility back = shares(model->test_points(), model->weights(), T_model_data.inverse(),
                                   data->map(), data->view(), tolerance);
  return {0.5 * (there.explained + back.explained), 0.5 * (there.contradicted + back.contradicted)};
}

Pose on_common_ground(const PreparedCloud& model, const PreparedCloud& data, const Pose& guess) {
  const Vec3 up_model = model.up().cast<double>();
  const Vec3 up_data = guess.q * data.up().cast<double>();
  if (!model.has_ground() || !data.has_ground()) return guess;
  const Quat q = (Quat::FromTwoVectors(up_data, up_model) * guess.q).normalized();
  const double ground_m = data.ground_m(Vec3f::Zero());
  const double height_m = double{model.ground_m(guess.p.cast<float>())} - ground_m;
  return {q, guess.p + (height_m - up_model.dot(guess.p)) * up_model};
}

}  // namespace rcs::registration
