// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace twocone::bench {

/// The law y = a x^exponent.
struct PowerLaw {
  double exponent = 0;
  double low = 0, high = 0;  ///< 95 % interval, by Student's t from the scatter of log y about the line
};

/// Fits the law by least squares of log y over log x. If the data follow no power law, their scatter makes the interval
/// wide.
/// @param x,y > 0, of equal number, at least three, not all x the same @throws std::invalid_argument otherwise
PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y);

}  // namespace twocone::bench
