// Three searches for the closest point must give the same result: brute force, the kd-tree that the
// product uses, and the paper's Delaunay triangulation. A benchmark of searches with different
// results would be meaningless.

#include "tests/bench/delaunay_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "rcs/base/kd_tree.h"
#include "tests/support/point_scenes.h"

namespace rcs::bench {
namespace {

using test::Ground;
using test::scene;

double distance2(const Points& points, std::uint32_t i, const Vec3f& p) {
  return (points[i].cast<double>() - p.cast<double>()).squaredNorm();
}

double brute2(const Points& points, const Vec3f& p) {
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < points.size(); ++i) best = std::min(best, distance2(points, i, p));
  return best;
}

/// Equally near points count as the same result: in a tie any of them is correct.
void expect_the_same(const Points& model, const Points& queries) {
  const KdTree tree(model);
  const DelaunaySearch delaunay(model);
  DelaunaySearch::Walk walk;
  int wrong_tree = 0;
  int wrong_delaunay = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const Vec3f q = queries[i];
    const double best = brute2(model, q);
    // nanoflann adds in float: seven digits.
    const double slack = 4.0 * std::numeric_limits<float>::epsilon() * best;
    wrong_tree += distance2(model, tree.closest(q).index, q) > best + slack ? 1 : 0;
    const DelaunaySearch::Closest c = delaunay.closest(q, &walk);
    wrong_delaunay += distance2(model, c.index, q) > best * (1.0 + 1e-12) ? 1 : 0;
    ASSERT_FLOAT_EQ(c.distance2_m2, static_cast<float>(distance2(model, c.index, q)));
  }
  EXPECT_EQ(wrong_tree, 0) << "of " << queries.size();
  EXPECT_EQ(wrong_delaunay, 0) << "of " << queries.size()
                               << "; left out of the triangulation: " << delaunay.left_out();
}

/// Queries near the model, far from it, and the points of the model.
Points queries_for(const Points& model, std::mt19937* rng) {
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma_m) {
    const double x = sigma_m * normal(*rng);
    const double y = sigma_m * normal(*rng);
    return Vec3(x, y, sigma_m * normal(*rng));
  };
  Points queries;
  for (std::size_t i = 0; i < model.size(); i += 1 + model.size() / 300) {
    queries.push_back(model[i]);
    queries.push_back(model[i] + draw(0.1).cast<float>());
    queries.push_back(model[i] + draw(3.0).cast<float>());
    queries.push_back(draw(200.0).cast<float>());
  }
  return queries;
}

TEST(ClosestPoints, ThreeSearchesAgree) {
  std::mt19937 rng(1);
  for (const Ground ground : {Ground::kRolling, Ground::kFlat}) {
    const Points model = scene(ground, true, 2000, 0.02, Vec3::Zero(), &rng);
    expect_the_same(model, queries_for(model, &rng));
  }
}

TEST(ClosestPoints, ThreeSearchesAgreeOnCoincidentPoints) {
  std::mt19937 rng(2);
  Points model = scene(Ground::kRolling, true, 1000, 0.02, Vec3::Zero(), &rng);
  for (std::size_t i = 0; i < 1000; ++i) model.push_back(model[i / 2]);
  expect_the_same(model, queries_for(model, &rng));
  Points same;
  for (int i = 0; i < 10; ++i) same.push_back(Vec3f(1.0F, 2.0F, 3.0F));
  expect_the_same(same, queries_for(same, &rng));
}

// Eight corners of each cube lie on a sphere, and a query in its middle has eight correct results.
TEST(ClosestPoints, ThreeSearchesAgreeOnAGrid) {
  Points grid;
  for (int i = 0; i < 2197; ++i) {
    grid.push_back(Eigen::Vector3i(i % 13, i / 13 % 13, i / 169).cast<float>());
  }
  std::mt19937 rng(3);
  Points queries = queries_for(grid, &rng);
  for (int i = 0; i < 500; ++i) {
    queries.push_back(0.5F * Eigen::Vector3i(i % 10, i / 10 % 10, i / 50).cast<float>());
  }
  expect_the_same(grid, queries);
}

TEST(ClosestPoints, ThreeSearchesAgreeOnAPlaneALineAndASphere) {
  std::mt19937 rng(4);
  const Points plane = scene(Ground::kFlat, false, 2000, 0.0, Vec3::Zero(), &rng);
  expect_the_same(plane, queries_for(plane, &rng));
  Points line;
  for (int i = 0; i < 500; ++i) line.push_back(static_cast<float>(i) * Vec3f(0.1F, 0.2F, 0.0F));
  expect_the_same(line, queries_for(line, &rng));
  Points sphere;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    sphere.push_back((Vec3f(0.0F, 0.0F, 5.0F) + plane[i]).normalized() * 20.0F);
  }
  expect_the_same(sphere, queries_for(sphere, &rng));
}

TEST(ClosestPoints, ThreeSearchesAgreeOnAFewPoints) {
  std::mt19937 rng(5);
  Points few;
  for (int n = 0; n < 12; ++n) {
    few.push_back(scene(Ground::kRolling, false, 1, 0.0, Vec3::Zero(), &rng)[0]);
    expect_the_same(few, queries_for(few, &rng));
  }
}

}  // namespace
}  // namespace rcs::bench
