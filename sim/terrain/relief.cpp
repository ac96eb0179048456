#include "sim/terrain/relief.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/base/hash.h"

namespace rcs::sim {
namespace {

// Mean over a lattice cell of the sum of the squared four weights: the variance of the spline for
// unit white noise, in one dimension. In two dimensions it is the square.
constexpr double kSplineVariance = 151.0 / 315.0;

std::array<double, 4> spline_weights(double u) {
  const double v = 1.0 - u;
  const double u2 = u * u;
  return {v * v * v / 6.0, (3.0 * u2 * u - 6.0 * u2 + 4.0) / 6.0,
          (-3.0 * u2 * u + 3.0 * u2 + 3.0 * u + 1.0) / 6.0, u2 * u / 6.0};
}

// Zero mean, unit variance.
double lattice_value(std::uint64_t seed, int i, int j) {
  constexpr double kSqrt12 = 3.4641016151377544;
  return (to_unit(hash_cell(seed, i, j)) - 0.5) * kSqrt12;
}

std::uint64_t octave_seed(std::uint64_t seed, std::size_t octave) {
  return mix(seed + 0x51ED2701ULL * (octave + 1));
}

double spline_noise(std::uint64_t seed, double u, double v) {
  const double fu = std::floor(u);
  const double fv = std::floor(v);
  const std::array<double, 4> wx = spline_weights(u - fu);
  const std::array<double, 4> wy = spline_weights(v - fv);
  double sum = 0.0;
  for (int b = 0; b < 4; ++b) {
    double row = 0.0;
    for (int a = 0; a < 4; ++a) {
      row += wx[static_cast<std::size_t>(a)] *
             lattice_value(seed, static_cast<int>(fu) - 1 + a, static_cast<int>(fv) - 1 + b);
    }
    sum += wy[static_cast<std::size_t>(b)] * row;
  }
  return sum / kSplineVariance;
}

double catmull_rom(double p0, double p1, double p2, double p3, double u) {
  return p1 + 0.5 * u *
                  ((p2 - p0) +
                   u * ((2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) + u * (3.0 * (p1 - p2) + p3 - p0)));
}

// One octave along a line of samples, prepared once for all rows. Samples between the same two
// lattice points are a run: they share the four lattice values.
struct AxisWeights {
  std::array<std::vector<float>, 4> w;  // of each sample
  std::vector<int> run_end;             // one past the last sample of run k
  std::vector<int> first;               // index of the first of the four lattice columns, by run
  int low = 0;                          // lattice coordinate of column 0
  int count = 0;                        // columns

  AxisWeights(std::int64_t i0, double step_m, int n, double spacing_m) {
    low = static_cast<int>(std::floor(static_cast<double>(i0) * step_m / spacing_m)) - 1;
    for (int i = 0; i < n; ++i) {
      const double u = static_cast<double>(i0 + i) * step_m / spacing_m;
      const double fu = std::floor(u);
      const std::array<double, 4> weights = spline_weights(u - fu);
      for (std::size_t k = 0; k < 4; ++k) w[k].push_back(static_cast<float>(weights[k]));
      const int column = static_cast<int>(fu) - 1 - low;
      if (first.empty() || first.back() != column) {
        first.push_back(column);
        run_end.push_back(i);
      }
      run_end.back() = i + 1;
    }
    count = first.back() + 4;
  }
  [[nodiscard]] int size() const { return run_end.back(); }
};

void add_row(const AxisWeights& x, const std::vector<float>& row, float* z) {
  std::size_t i = 0;
  for (std::size_t run = 0; run < x.first.size(); ++run) {
    const float* four = row.data() + x.first[run];
    const float a = four[0];
    const float b = four[1];
    const float c = four[2];
    const float d = four[3];
    const std::size_t end = static_cast<std::size_t>(x.run_end[run]);
    const float* w0 = x.w[0].data();
    const float* w1 = x.w[1].data();
    const float* w2 = x.w[2].data();
    const float* w3 = x.w[3].data();
    for (; i < end; ++i) z[i] += w0[i] * a + w1[i] * b + w2[i] * c + w3[i] * d;
  }
}

void add_noise(std::uint64_t seed, float amplitude, const AxisWeights& x, const AxisWeights& y,
               float* z) {
  const std::size_t columns = static_cast<std::size_t>(x.count);
  std::vector<float> lattice;
  lattice.reserve(columns * static_cast<std::size_t>(y.count));
  for (int j = 0; j < y.count; ++j) {
    for (int i = 0; i < x.count; ++i) {
      lattice.push_back(amplitude * static_cast<float>(lattice_value(seed, x.low + i, y.low + j)));
    }
  }
  std::vector<float> row(columns);
  int j = 0;
  for (std::size_t run_y = 0; run_y < y.first.size(); ++run_y) {
    const float* south = lattice.data() + static_cast<std::size_t>(y.first[run_y]) * columns;
    for (; j < y.run_end[run_y]; ++j, z += x.size()) {
      const std::size_t at = static_cast<std::size_t>(j);
      for (std::size_t k = 0; k < columns; ++k) {
        row[k] = y.w[0][at] * south[k] + y.w[1][at] * south[k + columns] +
                 y.w[2][at] * south[k + 2 * columns] + y.w[3][at] * south[k + 3 * columns];
      }
      add_row(x, row, z);
    }
  }
}

}  // namespace

Relief::Relief(std::uint64_t seed, std::vector<Octave> octaves, Dem dem,
               std::vector<Feature> features, std::vector<Road> roads)
    : seed_(seed),
      octaves_(std::move(octaves)),
      dem_(std::move(dem)),
      features_(std::move(features)),
      roads_(std::move(roads)) {
  if (dem_.width == 0) return;
  double sum = 0.0;
  for (const float z : dem_.z_m) sum += z;
  const float mean = static_cast<float>(sum / static_cast<double>(dem_.z_m.size()));
  for (float& z : dem_.z_m) z -= mean;
}

double Relief::height(double x_m, double y_m) const {
  double z = dem_height(x_m, y_m);
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    double share = 1.0;
    for (const Road& road : roads_) {
      if (octaves_[k].spacing_m >= road.finest_m) continue;
      share = std::min(share, relief_share(road, x_m, y_m));
    }
    z += share * octave_height(k, x_m, y_m);
  }
  return features_.empty() ? z : z + feature_height(features_, x_m, y_m);
}

void Relief::fill(std::int64_t i0, std::int64_t j0, double step_m, int width, int height,
                  std::vector<float>* z_m) const {
  z_m->assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.0F);
  if (dem_.width > 0) {
    std::size_t at = 0;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i, ++at) {
        (*z_m)[at] = static_cast<float>(
            dem_height(static_cast<double>(i0 + i) * step_m, static_cast<double>(j0 + j) * step_m));
      }
    }
  }
  const std::vector<std::vector<float>> shares = road_shares(i0, j0, step_m, width, height);
  std::vector<float> octave;
  for (std::size_t k = 0; k < octaves_.size(); ++k) {
    bool everywhere = true;
    for (std::size_t r = 0; r < roads_.size(); ++r) {
      everywhere = everywhere && (octaves_[k].spacing_m >= roads_[r].finest_m || shares[r].empty());
    }
    if (everywhere) {
      add_octave(k, i0, j0, step_m, width, height, z_m);
      continue;
    }
    octave.assign(z_m->size(), 0.0F);
    add_octave(k, i0, j0, step_m, width, height, &octave);
    for (std::size_t at = 0; at < octave.size(); ++at) {
      float share = 1.0F;
      for (std::size_t r = 0; r < roads_.size(); ++r) {
        if (octaves_[k].spacing_m >= roads_[r].finest_m || shares[r].empty()) continue;
        share = std::min(share, shares[r][at]);
      }
      (*z_m)[at] += share * octave[at];
    }
  }
  if (features_.empty()) return;
  std::size_t at = 0;
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i, ++at) {
      (*z_m)[at] += static_cast<float>(feature_height(
          features_, static_cast<double>(i0 + i) * step_m, static_cast<double>(j0 + j) * step_m));
    }
  }
}

std::vector<std::vector<float>> Relief::road_shares(std::int64_t i0, std::int64_t j0, double step_m,
                                                    int width, int height) const {
  std::vector<std::vector<float>> out;
  for (const Road& road : roads_) {
    std::vector<float> shares;
    bool touched = false;
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        shares.push_back(static_cast<float>(relief_share(road, static_cast<double>(i0 + i) * step_m,
                                                         static_cast<double>(j0 + j) * step_m)));
        touched = touched || shares.back() < 1.0F;
      }
    }
    if (!touched) shares.clear();
    out.push_back(std::move(shares));
  }
  return out;
}

void Relief::add_octave(std::size_t octave, std::int64_t i0, std::int64_t j0, double step_m,
                        int width, int height, std::vector<float>* z_m) const {
  const Octave& o = octaves_[octave];
  add_noise(octave_seed(seed_, octave), static_cast<float>(o.rms_m / kSplineVariance),
            AxisWeights(i0, step_m, width, o.spacing_m),
            AxisWeights(j0, step_m, height, o.spacing_m), z_m->data());
}

double Relief::octave_height(std::size_t octave, double x_m, double y_m) const {
  const Octave& o = octaves_[octave];
  return o.rms_m * spline_noise(octave_seed(seed_, octave), x_m / o.spacing_m, y_m / o.spacing_m);
}

double Relief::field(std::uint64_t seed, double spacing_m, double x_m, double y_m) {
  return spline_noise(seed, x_m / spacing_m, y_m / spacing_m);
}

void Relief::fill_field(std::uint64_t seed, double spacing_m, std::int64_t i0, std::int64_t j0,
                        double step_m, int side, std::vector<float>* values) {
  values->assign(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0F);
  add_noise(seed, static_cast<float>(1.0 / kSplineVariance),
            AxisWeights(i0, step_m, side, spacing_m), AxisWeights(j0, step_m, side, spacing_m),
            values->data());
}

double Relief::dem_height(double x_m, double y_m) const {
  if (dem_.width == 0) return 0.0;
  const double u = x_m / dem_.cell_x_m + 0.5 * (dem_.width - 1);
  const double v = y_m / dem_.cell_y_m + 0.5 * (dem_.height - 1);
  const int i = static_cast<int>(std::floor(u));
  const int j = static_cast<int>(std::floor(v));
  // A DEM continues level beyond its border.
  const auto z = [this](int a, int b) {
    const std::size_t column = static_cast<std::size_t>(std::clamp(a, 0, dem_.width - 1));
    const std::size_t row = static_cast<std::size_t>(std::clamp(b, 0, dem_.height - 1));
    return static_cast<double>(dem_.z_m[row * static_cast<std::size_t>(dem_.width) + column]);
  };
  std::array<double, 4> rows{};
  for (int b = 0; b < 4; ++b) {
    rows[static_cast<std::size_t>(b)] = catmull_rom(
        z(i - 1, j - 1 + b), z(i, j - 1 + b), z(i + 1, j - 1 + b), z(i + 2, j - 1 + b), u - i);
  }
  return catmull_rom(rows[0], rows[1], rows[2], rows[3], v - j);
}

}  // namespace rcs::sim
