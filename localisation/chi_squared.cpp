// SPDX-License-Identifier: Apache-2.0
#include "localisation/chi_squared.h"

#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>

namespace twocone::localisation {

double chi_squared_tail(double value, int degrees_of_freedom) {
  if (std::isnan(value)) return 0;
  if (value <= 0) return 1;
  if (std::isinf(value)) return 0;  // Boost refuses it
  // There is no promotion to long double, which takes time for digits that no caller needs. For a value near 0 and
  // hundreds of degrees of freedom a gamma function in a denominator overflows: its infinity is the correct limit, and
  // no error.
  namespace policies = boost::math::policies;
  using Policy = policies::policy<policies::promote_double<false>, policies::overflow_error<policies::ignore_error>>;
  const boost::math::chi_squared_distribution<double, Policy> distribution(degrees_of_freedom);
  return cdf(complement(distribution, value));
}

}  // namespace twocone::localisation
