#pragma once
// Point sets, stored by component: kernels read each coordinate as one stream.

#include <cstddef>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs {

/// Points [m] in the frame that ends the variable's name. float resolves 4 um at 60 m.
struct Points {
  std::vector<float> x, y, z;

  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] bool empty() const { return x.empty(); }
  [[nodiscard]] Vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }

  void clear() {
    x.clear();
    y.clear();
    z.clear();
  }
  void reserve(std::size_t n) {
    x.reserve(n);
    y.reserve(n);
    z.reserve(n);
  }
  void resize(std::size_t n) {
    x.resize(n);
    y.resize(n);
    z.resize(n);
  }
  void push_back(const Vec3f& p) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
  }
};

}  // namespace rcs
