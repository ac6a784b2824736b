// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>
#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"

namespace twocone::localisation::least_squares {

/// Up to this number of landmarks are solved without heap.
constexpr int kStackLandmarks = 32;

constexpr double kEps = std::numeric_limits<double>::epsilon();

inline double square(double x) { return x * x; }

/// Origin and unit of a problem's lengths: the middle of the landmarks, and a power of two near the problem's size.
/// Therefore a far origin costs no digits, and 1e150 m or 1e-150 m are as accurate as 1 m.
struct Frame {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();
  double unit_m = 1;
  double rounding = 0;  ///< of a coordinate, in units
};

/// The unknowns, in a Frame.
struct State {
  double x = 0;
  double y = 0;
  double heading_rad = 0;
};

/// One usable measurement in a Frame, with its whitener, the inverse Cholesky factor of its whole covariance (that of
/// its own noise and that of the shared errors):
///   w_r = e_r * range_weight,     w_b = (e_b - bearing_on_range * w_r) * bearing_weight
/// for the range residual e_r and the bearing residual e_b.
struct Landmark {
  double x = 0;
  double y = 0;
  double range = 0;
  double cos_bearing = 1;
  double sin_bearing = 0;
  double range_weight = 0;  // in 1 / unit
  double bearing_weight = 0;
  double bearing_on_range = 0;  // rad per whitened range
  double sigma_bearing_rad = 0;
  int index = 0;  // of the measurement
  bool has_range = false;
  bool has_bearing = false;

  [[nodiscard]] Eigen::Vector2d place() const { return {x, y}; }
  [[nodiscard]] int numbers() const { return int(has_range) + int(has_bearing); }
};

/// Numbers of distinct landmark places. Landmarks at one place count as one, and 3 stands for 3 or more.
struct Places {
  int all = 0;
  int ranged = 0;
  int bearing = 0;
  int both = 0;
};

/// The source of the errors that a problem's measurements share.
struct SharedErrors {
  /// Of which Landmark::index is an index.
  std::span<const LandmarkMeasurement> measurements;
  Frame frame;
  /// A state near the answer. An error of a landmark's place moves its range or its bearing, depending on the direction
  /// in which the landmark is seen. Empty: each place counts with its mean variance in all directions, independent of
  /// the others.
  std::optional<State> seen_from{};

  /// Returns whether there are any shared errors.
  [[nodiscard]] bool any() const;
  /// Returns the number of errors.
  [[nodiscard]] Eigen::Index count() const;
};

struct Problem {
  std::span<const Landmark> landmarks;
  Places places{};
  int numbers = 0;  ///< number of measured ranges and bearings
  bool has_heading = false;
  double rounding = 0;                   ///< of a coordinate, in units
  const SharedErrors* shared = nullptr;  ///< null where the measurements are independent
  /// The inverse of the lower Cholesky factor of the covariance of all numbers, for the residuals in the landmarks'
  /// order, range before bearing. Without rows where the measurements are independent: each landmark then has its own
  /// whitener.
  Eigen::MatrixXd whitener{};

  [[nodiscard]] int unknowns() const { return has_heading ? 3 : 2; }
  /// Returns whether the measurements can determine a pose (a position, without bearings).
  [[nodiscard]] bool is_enough() const {
    return has_heading ? places.all >= 2 && places.ranged + places.bearing >= 3 : places.ranged >= 2;
  }
};

/// Writes the usable ones of `measurements` into `landmarks` (which has room for all), the most accurate first: then
/// Householder's QR keeps each row's own digits however much their sigmas differ. @returns their number
int prepare(std::span<const LandmarkMeasurement> measurements, Frame& frame, Landmark* landmarks);

/// Makes a problem: counts the places and numbers of landmarks in their frame.
/// @param shared null where the measurements are independent; it must outlive the problem
Problem make_problem(std::span<const Landmark> landmarks, double rounding, const SharedErrors* shared = nullptr);

/// The errors of measured minus predicted numbers, range in units before bearing in rad, in the landmarks' order.
struct NumberErrors {
  Eigen::MatrixXd own;  ///< covariance of the numbers' own noise; without SharedErrors::seen_from also of the places
  Eigen::MatrixXd by_shared;  ///< effects of the shared errors, a column each
};
NumberErrors errors_of_numbers(std::span<const Landmark> landmarks, const SharedErrors& shared);

}  // namespace twocone::localisation::least_squares
