// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <span>

#include <Eigen/Core>

#include "localisation/least_squares_fix.h"

namespace twocone::localisation::least_squares {

/// So many landmarks are solved without heap.
constexpr int kStackLandmarks = 32;

constexpr double kEps = std::numeric_limits<double>::epsilon();

/// Where lengths of a problem are measured from and in what: the middle of the landmarks, and a power of two near the
/// problem's size. So a far origin costs no digits, and 1e150 m or 1e-150 m are as good as 1 m.
struct Frame {
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();
  double unit_m = 1;
};

/// The unknowns, in a Frame.
struct State {
  double x = 0;
  double y = 0;
  double heading_rad = 0;
};

/// One usable measurement in a Frame, with what whitens it: the inverse Cholesky factor of its covariance,
///   range residual  e_r -> e_r * range_weight,     bearing residual  e_b -> (e_b - bearing_on_range * that) *
///   bearing_weight.
struct Landmark {
  double x;
  double y;
  double range;
  double cos_bearing;
  double sin_bearing;
  double range_weight;  // in 1 / unit
  double bearing_weight;
  double bearing_on_range;  // rad a whitened range
  double sigma_bearing_rad;
  int index;  // of the measurement
  bool has_range;
  bool has_bearing;

  [[nodiscard]] int numbers() const { return int(has_range) + int(has_bearing); }
};

/// How much there is to go on; landmarks in one place count as one, and 3 stands for 3 or more.
struct Places {
  int all = 0;
  int ranged = 0;
  int bearing = 0;
  int both = 0;
};

struct Problem {
  std::span<const Landmark> landmarks;
  Places places{};
  int numbers = 0;  ///< measured
  bool has_heading = false;
  double rounding = 0;  ///< of a coordinate, in units

  [[nodiscard]] int unknowns() const { return has_heading ? 3 : 2; }
  /// Whether a pose (a position, without bearings) follows at all.
  [[nodiscard]] bool is_enough() const {
    return has_heading ? places.all >= 2 && places.ranged + places.bearing >= 3 : places.ranged >= 2;
  }
};

/// The usable ones of `measurements` into `landmarks` (room for all), the surest first: Householder's QR then keeps
/// each row's own digits however far their sigmas differ. @returns how many
int prepare(std::span<const LandmarkMeasurement> measurements, Frame& frame, double& rounding, Landmark* landmarks);

/// Counts places and numbers of landmarks in their frame.
Problem make_problem(std::span<const Landmark> landmarks, double rounding);

}  // namespace twocone::localisation::least_squares
