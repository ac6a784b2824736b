// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>

#include "localisation/fix.h"
#include "localisation/least_squares/solver.h"

namespace twocone::localisation::least_squares {

/// The distribution of a pose, (x m, y m, heading rad), after measurements, given a prior.
struct Posterior {
  enum class Kind {
    kGaussian,     ///< an ellipse describes it: that of the prior updated by `measurement`
    kNotGaussian,  ///< no ellipse would be correct: it is bent, or there is more than one place
    kNothing,      ///< no measurement is usable, or the prior has no covariance
  };
  Kind kind = Kind::kNothing;
  /// Chi-squared at the most likely pose, of the measurements and of the prior together.
  double chi_squared = 0;
  /// The measurements, linearised at the most likely pose, with `error` at the prior's mean; in m and rad.
  LinearMeasurement measurement{};
};

/// Updates a pose by the measurements themselves rather than by a fix of them. It finds the most likely pose by
/// Gauss-Newton about the prior's place (an iterated Kalman update), so it never linearises far from the robot.
///
/// Correct regions have priority over more information. The posterior is tested on a sphere of three sigmas round the
/// most likely pose, in 26 directions. The result is kNotGaussian instead of an ellipse where chi-squared there differs
/// from that of an ellipse, because the arc of a range is bent within the uncertainty along it, or where a second place
/// remains.
/// @param mean,covariance of the prior, which is a Gaussian
/// @param widening factor on the measurements' covariances (Fix::widening), > 0
Posterior update(const Eigen::Vector3d& mean, const Eigen::Matrix3d& covariance,
                 std::span<const LandmarkMeasurement> measurements, double widening);

}  // namespace twocone::localisation::least_squares
