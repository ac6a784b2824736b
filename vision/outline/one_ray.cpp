// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/one_ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Dense>

namespace twocone::vision {
namespace {

// The posterior is summed over a grid of places along its principal axes. With kHalfGrid sigmas to either side the grid
// holds all but 0.3 % of a Gaussian; a uniform density ends at 2 sigmas. A grid is accepted where the posterior's mean
// is at most kMostShift of the grid's sigmas from its middle and the posterior's sigmas are kLeastShare to kMostShare
// of the grid's: then 3 to 8 places lie within two sigmas. Otherwise the next grid is that of the posterior. The values
// are checked together by one_ray_test.cpp, which compares with the polygon itself.
constexpr int kSide = 12;
constexpr int kPlaces = kSide * kSide;
constexpr double kHalfGrid = 3.2;
constexpr double kMostShift = 1.2;
constexpr double kLeastShare = 0.5;
constexpr double kMostShare = 1.3;
constexpr int kMostGrids = 6;  // for one tolerance
// Pixels between two normalisations: kOneRayMiss to this power is still a float.
constexpr int kBatch = 8;
// The fit to coverages may be farther off than it states, where a background near the outline has another colour than
// the one that was read: the first grid is wider by this. Tuned by hand on rendered images; no test fixes it.
constexpr double kStart_px = 0.2;
// A posterior narrower than this has no width in floats.
constexpr double kLeastSigma_px = 1e-4;
// A pixel of the landmark's hue with a smaller coverage than this is a background of that hue: it states nothing. Tuned
// by hand; no test fixes it.
constexpr float kLeastCoverage = 0.25F;
// A pixel this many times farther from the outline than grid and tolerance reach does not matter for smaller
// tolerances.
constexpr double kFar = 3;

/// What one pixel states: its centre's distance inside the outline, as a function of the step in pixels, is positive or
/// negative.
struct Statement {
  float inside_px;
  float by_range;
  float by_bearing;
  bool is_inside;
};

struct Grid {
  Eigen::Vector2d middle_px;
  Eigen::Matrix2d axes_px;  // columns: principal axes of one sigma
};

/// Returns the grid of a posterior.
Grid grid_of(const Eigen::Vector2d& mean_px, const Eigen::Matrix2d& covariance_px2) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(covariance_px2);
  const Eigen::Vector2d sigmas = eigen.eigenvalues().cwiseMax(kLeastSigma_px * kLeastSigma_px).cwiseSqrt();
  return {mean_px, eigen.eigenvectors() * sigmas.asDiagonal()};
}

/// A statement on a grid: the distance at the middle, its change along the axes, and the greatest change.
struct OnGrid {
  double middle_px, by_first, by_second, reach_px;
};
OnGrid on_grid(const Statement& s, const Grid& grid) {
  const double by_first = s.by_range * grid.axes_px(0, 0) + s.by_bearing * grid.axes_px(1, 0);
  const double by_second = s.by_range * grid.axes_px(0, 1) + s.by_bearing * grid.axes_px(1, 1);
  return {s.inside_px + s.by_range * grid.middle_px.x() + s.by_bearing * grid.middle_px.y(), by_first, by_second,
          kHalfGrid * (std::abs(by_first) + std::abs(by_second))};
}
/// Returns whether the middle of a grid agrees with a statement.
bool agrees(const Statement& s, const OnGrid& on) { return (on.middle_px > 0) == s.is_inside; }

/// Numbers of statements that no place of a grid changes, and the logarithm of their probability.
struct Settled {
  int agreeing = 0;
  int missing = 0;

  void add(bool is_agreeing) { ++(is_agreeing ? agreeing : missing); }
  [[nodiscard]] double log_probability() const {
    return agreeing * std::log1p(-kOneRayMiss) + missing * std::log(kOneRayMiss);
  }
};

/// The posterior on a grid, in sigmas of the grid along its axes.
struct Moments {
  Eigen::Vector2d mean;
  Eigen::Matrix2d covariance;
  double log_evidence;
};

Moments moments_on(const Grid& grid, const std::vector<Statement>& statements, Settled settled, double tolerance_px) {
  constexpr double kStep = 2 * kHalfGrid / (kSide - 1);
  constexpr auto kMiss = static_cast<float>(kOneRayMiss);
  std::array<float, kPlaces> likelihood;
  likelihood.fill(1);
  double log_scale = 0;
  int in_batch = 0;
  const auto normalise = [&] {
    const float most = *std::max_element(likelihood.begin(), likelihood.end());
    log_scale += std::log(double(most));
    for (float& p : likelihood) p /= most;
    in_batch = 0;
  };
  for (const Statement& s : statements) {
    const OnGrid on = on_grid(s, grid);
    if (std::abs(on.middle_px) > on.reach_px + tolerance_px) {
      settled.add(agrees(s, on));
      continue;
    }
    // The probability that the pixel shows what it shows, on both axes a linear function between its limits.
    const double slope = (s.is_inside ? 0.5 : -0.5) / tolerance_px;
    const auto first = static_cast<float>(0.5 + (on.middle_px - kHalfGrid * (on.by_first + on.by_second)) * slope);
    const auto by_i = static_cast<float>(kStep * on.by_first * slope);
    const auto by_j = static_cast<float>(kStep * on.by_second * slope);
    for (int j = 0; j < kSide; ++j) {
      const float begin = first + static_cast<float>(j) * by_j;
      float* const row = &likelihood[std::size_t(j) * kSide];
      for (int i = 0; i < kSide; ++i) {
        const float p = begin + static_cast<float>(i) * by_i;
        row[i] *= std::min(std::max(p, kMiss), 1 - kMiss);
      }
    }
    if (++in_batch == kBatch) normalise();
  }
  normalise();
  double sum = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (int j = 0; j < kSide; ++j) {
    const double v = -kHalfGrid + kStep * j;
    for (int i = 0; i < kSide; ++i) {
      const double u = -kHalfGrid + kStep * i;
      const double w = likelihood[std::size_t(j) * kSide + std::size_t(i)];
      sum += w;
      x += w * u;
      y += w * v;
      xx += w * u * u;
      xy += w * u * v;
      yy += w * v * v;
    }
  }
  Moments m;
  m.mean = Eigen::Vector2d(x, y) / sum;
  m.covariance << xx / sum, xy / sum, xy / sum, yy / sum;
  m.covariance -= m.mean * m.mean.transpose();
  m.log_evidence =
      settled.log_probability() + log_scale + std::log(sum * kStep * kStep * std::abs(grid.axes_px.determinant()));
  return m;
}

}  // namespace

std::optional<OneRayFits> fit_one_ray(const EdgeSamples& read, const OutlineFit& fit) {
  const Eigen::Vector2d per_px(1 / fit.outline.near.by_range_pxpm.norm(),
                               1 / fit.outline.near.by_bearing_pxprad.norm());
  OneRayFits fits;
  std::vector<Statement> statements;
  statements.reserve(read.pixels.size());
  for (const EdgeSample& s : read.edge_samples) {
    if (!s.is_usable) continue;
    const Eigen::Vector2d moves(s.by_range_pxpm, s.by_bearing_pxprad);
    fits.motion += moves * moves.transpose() / s.wide;
    const Eigen::Vector2d moves_px = moves.cwiseProduct(per_px);
    for (int i = s.first; i < s.first + s.count; ++i) {
      const EdgePixel& p = read.pixels[std::size_t(i)];
      if (p.is_inside && p.coverage < kLeastCoverage) continue;
      // On the curve itself, a pixel beside the crossing lies farther out than on its tangent there.
      const float aside_px = p.inside_px * s.narrow / s.wide;
      const float bend_px = s.bend_px * (1 - EdgeSample::kBends / 2 * aside_px * aside_px);
      statements.push_back(
          {p.inside_px + bend_px, static_cast<float>(moves_px.x()), static_cast<float>(moves_px.y()), p.is_inside});
    }
  }

  const auto from_px = per_px.asDiagonal();
  const Eigen::Matrix2d fitted_px2 =
      per_px.cwiseInverse().asDiagonal() * fit.information.inverse() * per_px.cwiseInverse().asDiagonal();
  const Eigen::Matrix2d start_px2 = fitted_px2 + kStart_px * kStart_px * Eigen::Matrix2d::Identity();
  if (!fitted_px2.allFinite()) return std::nullopt;
  Grid grid = grid_of(fit.step.cwiseQuotient(per_px), start_px2);
  Settled settled;
  for (std::size_t k = 0; k < kTolerances_px.size(); ++k) {
    OneRayFit& answer = fits.by_tolerance[k];
    bool is_held = false;
    for (int round = 0; round < kMostGrids && !is_held; ++round) {
      const Moments m = moments_on(grid, statements, settled, kTolerances_px[k]);
      const Eigen::Vector2d mean_px = grid.middle_px + grid.axes_px * m.mean;
      const Eigen::Matrix2d covariance_px2 = grid.axes_px * m.covariance * grid.axes_px.transpose();
      answer = {from_px * mean_px, from_px * covariance_px2 * from_px, m.log_evidence};
      const Eigen::Vector2d sigmas = m.covariance.diagonal().cwiseSqrt();
      is_held = m.mean.cwiseAbs().maxCoeff() < kMostShift && sigmas.maxCoeff() < kMostShare &&
                (sigmas.minCoeff() > kLeastShare || grid.axes_px.colwise().norm().minCoeff() <= kLeastSigma_px);
      grid = grid_of(mean_px, covariance_px2);
    }
    if (!is_held) {
      // Smaller tolerances have no posterior here either.
      if (k == 0) return std::nullopt;
      for (; k < kTolerances_px.size(); ++k) {
        fits.by_tolerance[k] = fits.by_tolerance[k - 1];
        fits.by_tolerance[k].log_evidence = -std::numeric_limits<double>::infinity();
      }
      break;
    }
    // Pixels that no place near here contradicts or satisfies under a smaller tolerance are counted once for all.
    std::erase_if(statements, [&](const Statement& s) {
      const OnGrid on = on_grid(s, grid);
      const bool is_far = std::abs(on.middle_px) > kFar * (on.reach_px + kTolerances_px[k]);
      if (is_far) settled.add(agrees(s, on));
      return is_far;
    });
  }
  return fits;
}

}  // namespace twocone::vision
