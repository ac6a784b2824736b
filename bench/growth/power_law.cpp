// SPDX-License-Identifier: Apache-2.0
#include "bench/growth/power_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace twocone::bench {
namespace {

/// Returns the 97.5 % quantile of Student's t. Beyond 10 degrees of freedom it returns about the quantile of 10, which
/// is too large rather than too small.
double t_quantile(std::size_t degrees_of_freedom) {
  constexpr std::array kT{12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};
  return degrees_of_freedom <= kT.size() ? kT.at(degrees_of_freedom - 1) : 2.23;
}

}  // namespace

PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y) {
  const auto bad = [](double v) { return !(v > 0) || !std::isfinite(v); };
  if (x.size() != y.size() || x.size() < 3 || std::any_of(x.begin(), x.end(), bad) ||
      std::any_of(y.begin(), y.end(), bad)) {
    throw std::invalid_argument("a power law needs three points or more, all of them > 0");
  }
  const auto n = double(x.size());
  double mean_x = 0;
  double mean_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    mean_x += std::log(x[i]) / n;
    mean_y += std::log(y[i]) / n;
  }
  double xx = 0;
  double xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = std::log(x[i]) - mean_x;
    xx += dx * dx;
    xy += dx * (std::log(y[i]) - mean_y);
  }
  if (xx == 0) throw std::invalid_argument("a power law needs two different sizes or more");
  const double slope = xy / xx;
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = std::log(y[i]) - mean_y - slope * (std::log(x[i]) - mean_x);
    squares += off * off;
  }
  const double half = t_quantile(x.size() - 2) * std::sqrt(squares / (n - 2) / xx);
  return {slope, slope - half, slope + half};
}

}  // namespace twocone::bench
