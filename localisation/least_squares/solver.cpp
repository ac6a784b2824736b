// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/solver.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <boost/container/small_vector.hpp>

#include "localisation/odometry.h"

namespace twocone::localisation::least_squares {
namespace {

/// Rows (dh/dx, dh/dy, dh/dheading, z - h) of one landmark, whitened. A row without a measurement is zero.
struct Rows {
  Eigen::RowVector4d range = Eigen::RowVector4d::Zero();
  Eigen::RowVector4d bearing = Eigen::RowVector4d::Zero();

  [[nodiscard]] double chi_squared() const { return range[3] * range[3] + bearing[3] * bearing[3]; }
};

/// The position of a state and the cosine and sine of its heading, which the rows of all landmarks need.
struct PoseTerms {
  explicit PoseTerms(const State& state)
      : x(state.x), y(state.y), c(std::cos(state.heading_rad)), s(std::sin(state.heading_rad)) {}
  double x;
  double y;
  double c;
  double s;
};

/// Returns the landmark without its whitener, for residuals in units and radians.
Landmark without_whitener(Landmark l) {
  l.range_weight = 1;
  l.bearing_weight = 1;
  l.bearing_on_range = 0;
  return l;
}

inline Rows rows_of(const Landmark& l, const PoseTerms& at, double nearest) {
  Rows rows;
  const double dx = l.x - at.x;
  const double dy = l.y - at.y;
  const double distance = std::sqrt(dx * dx + dy * dy);
  const bool has_gradient = distance > nearest;
  const double ux = has_gradient ? dx / distance : 0;
  const double uy = has_gradient ? dy / distance : 0;
  double whitened = 0;
  if (l.has_range) {
    const double w = l.range_weight;
    whitened = (l.range - distance) * w;
    rows.range[0] = -ux * w;
    rows.range[1] = -uy * w;
    rows.range[3] = whitened;
  }
  if (l.has_bearing) {
    const double w = l.bearing_weight;
    if (!has_gradient) return rows;
    // Unit vector to the landmark in the body frame; the angle from it to the measured one needs no wrapping.
    const double bx = at.c * ux + at.s * uy;
    const double by = at.c * uy - at.s * ux;
    const double error = std::atan2(bx * l.sin_bearing - by * l.cos_bearing, bx * l.cos_bearing + by * l.sin_bearing);
    const double k = l.bearing_on_range;
    rows.bearing[0] = (uy / distance - k * rows.range[0]) * w;
    rows.bearing[1] = (-ux / distance - k * rows.range[1]) * w;
    rows.bearing[2] = -w;
    rows.bearing[3] = (error - k * whitened) * w;
  }
  return rows;
}

/// Returns the distance within which the rounding of coordinates leaves no direction to a landmark.
double nearest_by_rounding(const Problem& problem) { return 16 * problem.rounding; }

/// Room for the whitened rows of a problem: on the stack for the usual sizes, on the heap beyond.
struct Workspace {
  explicit Workspace(const Problem& problem)
      : room(4 * std::size_t(problem.numbers), boost::container::default_init), rows(room.data(), problem.numbers, 4) {}
  boost::container::small_vector<double, std::size_t{4} * 2 * kStackLandmarks> room;
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 4>> rows;
};

/// Computes Householder's QR in place, of the first `unknowns` columns of `rows` rows, and applies it to the fourth
/// column too.
void factorise(double* a, std::ptrdiff_t stride, int rows, int unknowns, Factor& f) {
  double* const columns[4] = {a, a + stride, a + 2 * stride, a + 3 * stride};
  f = Factor();
  for (int k = 0; k < unknowns; ++k) {
    double* const v = columns[k];
    double below = 0;
    for (int i = k; i < rows; ++i) below += v[i] * v[i];
    double norm = below;
    for (int i = 0; i < k; ++i) norm += f.r(i, k) * f.r(i, k);
    f.norm[k] = std::sqrt(norm);
    if (k >= rows) continue;
    if (below == 0) {  // nothing to reflect: the row does not change
      for (int j = k + 1; j < unknowns; ++j) f.r(k, j) = columns[j][k];
      f.q[k] = columns[3][k];
      continue;
    }
    const double alpha = v[k] > 0 ? -std::sqrt(below) : std::sqrt(below);
    const double head = v[k] - alpha;  // no cancellation: alpha has the other sign
    f.r(k, k) = alpha;
    v[k] = head;
    const double beta = -1 / (alpha * head);  // 2 / v.v
    for (int j = k + 1; j < 4; ++j) {
      if (j >= unknowns && j != 3) continue;
      double dot = 0;
      for (int i = k; i < rows; ++i) dot += v[i] * columns[j][i];
      dot *= beta;
      for (int i = k; i < rows; ++i) columns[j][i] -= dot * v[i];
      (j == 3 ? f.q[k] : f.r(k, j)) = columns[j][k];
    }
  }
}

bool is_correlated(const Problem& problem) { return problem.whitener.rows() > 0; }

/// Writes the whitened rows of all numbers, (dh/dx, dh/dy, dh/dheading, z - h). @returns their number
template <typename Matrix>
int fill_rows(const Problem& problem, const State& state, double nearest, Matrix& rows) {
  const PoseTerms at(state);
  const bool is_joint = is_correlated(problem);
  int n = 0;
  for (const Landmark& l : problem.landmarks) {
    const Rows own = rows_of(is_joint ? without_whitener(l) : l, at, nearest);
    if (l.has_range) rows.row(n++) = own.range;
    if (l.has_bearing) rows.row(n++) = own.bearing;
  }
  if (is_joint) rows.topRows(n) = (problem.whitener.triangularView<Eigen::Lower>() * rows.topRows(n)).eval();
  return n;
}

Minimum linearise_in(const Problem& problem, const State& state, double nearest, Workspace& work) {
  const int n = fill_rows(problem, state, nearest, work.rows);
  double cost = 0;
  for (int i = 0; i < n; ++i) cost += square(work.rows(i, 3));
  Minimum here{.state = state, .cost = std::isnan(cost) ? std::numeric_limits<double>::infinity() : cost};
  factorise(work.rows.data(), work.rows.outerStride(), n, problem.unknowns(), here.factor);
  return here;
}

/// Returns the limit, a share of column k's norm, below which a diagonal element is zero up to rounding.
double negligible(const Factor& f, int k) { return 8 * kEps * f.norm[k]; }

/// Solves R d = q; unknowns that R does not observe stay 0.
Eigen::Vector3d solve(const Factor& f, int unknowns) {
  Eigen::Vector3d d = Eigen::Vector3d::Zero();
  for (int k = unknowns - 1; k >= 0; --k) {
    if (std::abs(f.r(k, k)) <= negligible(f, k)) continue;
    double rest = f.q[k];
    for (int j = k + 1; j < unknowns; ++j) rest -= f.r(k, j) * d[j];
    d[k] = rest / f.r(k, k);
  }
  return d;
}

/// As solve(), with Levenberg's rows sqrt(damping) * norm below R.
Eigen::Vector3d solve_damped(const Factor& f, int unknowns, double damping) {
  Eigen::Matrix<double, 6, 4> rows = Eigen::Matrix<double, 6, 4>::Zero();
  rows.topLeftCorner<3, 3>() = f.r;
  rows.col(3).head<3>() = f.q;
  for (int k = 0; k < 3; ++k) rows(3 + k, k) = std::sqrt(damping) * f.norm[k];
  Factor damped;
  factorise(rows.data(), 6, 6, unknowns, damped);
  return solve(damped, unknowns);
}

/// Returns the residuals of all numbers at a state, times the inverse of their covariance.
Eigen::VectorXd weighted_residuals(const Problem& problem, const State& state, double nearest) {
  Workspace work(problem);
  fill_rows(problem, state, nearest, work.rows);
  return problem.whitener.triangularView<Eigen::Lower>().transpose() * work.rows.col(3);
}

/// Computes half of the second derivatives of chi-squared that J^T J leaves out, -sum e h'', by the position alone.
Eigen::Matrix2d curvature(const Problem& problem, const State& state, double nearest) {
  const PoseTerms at(state);
  const bool is_joint = is_correlated(problem);
  const Eigen::VectorXd joint = is_joint ? weighted_residuals(problem, state, nearest) : Eigen::VectorXd();
  double xx = 0;
  double xy = 0;
  double yy = 0;
  Eigen::Index number = 0;
  for (const Landmark& l : problem.landmarks) {
    // Half of the derivative of chi-squared by the range residual, and by the bearing residual.
    double by_range = 0;
    double by_bearing = 0;
    if (is_joint) {
      if (l.has_range) by_range = joint[number++];
      if (l.has_bearing) by_bearing = joint[number++];
    } else {
      const Rows rows = rows_of(l, at, nearest);
      if (l.has_bearing) by_bearing = rows.bearing[3] * l.bearing_weight;
      if (l.has_range) by_range = (rows.range[3] - by_bearing * l.bearing_on_range) * l.range_weight;
    }
    const double dx = l.x - at.x;
    const double dy = l.y - at.y;
    const double distance = std::sqrt(dx * dx + dy * dy);
    if (distance <= nearest) continue;
    const double ux = dx / distance;
    const double uy = dy / distance;
    double bend = by_range;  // factor of (I - u u^T) / distance, from the range
    if (l.has_bearing) {
      const double turn = by_bearing / (distance * distance);
      xx -= 2 * turn * ux * uy;
      yy += 2 * turn * ux * uy;
      xy -= turn * (uy - ux) * (uy + ux);
    }
    bend /= distance;
    xx -= bend * uy * uy;
    xy += bend * ux * uy;
    yy -= bend * ux * ux;
  }
  Eigen::Matrix2d c;
  c << xx, xy, xy, yy;
  return c;
}

/// Returns whether a minimum stays a minimum with the residuals' curvature, well enough for a parabola.
bool is_bowl(const Problem& problem, const Minimum& m, double nearest) {
  const Eigen::Matrix2d c = curvature(problem, m.state, nearest);
  const Eigen::Matrix3d& r = m.factor.r;
  if (problem.unknowns() == 3 && !(std::abs(r(2, 2)) > 0)) return false;
  // If there is a heading, eliminate it from R^T R. The rest is that of the position, as by QR in the other order. Its
  // determinant is that of R without the heading's column.
  Eigen::Matrix2d h = r.topLeftCorner<2, 2>().transpose() * r.topLeftCorner<2, 2>();
  if (problem.unknowns() == 3) {
    const Eigen::Vector2d mixed = r.topLeftCorner<2, 2>().transpose() * r.block<2, 1>(0, 2);
    const double turn = r.col(2).squaredNorm();
    h -= mixed * mixed.transpose() / turn;
  }
  // c must be above -h / 2: then each minor of h + c keeps at least 1 / 4 of its value in h.
  const Eigen::Matrix2d rest = h / 2 + c;
  return rest(0, 0) > 0 && rest.determinant() > 0;
}

/// Half the Hessian of chi-squared, scaled as D H D so that its diagonal is near 1, with its eigenvalues.
struct Bowl {
  Bowl(const Problem& problem, const Minimum& m, double nearest) : unknowns(problem.unknowns()) {
    Eigen::Matrix3d h = m.factor.r.transpose() * m.factor.r;
    const Eigen::Matrix2d c = curvature(problem, m.state, nearest);
    for (int k = 0; k < 3; ++k) {
      const double size = h(k, k) + (k < 2 ? std::abs(c(k, k)) : 0);
      scale[k] = size > 0 && k < unknowns ? 1 / std::sqrt(size) : 0;
    }
    h.topLeftCorner<2, 2>() += c;
    h = scale.asDiagonal() * h * scale.asDiagonal();
    if (unknowns == 2) h(2, 2) = 1;
    is_number = h.allFinite();
    if (is_number) eigen.compute(h);
  }
  [[nodiscard]] double least() const { return eigen.eigenvalues()[0]; }
  /// Returns Newton's step, with uphill directions reversed.
  [[nodiscard]] Eigen::Vector3d step(const Factor& f, double damping) const {
    const Eigen::Vector3d slope = scale.cwiseProduct(f.r.transpose() * f.q);
    const Eigen::Vector3d along = eigen.eigenvectors().transpose() * slope;
    const Eigen::Vector3d value = eigen.eigenvalues().cwiseAbs().cwiseMax(kFlat).array() + damping;
    return scale.cwiseProduct(eigen.eigenvectors() * along.cwiseQuotient(value));
  }
  static constexpr double kFlat = 1e-14;

  int unknowns;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  bool is_number = false;
};

double spacing_of(const State& state) { return kEps * (1 + std::abs(state.x) + std::abs(state.y)); }

/// Continues from the end of Gauss-Newton by Newton's method with all second derivatives. This gives the last digits of
/// a minimum that is bent by its residuals, finds a minimum that first order does not see, and leaves a saddle.
void continue_by_newton(const Problem& problem, Workspace& work, Minimum& now) {
  const double nearest = nearest_by_rounding(problem);
  constexpr double kFarthest = 1;  // sizes of the problem, or radians, in one step
  constexpr double kSaddle = -1e-9;
  constexpr int kMostStands = 8;  // consecutive steps that gain no digit of chi-squared
  double damping = 0;
  double last_step = std::numeric_limits<double>::infinity();
  int stands = 0;
  now.converged = false;
  for (int i = 0; i < kMaxSteps; ++i) {
    const Bowl bowl(problem, now, nearest);
    if (!bowl.is_number) return;
    Eigen::Vector3d step = bowl.step(now.factor, damping);
    double size = step.cwiseAbs().maxCoeff();
    const double spacing = spacing_of(now.state);
    // This is the gain that the step predicts.
    const double gain = step.dot(now.factor.r.transpose() * now.factor.q);
    const bool is_last_digits = damping == 0 && gain <= 1e-10 * (1 + now.cost) && bowl.least() > kSaddle;
    const bool is_end =
        (damping == 0 && size <= spacing) || (is_last_digits && size >= last_step / 2) || stands >= kMostStands;
    if (is_end && bowl.least() >= kSaddle) {
      now.converged = true;
      return;
    }
    if (is_end) {  // a saddle: leave it, far enough for chi-squared to change
      step = bowl.scale.cwiseProduct(bowl.eigen.eigenvectors().col(0)) * (1e-2 / std::sqrt(-bowl.least()));
      size = step.cwiseAbs().maxCoeff();
      stands = 0;
    }
    if (size > kFarthest) step *= kFarthest / size;
    const Minimum next = linearise_in(problem, moved(now.state, step), nearest, work);
    if (next.cost <= now.cost || (is_last_digits && std::isfinite(next.cost))) {
      if (is_last_digits) last_step = size;
      stands = now.cost - next.cost <= 4 * kEps * (1 + now.cost) ? stands + 1 : 0;
      now = next;
      damping = damping < 1e-4 ? 0 : damping / 10;
    } else {
      damping = std::max(1e-3, damping * 10);
      if (damping > 1e12) {  // nothing is lower: the slope is zero up to rounding
        now.converged = bowl.least() >= kSaddle;
        return;
      }
    }
  }
}

}  // namespace

State moved(const State& state, const Eigen::Vector3d& step) {
  return {state.x + step.x(), state.y + step.y(), wrap_angle_rad(state.heading_rad + step.z())};
}

Eigen::Vector3d step_between(const State& a, const State& b) {
  return {b.x - a.x, b.y - a.y, wrap_angle_rad(b.heading_rad - a.heading_rad)};
}

double cost_at(const Problem& problem, const State& state) {
  const PoseTerms at(state);
  const double nearest = nearest_by_rounding(problem);
  double cost = 0;
  if (is_correlated(problem)) {
    Workspace work(problem);
    fill_rows(problem, state, nearest, work.rows);
    cost = work.rows.col(3).squaredNorm();
  } else {
    for (const Landmark& l : problem.landmarks) cost += rows_of(l, at, nearest).chi_squared();
  }
  return std::isnan(cost) ? std::numeric_limits<double>::infinity() : cost;
}

Minimum linearise(const Problem& problem, const State& state, double nearest) {
  Workspace work(problem);
  return linearise_in(problem, state, std::max(nearest, nearest_by_rounding(problem)), work);
}

Minimum minimise(const Problem& problem, const State& start, double worth) {
  Workspace work(problem);
  const int unknowns = problem.unknowns();
  const double nearest = nearest_by_rounding(problem);
  Minimum now = linearise_in(problem, start, nearest, work);
  if (!std::isfinite(now.cost)) return now;
  constexpr int kMostByFirstOrder = 12;
  double damping = 0;
  double last_step = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostByFirstOrder; ++i) {
    const Eigen::Vector3d step =
        damping == 0 ? solve(now.factor, unknowns) : solve_damped(now.factor, unknowns, damping);
    const double size = std::max({std::abs(step.x()), std::abs(step.y()), std::abs(step.z())});
    // A full step below rounding ends the iteration; a step that damping shortened does not.
    if (damping == 0 && size <= spacing_of(now.state)) {
      now.converged = true;
      break;
    }
    // Such a small gain in chi-squared is a step of 1e-5 sigma. The rounding of the cost decides whether it shows.
    const bool is_last_digits = damping == 0 && now.factor.q.squaredNorm() <= 1e-10 * (1 + now.cost);
    if (is_last_digits && size >= last_step / 2) {
      // A step that no longer shrinks is due to rounding, or to the residuals' curvature, which first order leaves out.
      now.converged = now.factor.q.squaredNorm() <= square(64 * spacing_of(now.state) * now.factor.norm.maxCoeff());
      break;
    }
    const Minimum next = linearise_in(problem, moved(now.state, step), nearest, work);
    if (next.cost <= now.cost || (is_last_digits && std::isfinite(next.cost))) {
      if (is_last_digits) last_step = size;
      now = next;
      damping = damping < 1e-4 ? 0 : damping / 10;
    } else {
      damping = std::max(1e-3, damping * 10);
    }
  }
  if (now.cost > worth) {
    now.converged = false;
  } else if (!now.converged || !is_bowl(problem, now, nearest)) {
    continue_by_newton(problem, work, now);
  }
  return now;
}

bool may_hold_minimum(const Problem& problem, const State& state, double reach, bool is_fine) {
  constexpr double kReaches = 4;    // limit of a step over `reach`, for a step that is accurate to a quarter of itself
  constexpr double kNoticed = 0.5;  // fall of chi-squared from a ridge within `reach`
  const Minimum here = linearise(problem, state, 0);
  // If residuals are many sigmas, their curvature would hide that first order is valid within a cell.
  if (!is_fine) return solve(here.factor, problem.unknowns()).head<2>().norm() <= kReaches * reach;
  const Bowl bowl(problem, here, nearest_by_rounding(problem));
  if (!bowl.is_number) return false;
  if (bowl.least() > 0) return bowl.step(here.factor, 0).head<2>().norm() <= kReaches * reach;
  const double length = bowl.scale.cwiseProduct(bowl.eigen.eigenvectors().col(0)).head<2>().norm();
  return -bowl.least() * square(reach / length) < kNoticed;
}

int Directions::rank() const {
  int seen = 0;
  for (int k = 0; k < unknowns; ++k) {
    // The columns have norm 1; each of some three reflections rounds them by a few units.
    if (singular[k] > 32 * kEps * singular[0]) ++seen;
  }
  return seen;
}

Eigen::Vector3d scale_of(const Factor& f, int unknowns) {
  const double place = std::hypot(f.norm[0], f.norm[1]);
  const double turn = unknowns == 3 ? f.norm[2] : 0;
  return {place > 0 ? 1 / place : 1, place > 0 ? 1 / place : 1, turn > 0 ? 1 / turn : 1};
}

Directions directions(const Factor& f, int unknowns) {
  Directions d;
  d.unknowns = unknowns;
  d.scale = scale_of(f, unknowns);
  const Eigen::Matrix3d scaled = f.r * d.scale.asDiagonal();
  // The missing third unknown keeps a zero row and column, so its singular value comes last.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.info() != Eigen::Success) return d;  // not finite: no rank
  d.singular = svd.singularValues();
  d.u = svd.matrixU();
  d.v = svd.matrixV();
  if (unknowns == 2 && d.singular[1] == 0 && std::abs(d.v(2, 1)) > 0.5) {  // of two zeros, that of an unknown is first
    d.v.col(1).swap(d.v.col(2));
    d.u.col(1).swap(d.u.col(2));
  }
  return d;
}

double bend_along(const Problem& problem, const Minimum& minimum, const Eigen::Vector3d& direction) {
  const Eigen::Matrix2d c = curvature(problem, minimum.state, nearest_by_rounding(problem));
  return (minimum.factor.r * direction).squaredNorm() + direction.head<2>().dot(c * direction.head<2>());
}

Minimum minimise_across(const Problem& problem, const State& start) {
  const int unknowns = problem.unknowns();
  Minimum now{.state = start};
  double last_step = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMaxSteps; ++i) {
    now = linearise(problem, now.state, 0);
    if (!std::isfinite(now.cost)) return now;
    const Directions d = directions(now.factor, unknowns);
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    for (int k = 0; k < unknowns - 1; ++k) {
      if (d.singular[k] <= 32 * kEps * d.singular[0]) return now;
      step += d.v.col(k) * (d.u.col(k).dot(now.factor.q) / d.singular[k]);
    }
    step = step.cwiseProduct(d.scale);
    const double size = step.cwiseAbs().maxCoeff();
    if (size <= spacing_of(now.state) || (size >= last_step / 2 && size < 1e-8)) {
      now.converged = true;
      return now;
    }
    last_step = size;
    now.state = moved(now.state, step);
  }
  return now;
}

double whitened_error2(const Problem& problem, const Landmark& landmark, const State& state) {
  return rows_of(landmark, PoseTerms(state), nearest_by_rounding(problem)).chi_squared();
}

Estimate estimate_at(const Problem& problem, const State& state, double nearest) {
  Workspace work(problem);
  fill_rows(problem, state, std::max(nearest, nearest_by_rounding(problem)), work.rows);
  const int unknowns = problem.unknowns();
  const Eigen::MatrixXd slopes = work.rows.leftCols(unknowns);
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(3, problem.numbers);
  gain.topRows(unknowns) = slopes.colPivHouseholderQr().solve(problem.whitener);
  const NumberErrors errors = errors_of_numbers(problem.landmarks, *problem.shared);
  return {gain * errors.own * gain.transpose(), gain * errors.by_shared};
}

LinearMeasurement linear_measurement(const Problem& problem, const State& state) {
  LinearMeasurement linear;
  if (problem.shared == nullptr) {
    const Factor factor = linearise(problem, state, 0).factor;
    linear.slopes = factor.r;
    linear.error = factor.q;
    return linear;
  }
  Workspace work(problem);
  fill_rows(problem, state, nearest_by_rounding(problem), work.rows);
  const Eigen::MatrixXd slopes = work.rows.leftCols(problem.unknowns());
  const Eigen::Index kept = std::min<Eigen::Index>(3, problem.numbers);
  const Eigen::MatrixXd basis =
      slopes.householderQr().householderQ() * Eigen::MatrixXd::Identity(problem.numbers, kept);
  const Eigen::MatrixXd gain = basis.transpose() * problem.whitener;
  const NumberErrors errors = errors_of_numbers(problem.landmarks, *problem.shared);
  linear.slopes.topLeftCorner(kept, problem.unknowns()) = basis.transpose() * slopes;
  linear.error.head(kept) = basis.transpose() * work.rows.col(3);
  linear.own_covariance.topLeftCorner(kept, kept) = gain * errors.own * gain.transpose();
  linear.by_shared.setZero(3, errors.by_shared.cols());
  linear.by_shared.topRows(kept) = gain * errors.by_shared;
  return linear;
}

namespace {

/// Forecasts of each landmark's numbers by the others, for correlated numbers. With
/// Q = C^-1 - C^-1 J (J^T C^-1 J)^-1 J^T C^-1, which removes the part of the residuals e that a step of the state
/// explains, chi-squared of landmark i is (Q e)_i^T (Q_ii)^-1 (Q e)_i.
class JointForecast {
 public:
  JointForecast(const Problem& problem, const State& state) : problem_(problem), work_(problem) {
    fill_rows(problem, state, nearest_by_rounding(problem), work_.rows);
    const Eigen::MatrixXd slopes = work_.rows.leftCols(problem.unknowns());
    const auto qr = slopes.colPivHouseholderQr();
    basis_ = Eigen::MatrixXd(qr.householderQ() * Eigen::MatrixXd::Identity(problem.numbers, qr.rank()));
    for (const Landmark& l : problem.landmarks) {
      first_.push_back(next_);
      next_ += l.numbers();
    }
  }

  [[nodiscard]] double of(std::size_t landmark) const {
    const Eigen::Index n = problem_.landmarks[landmark].numbers();
    const Eigen::MatrixXd columns = problem_.whitener.middleCols(first_[landmark], n);
    const Eigen::MatrixXd free = columns - basis_ * (basis_.transpose() * columns);
    const Eigen::VectorXd error = free.transpose() * work_.rows.col(3);
    const Eigen::VectorXd whole = columns.colwise().squaredNorm();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(free.transpose() * free);
    // Where nothing else forecasts a number, its information is zero up to rounding, and so is its error.
    constexpr double kNoForecast = 1e-9;
    double sum = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const Eigen::VectorXd axis = eigen.eigenvectors().col(k);
      const double information = eigen.eigenvalues()[k];
      if (information > kNoForecast * axis.cwiseAbs2().dot(whole)) sum += square(axis.dot(error)) / information;
    }
    return sum;
  }

 private:
  const Problem& problem_;
  Workspace work_;
  Eigen::MatrixXd basis_;  ///< orthonormal, of the whitened slopes
  std::vector<Eigen::Index> first_;
  Eigen::Index next_ = 0;
};

double joint_forecasts(const Problem& problem, const Minimum& minimum, const char* is_out, double* statistics) {
  const std::size_t count = problem.landmarks.size();
  std::vector<Landmark> used;
  std::vector<std::size_t> index(count);
  for (std::size_t i = 0; i < count; ++i) {
    index[i] = used.size();
    if (is_out == nullptr || is_out[i] == 0) used.push_back(problem.landmarks[i]);
  }
  const Problem rest = used.size() == count ? problem : make_problem(used, problem.rounding, problem.shared);
  const JointForecast of_used(rest, minimum.state);
  double largest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    double t = 0;
    if (is_out == nullptr || is_out[i] == 0) {
      t = of_used.of(index[i]);
    } else {
      // With the landmark added, its forecast is that of the used ones.
      std::vector<Landmark> more = used;
      more.push_back(problem.landmarks[i]);
      const Problem with = make_problem(more, problem.rounding, problem.shared);
      t = JointForecast(with, minimum.state).of(used.size());
    }
    if (statistics) *statistics++ = t;
    largest = std::max(largest, t);
  }
  return largest;
}

}  // namespace

double forecast(const Problem& problem, const Minimum& minimum, const char* is_out, double* statistics) {
  if (is_correlated(problem)) return joint_forecasts(problem, minimum, is_out, statistics);
  const int unknowns = problem.unknowns();
  const PoseTerms at(minimum.state);
  const double nearest = nearest_by_rounding(problem);
  const Factor& f = minimum.factor;
  double largest = 0;
  for (const Landmark& l : problem.landmarks) {
    const Rows rows = rows_of(l, at, nearest);
    // Rows of Q = J R^-1; leverage H = Q Q^T; forecast error e (I - H)^-1 e, for a landmark left out e (I + H)^-1 e.
    const double side_of = is_out != nullptr && *is_out++ != 0 ? 1 : -1;
    double q[2][3] = {{0, 0, 0}, {0, 0, 0}};
    for (int side = 0; side < 2; ++side) {
      const Eigen::RowVector4d& j = side == 0 ? rows.range : rows.bearing;
      for (int k = 0; k < unknowns; ++k) {
        if (std::abs(f.r(k, k)) <= negligible(f, k)) continue;
        double rest = j[k];
        for (int i = 0; i < k; ++i) rest -= q[side][i] * f.r(i, k);
        q[side][k] = rest / f.r(k, k);
      }
    }
    double h[3] = {0, 0, 0};
    for (int k = 0; k < 3; ++k) {
      h[0] += q[0][k] * q[0][k];
      h[1] += q[0][k] * q[1][k];
      h[2] += q[1][k] * q[1][k];
    }
    // Where nothing else forecasts a number (leverage 1), its residual is zero; the lower limit makes 0 / 0 a 0.
    constexpr double kNoForecast = 1e-9;
    const double a = std::max(1 + side_of * h[0], kNoForecast);
    const double c = std::max(1 + side_of * h[2], kNoForecast);
    const double determinant = std::max(a * c - h[1] * h[1], kNoForecast * std::max(a, c));
    // A residual at the level of rounding is no evidence.
    const double er = std::abs(rows.range[3]) > 16 * problem.rounding * l.range_weight ? rows.range[3] : 0;
    const double eb = std::abs(rows.bearing[3]) > 16 * kEps * l.bearing_weight ? rows.bearing[3] : 0;
    const double t = (er * er * c - side_of * 2 * er * eb * h[1] + eb * eb * a) / determinant;
    if (statistics) *statistics++ = t;
    largest = std::max(largest, t);
  }
  return largest;
}

}  // namespace twocone::localisation::least_squares
