#pragma once
// Entries of the inverse of a sparse matrix in the pattern of its Cholesky factor (Takahashi 1973).

#include <Eigen/SparseCore>
#include <cstddef>
#include <vector>

namespace rcs::smoothing {

/// @param L  lower factor of H = L L^T, rows ascending in each column, diagonal first
/// @return Z with the pattern of L: the lower part of H^-1
[[nodiscard]] inline Eigen::SparseMatrix<double> selected_inverse(
    const Eigen::SparseMatrix<double>& L) {
  Eigen::SparseMatrix<double> Z = L;
  const int* begin = L.outerIndexPtr();
  const int* row = L.innerIndexPtr();
  const double* l = L.valuePtr();
  double* z = Z.valuePtr();
  const auto n = static_cast<int>(L.cols());
  std::vector<double> sum(static_cast<std::size_t>(n), 0.0);
  std::vector<double> below(static_cast<std::size_t>(n), 0.0);  // column j of L; 0: not in it
  for (int j = n - 1; j >= 0; --j) {
    const int first = begin[j] + 1;
    const int end = begin[j + 1];
    for (int a = first; a < end; ++a) below[static_cast<std::size_t>(row[a])] = l[a];
    for (int a = first; a < end; ++a) {
      const int k = row[a];
      const double l_kj = l[a];
      double sum_k = l_kj * z[begin[k]];
      for (int b = begin[k] + 1; b < begin[k + 1]; ++b) {
        const auto i = static_cast<std::size_t>(row[b]);
        // Rows outside of column j get unused sums: cheaper than a test.
        sum[i] += l_kj * z[b];
        sum_k += below[i] * z[b];
      }
      sum[static_cast<std::size_t>(k)] += sum_k;
    }
    const double d = l[begin[j]];
    double diagonal = 1.0 / d;
    for (int a = first; a < end; ++a) {
      const auto i = static_cast<std::size_t>(row[a]);
      z[a] = -sum[i] / d;
      diagonal -= l[a] * z[a];
    }
    z[begin[j]] = diagonal / d;
    for (int a = first; a < end; ++a) {
      const int k = row[a];
      below[static_cast<std::size_t>(k)] = 0.0;
      sum[static_cast<std::size_t>(k)] = 0.0;
      for (int b = begin[k] + 1; b < begin[k + 1]; ++b) sum[static_cast<std::size_t>(row[b])] = 0.0;
    }
  }
  return Z;
}

}  // namespace rcs::smoothing
