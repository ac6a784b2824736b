// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"

namespace twocone::localisation::least_squares {

/// A Gaussian of (x m, y m, heading rad).
struct Gaussian {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

/// What is known of a pose after measurements, when something was known before.
struct Posterior {
  enum class Kind {
    kGaussian,     ///< `pose` holds it
    kNotGaussian,  ///< no ellipse would be honest: bent, or more than one place
    kNothing,      ///< no measurement is usable, or the prior has no covariance
  };
  Kind kind = Kind::kNothing;
  Gaussian pose;
  /// Chi-squared at the likeliest pose, of the measurements and of the prior together.
  double chi_squared = 0;
};

/// Updates a pose by the measurements themselves rather than by a fix of them: the likeliest pose by Gauss-Newton about
/// the prior's place (an iterated Kalman update), so that no tangent is taken where the robot is not.
///
/// Honest regions before more information. The posterior is looked at on a sphere of three sigmas round the likeliest
/// pose, in 26 directions: where chi-squared there is not what an ellipse promises, because the arc of a range is bent
/// within what is not known along it, or where a second place is left, kNotGaussian comes instead of an ellipse.
/// @param widening factor on the measurements' covariances (Fix::widening), > 0
Posterior update(const Gaussian& prior, std::span<const LandmarkMeasurement> measurements, double widening);

}  // namespace twocone::localisation::least_squares
