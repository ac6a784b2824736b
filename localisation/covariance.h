// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace twocone::localisation {

/// Returns whether `c` is a valid covariance: finite, symmetric to rounding, and positive definite. The test scales the
/// diagonal to 1, so units and size do not matter.
template <int N>
bool is_covariance(const Eigen::Matrix<double, N, N>& c) {
  if (!c.allFinite() || !(c.diagonal().minCoeff() > 0)) return false;
  const Eigen::Matrix<double, N, 1> sigma = c.diagonal().cwiseSqrt();
  Eigen::Matrix<double, N, N> correlation;
  for (int i = 0; i < N; ++i) {
    // Divide by one root at a time: the product of two variances may overflow where the correlation does not.
    for (int j = 0; j < N; ++j) correlation(i, j) = i == j ? 1 : c(i, j) / sigma[i] / sigma[j];
  }
  // Where the matrix was made as A B A^T, the entries on either side of the diagonal were rounded a few times.
  constexpr double kAsymmetry = 64 * std::numeric_limits<double>::epsilon();
  if (!((correlation - correlation.transpose()).cwiseAbs().maxCoeff() <= kAsymmetry)) return false;
  return correlation.llt().info() == Eigen::Success;
}

}  // namespace twocone::localisation
