// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace twocone::bench {

/// y = a x^exponent.
struct PowerLaw {
  double exponent = 0;
  double low = 0, high = 0;  ///< 95 %: by Student's t from the scatter of log y about the line
};

/// Least squares of log y over log x. Where a power law is no law of theirs, the scatter says so and the interval is
/// wide.
/// @param x,y > 0, as many, at least three, not all x the same @throws std::invalid_argument otherwise
PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y);

}  // namespace twocone::bench
