// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace twocone::vision {

/// Lens distortion of a pinhole image: OpenCV's model, about `principal_px` in units of `focal_px`.
struct LensDistortion {
  std::vector<double> coefficients;                    ///< k1 k2 p1 p2 [k3 [k4 k5 k6]]: 4, 5 or 8 numbers
  Eigen::Vector2d focal_px = Eigen::Vector2d::Zero();  ///< fx, fy, > 0
  Eigen::Vector2d principal_px = Eigen::Vector2d::Zero();

  friend bool operator==(const LensDistortion&, const LensDistortion&) = default;
};

/// A pixel and its derivative by the n arguments that it was computed from (2 x n).
template <int n>
struct PixelWithJacobian {
  Eigen::Vector2d pixel_px;
  Eigen::Matrix<double, 2, n> jacobian;
};

/// Maps the pinhole image to the lens's image, and back. With (x, y) = (p - principal) / focal and r^2 = x^2 + y^2:
///
///     x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2),
///     y' = y (the same)                                                      + p1 (r^2 + 2 y^2) + 2 p2 x y.
///
/// Far enough out such a polynomial folds the image over itself. There (determinant of its Jacobian not > 0, or
/// denominator not > 0) neither direction has an answer. Where a model unfolds again still farther out, distort()
/// answers, but undistort() may find the inner of the two points; a real lens, fitted where it has data, is not used
/// there.
///
/// Error growth: both directions are accurate to a few roundings of a pixel's coordinate times the condition of the
/// Jacobian.
class Lens {
 public:
  /// @throws std::invalid_argument naming every field outside its domain
  explicit Lens(const LensDistortion& distortion);

  /// Returns whether all coefficients are zero, so that both directions only add roundings.
  [[nodiscard]] bool is_neutral() const;

  [[nodiscard]] std::optional<Eigen::Vector2d> distort(const Eigen::Vector2d& pinhole_px) const;
  /// As distort(), with the derivative by `pinhole_px`.
  [[nodiscard]] std::optional<PixelWithJacobian<2>> distort_with_jacobian(const Eigen::Vector2d& pinhole_px) const;
  /// Newton's method, at most kSteps steps. Nothing where it does not converge, and for input that is not finite.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& pixel) const;

 private:
  struct Bent {
    Eigen::Vector2d at;
    Eigen::Matrix2d jacobian;
  };
  /// Distorts a point, in units of the focal length.
  [[nodiscard]] std::optional<Bent> bend(const Eigen::Vector2d& straight) const;

  static constexpr int kSteps = 30;
  std::array<double, 8> k_{};  ///< k1 k2 p1 p2 k3 k4 k5 k6
  Eigen::Array2d focal_px_;
  Eigen::Array2d principal_px_;
};

}  // namespace twocone::vision
