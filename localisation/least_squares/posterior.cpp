// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/posterior.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "localisation/covariance.h"
#include "localisation/least_squares/problem.h"

namespace twocone::localisation::least_squares {
namespace {

/// The iteration ends at a step below this many posterior sigmas. The error that remains is far too small to affect
/// regions of 99.9 %.
constexpr double kStepEnd = 1e-6;
constexpr int kMostSteps = 50;
/// A second place is neglected where it is less likely than the first by this factor: a tenth of the probability
/// outside a region of 99.9 %.
constexpr double kOtherPlace = 1e-4;
/// Two results of the iteration are two places if they are this many sigmas apart.
constexpr double kApart = 1;
/// Distance of further starts from the prior's mean, in its sigmas. A minimum that is not reached from one of these is
/// less likely, by the prior alone, than exp(-2^2 / 2), and the valleys of the other minima are in between.
constexpr double kStartSigmas = 2;
/// Distance at which the posterior is compared with its ellipse, where chi-squared is 9. A region of 99.9 % has 16.3.
constexpr double kLookSigmas = 3;
/// Limits of chi-squared over that 9. They are chosen by trial (pose_filter_weak_test.cpp, 10,000 draws): regions of
/// 99.9 % then contain the truth in 99.88 %, at the cost of 7 % of the fixes; without the test, the truth would be
/// outside in 4 % of these.
constexpr double kLeastRise = 0.6;
constexpr double kMostRise = 1.7;

/// Directions to the sphere's points: along the axes, and between two or three of them, with both signs.
std::array<Eigen::Vector3d, 26> directions_of_sphere() {
  std::array<Eigen::Vector3d, 26> all;
  for (int i = 0; i < 26; ++i) {
    const int cell = i < 13 ? i : i + 1;  // of the 27 cells of a cube, without the middle one
    all[std::size_t(i)] = Eigen::Vector3i(cell / 9 - 1, cell / 3 % 3 - 1, cell % 3 - 1).cast<double>().normalized();
  }
  return all;
}

/// A place of the posterior with its cost and the measurements, linearised there.
struct Point {
  Eigen::Vector3d z;
  double cost;
  Eigen::Matrix3d rows;
  Eigen::Vector3d right;
};

/// The posterior in coordinates z in which the prior is the unit Gaussian: pose = mean + lower z.
class Whitened {
 public:
  Whitened(const Problem& problem, const State& mean, const Eigen::Matrix3d& lower, double widening)
      : problem_(problem), mean_(mean), lower_(lower), root_(std::sqrt(widening)) {}

  [[nodiscard]] State at(const Eigen::Vector3d& z) const { return moved(mean_, lower_ * z); }
  [[nodiscard]] double cost(const Eigen::Vector3d& z) const {
    return cost_at(problem_, at(z)) / (root_ * root_) + z.squaredNorm();
  }
  [[nodiscard]] Point linearise(const Eigen::Vector3d& z) const {
    const Minimum here = least_squares::linearise(problem_, at(z), 0);
    return {z, here.cost / (root_ * root_) + z.squaredNorm(), here.factor.r * lower_ / root_, here.factor.q / root_};
  }

 private:
  const Problem& problem_;
  State mean_;
  Eigen::Matrix3d lower_;
  double root_;
};

/// Finds a mode by Gauss-Newton with Levenberg's damping. Returns nothing where it does not converge.
std::optional<Point> climb(const Whitened& posterior, const Eigen::Vector3d& start) {
  Point now = posterior.linearise(start);
  double damping = 0;
  for (int i = 0; i < kMostSteps && std::isfinite(now.cost); ++i) {
    Eigen::Matrix<double, 9, 3> a;
    a << now.rows, Eigen::Matrix3d::Identity(), damping * Eigen::Matrix3d::Identity();
    Eigen::Matrix<double, 9, 1> b;
    b << now.right, -now.z, Eigen::Vector3d::Zero();
    const Eigen::Vector3d step = a.householderQr().solve(b);
    if (!step.allFinite()) return std::nullopt;
    const double sigmas = std::sqrt((now.rows * step).squaredNorm() + step.squaredNorm());
    if (sigmas < kStepEnd) return now;
    const Point next = posterior.linearise(now.z + step);
    if (next.cost <= now.cost) {
      now = next;
      damping = damping < 1e-3 ? 0 : damping / 10;
    } else {
      // The rounding of the cost is larger than the gain of the last steps.
      if (next.cost - now.cost <= 8 * kEps * now.cost) return now;
      damping = damping == 0 ? 1 : damping * 10;
    }
  }
  return std::nullopt;
}

/// Returns the most likely pose; nothing where there are several, or none.
std::optional<Point> only_mode(const Whitened& posterior) {
  auto best = climb(posterior, Eigen::Vector3d::Zero());
  if (!best) return std::nullopt;
  std::vector<Point> modes;
  for (const Eigen::Vector3d& direction : directions_of_sphere()) {
    const auto mode = climb(posterior, kStartSigmas * direction);
    if (mode && mode->cost < best->cost) best = mode;
    if (mode) modes.push_back(*mode);
  }
  for (const Point& mode : modes) {
    if (mode.cost > best->cost - 2 * std::log(kOtherPlace)) continue;
    const Eigen::Vector3d apart = mode.z - best->z;
    if ((best->rows * apart).squaredNorm() + apart.squaredNorm() > kApart * kApart) return std::nullopt;
  }
  return best;
}

}  // namespace

Posterior update(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance,
                 std::span<const LandmarkMeasurement> measurements, double widening) {
  Posterior result;
  std::vector<Landmark> room(measurements.size());
  Frame frame;
  const int count = prepare(measurements, frame, room.data());
  if (count == 0 || !(widening > 0) || !mean.allFinite() || !is_covariance<3>(covariance)) return result;
  const Eigen::Vector3d per_unit(1 / frame.unit_m, 1 / frame.unit_m, 1);
  const Eigen::Matrix3d lower = (per_unit.asDiagonal() * covariance * per_unit.asDiagonal()).eval().llt().matrixL();
  const Eigen::Vector2d place = (mean.head<2>() - frame.origin_m) / frame.unit_m;
  const State here{place.x(), place.y(), mean.z()};
  const SharedErrors shared{measurements, frame, here};
  const Problem problem =
      make_problem({room.data(), std::size_t(count)}, frame.rounding, shared.any() ? &shared : nullptr);
  const Whitened posterior(problem, here, lower, widening);
  result.kind = Posterior::Kind::kNotGaussian;
  const auto mode = only_mode(posterior);
  if (!mode) return result;
  result.chi_squared = mode->cost;

  // The ellipse's axes, ordered by the information of the measurements: the longest is last.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(mode->rows, Eigen::ComputeFullV);
  Eigen::Matrix3d axes = svd.matrixV();
  for (int k = 0; k < 3; ++k) axes.col(k) /= std::hypot(1, svd.singularValues()[k]);
  for (const Eigen::Vector3d& direction : directions_of_sphere()) {
    const double rise = posterior.cost(mode->z + kLookSigmas * (axes * direction)) - mode->cost;
    const double promised = kLookSigmas * kLookSigmas;
    if (!(rise >= kLeastRise * promised && rise <= kMostRise * promised)) return result;
  }
  result.kind = Posterior::Kind::kGaussian;
  LinearMeasurement& m = result.measurement = linear_measurement(problem, posterior.at(mode->z));
  m.slopes = m.slopes * per_unit.asDiagonal();
  m.error += m.slopes * per_unit.cwiseInverse().cwiseProduct(lower * mode->z);
  // As in a fix, what the widening adds counts as own noise.
  m.own_covariance = widening * m.own_covariance + (widening - 1) * m.by_shared * m.by_shared.transpose();
  return result;
}

}  // namespace twocone::localisation::least_squares
