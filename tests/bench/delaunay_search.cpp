#include "tests/bench/delaunay_search.h"

#include <libqhull_r/libqhull_r.h>
#include <libqhull_r/qset_r.h>

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <string>
#include <tuple>

#include "rcs/base/check.h"

namespace rcs::bench {
namespace {

// qhull lifts the points to four dimensions and needs more points than a simplex has there. Fewer
// points are all neighbours of each other.
constexpr std::size_t kFew = 6;

// Qbb: scale the lifted coordinate like the others. Qc: report coplanar points. Qz: with a point
// at infinity, for points on one sphere.
constexpr const char* kTriangulated = "qhull d Qt Qbb Qc Qz";
// For points in one plane, which have no triangulation in space: each is moved by about the
// rounding error.
constexpr const char* kJoggled = "qhull d QJ Qbb Qc";

/// In double: a difference of floats is then exact, and no two neighbours appear equally near
/// because of rounding.
double distance2(const Vec3f& a, const Vec3f& b) {
  return (a.cast<double>() - b.cast<double>()).squaredNorm();
}

}  // namespace

DelaunaySearch::DelaunaySearch(const Points& points) {
  RCS_CHECK(!points.empty());
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&points](std::uint32_t i) {
    return std::make_tuple(points.x[i], points.y[i], points.z[i], i);
  };
  std::sort(order.begin(), order.end(), [&place](auto a, auto b) { return place(a) < place(b); });
  const auto same_place = [&points](auto a, auto b) { return points[a] == points[b]; };
  order.erase(std::unique(order.begin(), order.end(), same_place), order.end());
  // Restore the order of the points: neighbours in the scan are neighbours in memory.
  std::sort(order.begin(), order.end());
  index_ = std::move(order);
  at_.reserve(index_.size());
  for (const std::uint32_t i : index_) at_.push_back(points[i]);

  std::vector<Simplex> simplices;
  if (at_.size() <= kFew) {
    Simplex& all = simplices.emplace_back();
    for (std::uint32_t v = 0; v < at_.size(); ++v) all.add(v);
  } else {
    RCS_CHECK(triangulate(kTriangulated, &simplices) || triangulate(kJoggled, &simplices));
  }
  connect(simplices);
}

bool DelaunaySearch::triangulate(const char* options, std::vector<Simplex>* simplices) {
  simplices->clear();
  simplices_ = left_out_ = 0;
  std::vector<coordT> coordinates;
  coordinates.reserve(3 * at_.size());
  for (const Vec3f& p : at_) coordinates.insert(coordinates.end(), {p.x(), p.y(), p.z()});
  // qhull's message about points in one plane is an expected result here and is not printed.
  FILE* const nowhere = std::fopen("/dev/null", "w");
  RCS_CHECK(nowhere != nullptr);
  qhT work;
  qhT* const qh = &work;
  qh_zero(qh, nowhere);
  std::string command = options;
  const bool good = qh_new_qhull(qh, 3, static_cast<int>(at_.size()), coordinates.data(), 0U,
                                 command.data(), nullptr, nowhere) == 0;
  const auto count = static_cast<int>(at_.size());
  const auto add = [&](const pointT* point, Simplex* simplex) {
    const int id = qh_pointid(qh, const_cast<pointT*>(point));
    if (id >= 0 && id < count) simplex->add(static_cast<std::uint32_t>(id));
  };
  const facetT* facet = good ? qh->facet_list : nullptr;
  for (; facet != nullptr && facet->next != nullptr; facet = facet->next) {
    if (facet->upperdelaunay != 0U) continue;
    Simplex corners;
    const vertexT* vertex = nullptr;
    const vertexT** vertexp = nullptr;
    FOREACHsetelement_(const vertexT, facet->vertices, vertex) add(vertex->point, &corners);
    const pointT* point = nullptr;
    const pointT** pointp = nullptr;
    FOREACHsetelement_(const pointT, facet->coplanarset, point) {
      Simplex with = corners;
      add(point, &with);
      left_out_ += with.size > corners.size ? 1 : 0;
      simplices->push_back(with);
    }
    simplices->push_back(corners);
    ++simplices_;
  }
  qh_freeqhull(qh, 0U);
  int blocks = 0;
  int bytes = 0;
  qh_memfreeshort(qh, &blocks, &bytes);
  std::fclose(nowhere);
  return good;
}

void DelaunaySearch::connect(const std::vector<Simplex>& simplices) {
  std::vector<std::uint32_t> end(at_.size() + 1, 0);
  for (const Simplex& s : simplices) {
    for (std::size_t a = 0; a < s.size; ++a) {
      end[s.corners.at(a) + 1] += static_cast<std::uint32_t>(s.size - 1);
    }
  }
  std::partial_sum(end.begin(), end.end(), end.begin());
  first_ = end;
  neighbours_.resize(first_.back());
  for (const Simplex& s : simplices) {
    for (std::size_t a = 0; a < s.size; ++a) {
      for (std::size_t b = 0; b < s.size; ++b) {
        if (a != b) neighbours_[end[s.corners.at(a)]++] = s.corners.at(b);
      }
    }
  }
  // Each neighbour is listed once for every shared simplex.
  std::uint32_t kept = 0;
  for (std::size_t v = 0; v < at_.size(); ++v) {
    const auto begin = neighbours_.begin() + first_[v];
    std::sort(begin, neighbours_.begin() + first_[v + 1]);
    const auto last = std::unique(begin, neighbours_.begin() + first_[v + 1]);
    first_[v] = kept;
    kept = static_cast<std::uint32_t>(std::copy(begin, last, neighbours_.begin() + kept) -
                                      neighbours_.begin());
  }
  first_[at_.size()] = kept;
  neighbours_.resize(kept);
  neighbours_.shrink_to_fit();
}

DelaunaySearch::Closest DelaunaySearch::closest(const Vec3f& p, Walk* walk) const {
  std::uint32_t v = walk->vertex;
  double best = distance2(at_[v], p);
  for (bool moved = true; moved;) {
    moved = false;
    const std::uint32_t from = v;
    for (std::uint32_t k = first_[from]; k < first_[from + 1]; ++k) {
      const double d = distance2(at_[neighbours_[k]], p);
      if (d >= best) continue;
      best = d;
      v = neighbours_[k];
      moved = true;
    }
    walk->steps += moved ? 1 : 0;
    walk->distances += first_[from + 1] - first_[from];
  }
  walk->vertex = v;
  return {index_[v], static_cast<float>(best)};
}

}  // namespace rcs::bench
