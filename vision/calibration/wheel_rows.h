// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "vision/calibration/bundle.h"

namespace twocone::vision::calibration {

/// A row for each two frames in a row of the list between which the wheels were read.
///
/// The slip of an interval is its mean over the interval, of a Gauss-Markov process of time constant tau and
/// variance 1. With x = dt / tau its variance is 2 (x - 1 + exp(-x)) / x^2, its covariance with the interval before (1
/// - exp(-x)) (1 - exp(-y)) / (x y). Longer memory than one interval is left out: it is that of a first-order process
/// too, to the square of x.
/// @param needs_twists leave out a way one of whose ends has no twist: its latency would be taken for none
std::vector<WheelRow> wheel_rows(const std::vector<const CalibrationFrame*>& frames, const WheelBelief& wheels,
                                 bool needs_twists);

/// Variance of the mean of that process over `x` time constants.
double mean_slip_variance(double x);

}  // namespace twocone::vision::calibration
