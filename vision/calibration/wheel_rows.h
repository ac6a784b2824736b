// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// Makes a row for every two consecutive frames of the list between which the wheels were read.
///
/// The slip of an interval is the mean over the interval of a Gauss-Markov process with time constant tau and
/// variance 1. With x = dt / tau its variance is 2 (x - 1 + exp(-x)) / x^2, and its covariance with the previous
/// interval is (1 - exp(-x)) (1 - exp(-y)) / (x y). Memory beyond one interval is neglected: up to the square of x, it
/// is that of a first-order process.
/// @param needs_twists leave out a row if one of its ends has no twist, since its latency would count as 0
std::vector<WheelRow> wheel_rows(const std::vector<CalibrationFrame>& frames, const WheelBelief& wheels,
                                 bool needs_twists);

/// Variance of the mean of that process over `x` time constants.
double mean_slip_variance(double x);

}  // namespace twocone::vision::calibration
