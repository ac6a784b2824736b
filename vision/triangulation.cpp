// SPDX-License-Identifier: Apache-2.0
#include "vision/triangulation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "base/errors.h"
#include "base/plane.h"

namespace twocone::vision {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Quantiles of chi-squared at 1 - 1e-6. Two degrees of freedom: -2 ln 1e-6. One degree of freedom: the square of the
// normal distribution's two-sided quantile z, erfc(z / sqrt 2) = 1e-6, z = 4.891638475699.
constexpr std::array<double, 3> kMostChiSquared = {0, 23.92812697686, 27.63102111593};
constexpr int kMostSteps = 25;
constexpr int kMostHalvings = 40;
// After a step that changes the whitened residual by this little, the next step would change it by this times the
// residual's curvature, which is at most a tenth: far below a millionth of a sigma.
constexpr double kLastStepInSigmas = 1e-6;
// Number of roundings of a pixel in project().
constexpr double kRoundings = 64;

/// What is uncertain; nulls where rig and landmark are known exactly.
struct Belief {
  const UncertainRig* rig = nullptr;
  const BySharedErrors<kLandmarkNumbers>* landmark = nullptr;
  std::optional<TimeDoubt> doubt{};

  [[nodiscard]] Eigen::Index errors() const {
    if (rig == nullptr) return 0;
    return std::max({rig->errors(), landmark->cols(), doubt ? doubt->late->cols() : 0});
  }
  [[nodiscard]] bool is_exact() const { return errors() == 0; }
  [[nodiscard]] double edge_variance_px2(Side side) const {
    return rig == nullptr || rig->is_exact() ? 0 : rig->edge_variance_px2(side);
  }
};

struct ViewSighting {
  Side side;
  const MirrorView* view;
  const Sighting* sighting;
};

/// The errors of the pixels of one view or two, column and row each; unused rows and columns are those of the identity.
struct PixelErrors {
  /// Of the sightings' own noise.
  Eigen::Matrix4d own = Eigen::Matrix4d::Identity();
  /// Of the shared errors: true minus believed pixel.
  BySharedErrors<4> by_shared{};
  /// The inverse of the lower Cholesky factor of own + by_shared by_shared^T.
  Eigen::Matrix4d whiten = Eigen::Matrix4d::Identity();
};

/// Returns the inverse of the lower Cholesky factor.
Eigen::Matrix2d whitener(const Sighting& sighting, const char* view) {
  const Eigen::Matrix2d& c = sighting.covariance_px2;
  const double determinant = c(0, 0) * c(1, 1) - c(0, 1) * c(1, 0);
  const bool is_symmetric = std::abs(c(0, 1) - c(1, 0)) <= kRoundings * kEpsilon * c.cwiseAbs().maxCoeff();
  if (!c.allFinite() || !is_symmetric || !(c(0, 0) > 0) || !(determinant > 0)) {
    throw base::InvalidArgument(
        "triangulate: the {} sighting's covariance is [{}, {}; {}, {}] px^2, must be positive definite", view, c(0, 0),
        c(0, 1), c(1, 0), c(1, 1));
  }
  const double l00 = std::sqrt(c(0, 0));
  const double l10 = c(1, 0) / l00;
  const double l11 = std::sqrt(determinant) / l00;
  Eigen::Matrix2d inverse;
  inverse << 1 / l00, 0, -l10 / (l00 * l11), 1 / l11;
  return inverse;
}

/// Returns the sighting's radius in the undistorted image; nothing where no place in the world gives such a pixel.
std::optional<double> radius_of(const ViewSighting& seen, const Belief& belief) {
  const MirrorViewSettings& s = seen.view->settings();
  const auto undistorted = seen.view->undistort_px(seen.sighting->pixel_px);
  if (!undistorted || !undistorted->allFinite()) return std::nullopt;
  const Eigen::Vector2d offset = *undistorted - s.centre_px;
  const double radius_px = offset.norm();
  if (!(radius_px > 0)) return std::nullopt;
  const Eigen::Vector2d outwards = offset / radius_px;
  const double sigma_px =
      std::sqrt(outwards.dot(seen.sighting->covariance_px2 * outwards) + belief.edge_variance_px2(seen.side));
  if (radius_px > s.rim_radius_px + kMinSigmas * sigma_px) return std::nullopt;
  return radius_px;
}

/// The unknowns of the fit.
struct Unknowns {
  double inverse_per_m;  ///< u = 1 / (range + d), > 0
  double bearing_rad;
  double slope;  ///< (top - reference height) u, where the height is unknown
};

/// The fit with n unknowns: 2 with a known top, 3 without.
template <int n>
struct Fit {
  /// The rows of a view without sighting are zero: fixed sizes halve the time.
  using Rows = Eigen::Matrix<double, 4, n>;
  using Residual = Eigen::Vector4d;
  using Step = Eigen::Matrix<double, n, 1>;

  std::span<const ViewSighting> views;
  const Eigen::Matrix4d& whiten;
  double radius_m;
  double offset_m;     ///< d of the inverse range
  double reference_m;  ///< height to which slopes refer
  double known_top_m;  ///< where the height is known

  [[nodiscard]] double range_m(const Unknowns& x) const { return 1 / x.inverse_per_m - offset_m; }
  [[nodiscard]] double top_m(const Unknowns& x) const {
    return n == 2 ? known_top_m : reference_m + x.slope / x.inverse_per_m;
  }

  /// Computes the whitened residuals and their derivatives; returns false where a view cannot show such a landmark.
  bool evaluate(const Unknowns& x, Residual& residual, Rows& rows) const {
    const double range = range_m(x);
    const double top = top_m(x);
    const Eigen::Vector2d outwards(std::cos(x.bearing_rad), std::sin(x.bearing_rad));
    const Eigen::Vector2d sideways(-outwards.y(), outwards.x());
    const Eigen::Vector2d p_BL_m = range * outwards;
    const double range_by_u = -1 / (x.inverse_per_m * x.inverse_per_m);
    if (!(range > 0) || !std::isfinite(range)) return false;

    residual.setZero();
    rows.setZero();
    Eigen::Index row = 0;
    for (const ViewSighting& seen : views) {
      const auto near_m = near_top_point(*seen.view, p_BL_m, radius_m, top);
      if (!near_m) return false;
      const auto shown = seen.view->project_with_jacobian(*near_m, Rim::kGoesOn);
      if (!shown) return false;
      // The near point rotates about the view's axis as the landmark moves sideways: I - (r / D) (I - e e^T).
      const Eigen::Vector2d from_axis = p_BL_m - seen.view->settings().axis_offset_m;
      const double distance = from_axis.norm();
      const Eigen::Vector2d e = from_axis / distance;
      const double share = radius_m / distance;
      const Eigen::Matrix2d near_by_axis = (1 - share) * Eigen::Matrix2d::Identity() + share * e * e.transpose();
      const Eigen::Matrix2d by_axis = shown->jacobian.template leftCols<2>() * near_by_axis;

      Eigen::Matrix<double, 2, n> by_unknowns;
      by_unknowns.col(0) = by_axis * outwards * range_by_u;
      by_unknowns.col(1) = by_axis * sideways * range;
      if constexpr (n == 3) {
        by_unknowns.col(0) += shown->jacobian.col(2) * (x.slope * range_by_u);
        by_unknowns.col(2) = shown->jacobian.col(2) / x.inverse_per_m;
      }
      residual.template segment<2>(row) = seen.sighting->pixel_px - shown->pixel_px;
      rows.template middleRows<2>(row) = by_unknowns;
      row += 2;
    }
    residual = (whiten * residual).eval();
    rows = (whiten * rows).eval();
    return true;
  }

  static void add(Unknowns& x, const Step& step) {
    x.inverse_per_m += step[0];
    x.bearing_rad += step[1];
    if constexpr (n == 3) x.slope += step[2];
  }

  /// Returns the rounding error of a residual, in sigmas.
  [[nodiscard]] double rounding_in_sigmas() const {
    Eigen::Vector4d pixels = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < views.size(); ++i) pixels.segment<2>(2 * Eigen::Index(i)) = views[i].sighting->pixel_px;
    return kRoundings * kEpsilon * (whiten * pixels).cwiseAbs().maxCoeff();
  }
};

/// Computes J = Q R and y = Q^T r. The part of the residual that no step can remove remains in `residual`, turned by
/// Q^T. Returns false where J does not have full rank.
template <int n>
bool factorise(const Eigen::Matrix<double, 4, n>& rows, Eigen::Vector4d& residual, Eigen::Matrix<double, n, n>& upper,
               Eigen::Matrix<double, n, 1>& turned) {
  const Eigen::HouseholderQR<Eigen::Matrix<double, 4, n>> qr(rows);
  upper = qr.matrixQR().template topRows<n>().template triangularView<Eigen::Upper>();
  residual.applyOnTheLeft(qr.householderQ().adjoint());
  for (int k = 0; k < n; ++k) {
    const double diagonal = std::abs(upper(k, k));
    if (!(diagonal > kRoundings * kEpsilon * upper.col(k).norm()) || !std::isfinite(diagonal)) return false;
    turned[k] = std::exchange(residual[k], 0);
  }
  return true;
}

/// Runs Gauss-Newton from `x`, which becomes the answer, then fills in the answer and its verdict. `answer` holds the
/// fields set before the fit.
template <int n>
void solve(const Fit<n>& fit, Unknowns& x, int degrees_of_freedom, const PixelErrors& errors, Triangulation& answer) {
  typename Fit<n>::Residual residual;
  typename Fit<n>::Rows rows;
  answer.degrees_of_freedom = degrees_of_freedom;
  if (!fit.evaluate(x, residual, rows)) {
    answer.verdict = degrees_of_freedom > 0 ? RangeVerdict::kInconsistent : RangeVerdict::kImpossible;
    answer.top_m.reset();
    return;
  }
  const double enough = kLastStepInSigmas + fit.rounding_in_sigmas();
  Eigen::Matrix<double, n, n> upper;
  bool is_converged = false;
  for (int i = 0; i < kMostSteps; ++i) {
    const double before = residual.norm();
    typename Fit<n>::Step turned;
    if (!factorise<n>(rows, residual, upper, turned)) break;
    typename Fit<n>::Step step = upper.template triangularView<Eigen::Upper>().solve(turned);
    is_converged = turned.norm() <= enough && x.inverse_per_m + step[0] > 0;
    if (is_converged) {
      Fit<n>::add(x, step);
      break;
    }
    Unknowns next = x;
    bool is_good = false;
    for (int halving = 0; halving < kMostHalvings && !is_good; ++halving, step /= 2) {
      next = x;
      Fit<n>::add(next, step);
      is_good = next.inverse_per_m > 0 && fit.evaluate(next, residual, rows) && residual.norm() <= before + enough;
    }
    if (!is_good) {
      fit.evaluate(x, residual, rows);
      break;
    }
    x = next;
  }

  answer.chi_squared = residual.squaredNorm();
  if (degrees_of_freedom > 0 && answer.chi_squared > kMostChiSquared[std::size_t(degrees_of_freedom)]) {
    answer.verdict = RangeVerdict::kInconsistent;
    answer.top_m.reset();
    return;
  }
  answer.bearing_rad = base::wrap_angle_rad(x.bearing_rad);
  // A fit that diverges to infinity does not converge, since no step may pass u = 0.
  const Eigen::Matrix<double, n, n> root =
      upper.template triangularView<Eigen::Upper>().solve(Eigen::Matrix<double, n, n>::Identity());
  if (!is_converged || !(x.inverse_per_m >= kMinSigmas * root.row(0).norm())) {
    answer.verdict = RangeVerdict::kBeyondLimit;
    return;
  }
  answer.range_m = fit.range_m(x);
  answer.top_m = fit.top_m(x);
  const Eigen::Vector2d by_unknowns(-1 / (x.inverse_per_m * x.inverse_per_m), 1);
  const Eigen::Matrix<double, 2, n> root_of_both = by_unknowns.asDiagonal() * root.template topRows<2>();
  answer.covariance = root_of_both * root_of_both.transpose();
  answer.own_covariance = answer.covariance;
  if (errors.by_shared.cols() == 0) return;
  // The answer's derivative by the pixels: R^-1 Q^T W of the whitened rows J = Q R.
  fit.evaluate(x, residual, rows);
  const Eigen::HouseholderQR<typename Fit<n>::Rows> qr(rows);
  const Eigen::Matrix<double, 4, n> basis = qr.householderQ() * Eigen::Matrix<double, 4, n>::Identity();
  const Eigen::Matrix<double, n, n> own_upper =
      qr.matrixQR().template topRows<n>().template triangularView<Eigen::Upper>();
  const Eigen::Matrix<double, n, 4> by_pixels =
      own_upper.template triangularView<Eigen::Upper>().solve(basis.transpose() * errors.whiten);
  const Eigen::Matrix<double, 2, 4> gain = by_unknowns.asDiagonal() * by_pixels.template topRows<2>();
  answer.own_covariance = gain * errors.own * gain.transpose();
  answer.by_shared = gain * errors.by_shared;
}

/// The bearing of an object at infinity and its variance, which are those of the pixel's ray.
struct FarBearing {
  double bearing_rad, variance_rad2;
};
std::optional<FarBearing> far_bearing(const ViewSighting& seen, const Ray& ray, const Belief& belief) {
  constexpr double kStep_px = 1e-3;  // small against a pixel's distance from the tip, large against rounding
  const auto bearing_of = [](const Ray& r) { return std::atan2(r.direction.y(), r.direction.x()); };
  const double bearing_rad = bearing_of(ray);
  Eigen::Vector2d by_pixel;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d beside_px = seen.sighting->pixel_px + kStep_px * Eigen::Vector2d::Unit(axis);
    const auto beside = seen.view->back_project(beside_px, Rim::kGoesOn);
    if (!beside) return std::nullopt;
    by_pixel[axis] = base::wrap_angle_rad(bearing_of(*beside) - bearing_rad) / kStep_px;
  }
  double variance_rad2 = by_pixel.dot(seen.sighting->covariance_px2 * by_pixel);
  if (!belief.is_exact()) {
    constexpr double kFar_m = 100;
    const Eigen::Vector2d far_m = kFar_m * ray.direction.head<2>().normalized();
    const double height_m = ray.origin_m.z() + kFar_m * ray.direction.z() / ray.direction.head<2>().norm();
    const auto by_rig = belief.rig->pixel_by_shared(seen.side, far_m, kFar_m / 1e6, height_m);
    variance_rad2 += (by_pixel.transpose() * by_rig).squaredNorm();
    if (belief.doubt) {
      const double late_s = belief.doubt->late->row(seen.side == Side::kLower ? 0 : 1).norm();
      variance_rad2 += std::pow(belief.doubt->twist.turn_radps * late_s, 2);
    }
  }
  return FarBearing{bearing_rad, variance_rad2};
}

/// Returns the velocity in the image of a landmark's near point, px/s, as the body moves; zero where it is not shown.
Eigen::Vector2d image_velocity(const MirrorView& view, const BodyTwist& twist, const Eigen::Vector2d& p_BL_m,
                               double radius_m, double top_m) {
  // A central difference over a time in which the body moves by less than a millimetre.
  constexpr double kStep_s = 1e-3;
  std::array<Eigen::Vector2d, 2> pixels;
  for (int i = 0; i < 2; ++i) {
    const auto near_m = near_top_point(view, place_after(p_BL_m, twist, i == 0 ? -kStep_s : kStep_s), radius_m, top_m);
    const auto shown = near_m ? view.project_with_jacobian(*near_m, Rim::kGoesOn) : std::nullopt;
    if (!shown) return Eigen::Vector2d::Zero();
    pixels[std::size_t(i)] = shown->pixel_px;
  }
  return (pixels[1] - pixels[0]) / (2 * kStep_s);
}

/// @param is_top_known whether an error of the map's top is one of the answer
PixelErrors pixel_errors(std::span<const ViewSighting> views, const Belief& belief, const Eigen::Vector2d& p_BL_m,
                         double radius_m, double top_m, bool is_top_known) {
  PixelErrors errors;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Index at = 2 * Eigen::Index(i);
    errors.own.block<2, 2>(at, at) = views[i].sighting->covariance_px2;
    errors.whiten.block<2, 2>(at, at) = whitener(*views[i].sighting, views[i].side == Side::kLower ? "lower" : "upper");
  }
  if (belief.is_exact()) return errors;
  errors.by_shared = BySharedErrors<4>::Zero(4, belief.errors());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const MirrorView& view = *views[i].view;
    auto effect = errors.by_shared.middleRows<2>(2 * Eigen::Index(i));
    if (!belief.rig->is_exact()) effect += belief.rig->pixel_by_shared(views[i].side, p_BL_m, radius_m, top_m);
    if (belief.doubt) {
      effect += image_velocity(view, belief.doubt->twist, p_BL_m, radius_m, top_m) *
                belief.doubt->late->row(views[i].side == Side::kLower ? 0 : 1);
    }
    if (belief.landmark->cols() == 0) continue;
    const auto near_m = near_top_point(view, p_BL_m, radius_m, top_m);
    const auto shown = near_m ? view.project_with_jacobian(*near_m, Rim::kGoesOn) : std::nullopt;
    if (!shown) continue;
    const Eigen::Vector2d outwards = (p_BL_m - view.settings().axis_offset_m).normalized();
    effect -= shown->jacobian.leftCols<2>() * outwards * belief.landmark->row(kRadius);
    if (is_top_known) effect += shown->jacobian.col(2) * belief.landmark->row(kTop);
  }
  const Eigen::Matrix4d covariance = errors.own + errors.by_shared * errors.by_shared.transpose();
  errors.whiten = covariance.llt().matrixL().solve(Eigen::Matrix4d::Identity());
  return errors;
}

/// Solves from `x` with the errors of the pixels there. The effect of shared errors depends on the place, so it is
/// computed again at the answer if that is elsewhere.
template <int n>
void solve_with_errors(std::span<const ViewSighting> views, const Belief& belief, Fit<n> like, Unknowns x,
                       int degrees_of_freedom, Triangulation& answer) {
  // A place that is off by this share of its distance changes a standard deviation by as little.
  constexpr double kSamePlace = 0.01;
  const Triangulation before = answer;
  const auto place_of = [&](const Unknowns& at) {
    return Eigen::Vector2d(like.range_m(at) * Eigen::Vector2d(std::cos(at.bearing_rad), std::sin(at.bearing_rad)));
  };
  for (int round = 0; round < 2; ++round) {
    const Eigen::Vector2d start_m = place_of(x);
    const PixelErrors errors = pixel_errors(views, belief, start_m, like.radius_m, like.top_m(x), n == 2);
    const Fit<n> fit{views, errors.whiten, like.radius_m, like.offset_m, like.reference_m, like.known_top_m};
    answer = before;
    solve(fit, x, degrees_of_freedom, errors, answer);
    if (belief.is_exact() || !answer.range_m) return;
    if ((place_of(x) - start_m).norm() <= kSamePlace * *answer.range_m) return;
  }
}

Triangulation triangulate(const Rig& rig, const Belief& belief, const Sighting* lower, const Sighting* upper,
                          double radius_m, std::optional<double> top_m) {
  base::Complaints bad;
  bad.require(base::is_positive(radius_m), "radius_m is {} m, must be > 0", radius_m);
  if (top_m) bad.finite("top_m", *top_m, "m");
  bad.raise("triangulate");

  const PixelErrors no_errors;
  std::array<ViewSighting, 2> seen{};
  std::size_t count = 0;
  const auto take = [&](Side side, const Sighting* sighting) {
    if (sighting == nullptr) return;
    (void)whitener(*sighting, side == Side::kLower ? "lower" : "upper");  // throws for a matrix that is no covariance
    seen[count++] = {side, &of_view(rig, side), sighting};
  };
  take(Side::kLower, lower);
  take(Side::kUpper, upper);

  Triangulation answer;
  answer.top_m = top_m;
  if (count == 0 || (count == 1 && !top_m)) return answer;

  answer.verdict = RangeVerdict::kImpossible;
  std::array<Ray, 2> rays;
  std::array<double, 2> radii_px{};
  for (std::size_t i = 0; i < count; ++i) {
    const auto radius_px = radius_of(seen[i], belief);
    if (!radius_px) return answer;
    const auto ray = seen[i].view->back_project(seen[i].sighting->pixel_px, Rim::kGoesOn);
    if (!ray) return answer;
    radii_px[i] = *radius_px;
    rays[i] = *ray;
  }
  if (count == 2) {
    answer.disparity_px = radii_px[0] - radii_px[1] * rig.lower.focal_length_px() / rig.upper.focal_length_px();
  }

  // d of the inverse range and the reference height of slopes are those of the only view, or of the lower one of two.
  const MirrorViewSettings& first = seen[0].view->settings();
  const double offset_m = first.cone.lens_to_tip_m;
  const double reference_m = seen[0].view->tip_m().z();
  if (top_m) {
    std::optional<Eigen::Vector2d> start;
    for (std::size_t i = 0; i < count && !start; ++i) {
      start = axis_at_height(*seen[i].view, rays[i], radius_m, *top_m);
    }
    if (!start) return answer;
    answer.verdict = count == 2 ? RangeVerdict::kOk : RangeVerdict::kOneView;
    const Unknowns x{1 / (start->norm() + offset_m), std::atan2(start->y(), start->x()), 0};
    const std::span<const ViewSighting> views(seen.data(), count);
    solve_with_errors(views, belief, Fit<2>{views, no_errors.whiten, radius_m, offset_m, reference_m, *top_m}, x,
                      count == 2 ? 2 : 0, answer);
    return answer;
  }

  // In the vertical plane of the mean bearing each ray is z = height + steepness * out; the rays meet where these
  // agree.
  const Eigen::Vector2d mean = rays[0].direction.head<2>().normalized() + rays[1].direction.head<2>().normalized();
  answer.degrees_of_freedom = 1;
  // Nothing is left of the mean where the rays point in opposite directions.
  if (!(mean.norm() > kRoundings * kEpsilon)) return with_verdict(answer, RangeVerdict::kInconsistent);
  const Eigen::Vector2d outwards = mean.normalized();
  std::array<double, 2> height_m{};
  std::array<double, 2> steepness{};
  for (std::size_t i = 0; i < 2; ++i) {
    steepness[i] = rays[i].direction.z() / rays[i].direction.head<2>().dot(outwards);
    height_m[i] = rays[i].origin_m.z() - steepness[i] * rays[i].origin_m.head<2>().dot(outwards);
  }
  const double bearing_rad = std::atan2(outwards.y(), outwards.x());
  const double near_m = (height_m[1] - height_m[0]) / (steepness[0] - steepness[1]);
  if (!(near_m > 0) || !std::isfinite(near_m)) {
    // The rays do not meet before infinity, where only the bearings can contradict each other.
    const auto below = far_bearing(seen[0], rays[0], belief);
    const auto above = far_bearing(seen[1], rays[1], belief);
    if (!below || !above) return answer;
    const double off_rad = base::wrap_angle_rad(below->bearing_rad - above->bearing_rad);
    answer.chi_squared = off_rad * off_rad / (below->variance_rad2 + above->variance_rad2);
    if (answer.chi_squared > kMostChiSquared[1]) return with_verdict(answer, RangeVerdict::kInconsistent);
    answer.bearing_rad = bearing_rad;
    return with_verdict(answer, RangeVerdict::kBeyondLimit);
  }
  const double start_top_m = height_m[0] + steepness[0] * near_m;
  const double inverse_per_m = 1 / (near_m + radius_m + offset_m);
  answer.verdict = RangeVerdict::kOk;
  const Unknowns x{inverse_per_m, bearing_rad, (start_top_m - reference_m) * inverse_per_m};
  solve_with_errors(seen, belief, Fit<3>{seen, no_errors.whiten, radius_m, offset_m, reference_m, 0}, x, 1, answer);
  return answer;
}

}  // namespace

Triangulation triangulate(const Rig& rig, const Sighting* lower, const Sighting* upper, double radius_m,
                          std::optional<double> top_m) {
  return triangulate(rig, Belief{}, lower, upper, radius_m, top_m);
}

Triangulation triangulate(const UncertainRig& rig, const BySharedErrors<kLandmarkNumbers>& landmark,
                          const Sighting* lower, const Sighting* upper, double radius_m, std::optional<double> top_m,
                          const std::optional<TimeDoubt>& doubt) {
  return triangulate(rig.rig(), Belief{&rig, &landmark, doubt}, lower, upper, radius_m, top_m);
}

}  // namespace twocone::vision
