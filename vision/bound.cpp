// SPDX-License-Identifier: Apache-2.0
#include "vision/bound.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/Geometry>

#include "base/errors.h"
#include "vision/method_arguments.h"
#include "vision/ranging.h"

namespace twocone::vision {
namespace {

/// Gauss-Legendre quadrature with 8 points on (-1, 1): position and weight of the four points above 0.
constexpr std::array<std::pair<double, double>, 4> kGauss = {{{0.1834346424956498, 0.3626837833783620},
                                                              {0.5255324099163290, 0.3137066458778873},
                                                              {0.7966664774136267, 0.2223810344533745},
                                                              {0.9602898564975363, 0.1012285362903763}}};
// Numbers of bisections and of Newton steps: a double has 53 bits, and the error of Newton's start is of the size of
// the tilt.
constexpr int kBisections = 60;
constexpr int kGrazingSteps = 12;
constexpr double kGrazingRounding_rad = 1e-13;
// Step of central differences for derivatives that need a few digits only.
constexpr double kSmallTurn_rad = 1e-5;

template <typename Function>
void integrate(double from, double to, const Function& add) {
  const double middle = (from + to) / 2;
  const double half = (to - from) / 2;
  for (const auto& [place, weight] : kGauss) {
    add(middle - half * place, half * weight);
    add(middle + half * place, half * weight);
  }
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The outline of the landmark in one view.
class LandmarkOutline {
 public:
  LandmarkOutline(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m, double top_m)
      : view_(view), p_BL_m_(p_BL_m), radius_m_(radius_m), top_m_(top_m) {
    const Eigen::Vector2d outwards = p_BL_m.normalized();
    by_parameters_.col(0) << outwards.x(), outwards.y(), 0;
    by_parameters_.col(1) << -p_BL_m.y(), p_BL_m.x(), 0;
  }

  [[nodiscard]] Eigen::Matrix2d information_px2() const {
    const Eigen::Vector2d from_axis = p_BL_m_ - view_.settings().axis_offset_m;
    const double near_rad = std::atan2(-from_axis.y(), -from_axis.x());
    // In upright views a ray grazes where the radius is at a right angle to the line of sight; in others, near there.
    const double half_rad = std::acos(radius_m_ / from_axis.norm());
    const double left_rad = grazing(near_rad + half_rad, top_m_);
    const double right_rad = grazing(near_rad - half_rad, top_m_);
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    add_side(left_rad, information);
    add_side(right_rad, information);

    const auto ray = ray_to(point(near_rad, top_m_));
    const bool looks_down = ray && ray->looks_down();
    const double other_left_rad = looks_down ? left_rad - 2 * std::numbers::pi : left_rad;
    const double middle_rad = (right_rad + other_left_rad) / 2;
    add_top(right_rad, middle_rad, information);
    add_top(middle_rad, other_left_rad, information);
    return information;
  }

 private:
  [[nodiscard]] Eigen::Vector3d point(double around_rad, double height_m) const {
    return {p_BL_m_.x() + radius_m_ * std::cos(around_rad), p_BL_m_.y() + radius_m_ * std::sin(around_rad), height_m};
  }
  [[nodiscard]] Eigen::Vector3d round_it(double around_rad) const {
    return {-radius_m_ * std::sin(around_rad), radius_m_ * std::cos(around_rad), 0};
  }
  [[nodiscard]] std::optional<Ray> ray_to(const Eigen::Vector3d& p_BQ_m) const {
    const auto pixel = view_.project(p_BQ_m);
    return pixel ? view_.back_project(*pixel) : std::nullopt;
  }

  /// Finds the angle at which a ray grazes. There the image of the surface folds: the pixel moves in the same direction
  /// whether the point moves round the cylinder or up it. Newton's method starts at `start_rad`, which is returned
  /// where the view does not show the point.
  [[nodiscard]] double grazing(double start_rad, double height_m) const {
    const auto fold = [&](double around_rad) -> std::optional<double> {
      const auto shown = view_.project_with_jacobian(point(around_rad, height_m), Rim::kGoesOn);
      if (!shown) return std::nullopt;
      const Eigen::Vector2d along = shown->jacobian * round_it(around_rad);
      return cross(along, shown->jacobian.col(2).normalized());
    };
    double around_rad = start_rad;
    for (int i = 0; i < kGrazingSteps; ++i) {
      const auto here = fold(around_rad);
      const auto before = fold(around_rad - kSmallTurn_rad);
      const auto after = fold(around_rad + kSmallTurn_rad);
      if (!here || !before || !after) return start_rad;
      const double step = -*here * 2 * kSmallTurn_rad / (*after - *before);
      if (!(std::abs(step) < 1)) return start_rad;
      around_rad += step;
      if (std::abs(step) < kGrazingRounding_rad) break;
    }
    return around_rad;
  }

  /// Returns the lowest height at which the view shows the vertical line on the cylinder at `around_rad`; not below the
  /// floor.
  [[nodiscard]] double lowest_shown_m(double around_rad) const {
    const auto is_shown = [&](double height_m) {
      return view_.project_with_jacobian(point(around_rad, height_m), Rim::kGoesOn).has_value();
    };
    double shown_m = top_m_;
    double hidden_m = 0;
    if (is_shown(hidden_m)) return 0;
    for (int i = 0; i < kBisections; ++i) {
      const double middle_m = (shown_m + hidden_m) / 2;
      (is_shown(middle_m) ? shown_m : hidden_m) = middle_m;
    }
    return shown_m;
  }

  void add_side(double top_around_rad, Eigen::Matrix2d& information) const {
    const double lowest_m = lowest_shown_m(top_around_rad);
    const double step_m = kSmallTurn_rad * (top_m_ - lowest_m);
    if (!(step_m > 0)) return;
    integrate(lowest_m, top_m_, [&](double height_m, double weight_m) {
      const double around_rad = grazing(top_around_rad, height_m);
      const double turn_radpm =
          (grazing(around_rad, height_m + step_m) - grazing(around_rad, height_m - step_m)) / (2 * step_m);
      add(around_rad, height_m, Eigen::Vector3d::UnitZ() + round_it(around_rad) * turn_radpm, weight_m, information);
    });
  }

  void add_top(double from_rad, double to_rad, Eigen::Matrix2d& information) const {
    integrate(from_rad, to_rad, [&](double around_rad, double weight_rad) {
      add(around_rad, top_m_, round_it(around_rad), weight_rad, information);
    });
  }

  /// Adds one point of the outline. @param along its derivative by the integration variable @param weight of the point,
  /// in that variable
  void add(double around_rad, double height_m, const Eigen::Vector3d& along, double weight,
           Eigen::Matrix2d& information) const {
    const Eigen::Vector3d p_BQ_m = point(around_rad, height_m);
    const auto shown = view_.project_with_jacobian(p_BQ_m);
    if (!shown) return;
    const Eigen::Vector2d tangent = shown->jacobian * along;
    const double length_px = tangent.norm();
    if (!(length_px > 0)) return;
    const Eigen::RowVector2d normal(-tangent.y() / length_px, tangent.x() / length_px);
    const Eigen::RowVector2d moves = normal * shown->jacobian * by_parameters_;
    information += std::abs(weight) * length_px * moves.transpose() * moves;
  }

  const MirrorView& view_;
  Eigen::Vector2d p_BL_m_;
  double radius_m_;
  double top_m_;
  Eigen::Matrix<double, 3, 2> by_parameters_;  ///< derivative of the axis by range (m) and bearing (rad)
};

}  // namespace

std::optional<Eigen::Matrix2d> sighting_information(const MirrorView& view, const Landmark& target,
                                                    const Eigen::Vector2d& p_BL_m, double edge_noise_px) {
  base::Complaints bad;
  bad.require(base::is_positive(edge_noise_px), "edge_noise_px is {} px, must be > 0", edge_noise_px);
  check_radius(bad, target);
  bad.require(std::isfinite(target.top_m), "top of '{}' is {} m, must be a finite number of m", target.name,
              target.top_m);
  bad.raise("sighting_information");

  const auto near_m = near_top_point(view, p_BL_m, target.radius_m, target.top_m);
  if (!near_m || !view.project(*near_m) || !(p_BL_m.norm() > 0)) return std::nullopt;
  const LandmarkOutline outline(view, p_BL_m, target.radius_m, target.top_m);
  return outline.information_px2() / (edge_noise_px * edge_noise_px);
}

}  // namespace twocone::vision
