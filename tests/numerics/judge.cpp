// SPDX-License-Identifier: Apache-2.0
#include "tests/numerics/judge.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::exact {

Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x, const Vector& scale) {
  static const Real step("1e-15");
  Answer answer{f(x), {}};
  for (const Real& v : answer.value) answer.growth.push_back(static_cast<double>(abs(v)));
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (scale[i] == 0) continue;
    Vector up = x;
    Vector down = x;
    up[i] += step * scale[i];
    down[i] -= step * scale[i];
    const Vector above = f(up);
    const Vector below = f(down);
    for (std::size_t k = 0; k < answer.value.size(); ++k) {
      // An angle may jump by a turn between the two; no other answer changes by nearly as much.
      Real change = abs(above[k] - below[k]);
      if (change > 6 && change < 7) change = abs(change - 2 * pi());
      answer.growth[k] += static_cast<double>(change / (2 * step));
    }
  }
  return answer;
}

Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x) {
  Vector scale;
  for (const Real& v : x) scale.push_back(abs(v));
  return evaluate(f, x, scale);
}

void Record::add(double error, double growth, const std::string& what) {
  ++cases;
  double ratio = error == 0 ? 0 : error / (growth * std::numeric_limits<double>::epsilon());
  if (std::isnan(ratio)) ratio = std::numeric_limits<double>::infinity();  // no answer is the worst result
  if (ratio > worst) {
    worst = ratio;
    worst_error = error;
    worst_growth = growth;
    worst_case = what;
  }
}

void Record::take(const Answer& answer, std::size_t first, const std::vector<double>& got, const std::string& what) {
  double error = 0;
  double growth = 0;
  for (std::size_t k = 0; k < got.size(); ++k) {
    error = std::hypot(error, static_cast<double>(Real(got[k]) - answer.value[first + k]));
    growth = std::hypot(growth, answer.growth[first + k]);
  }
  add(error, growth, what);
}

void Record::take_angle(const Answer& answer, std::size_t index, double got, const std::string& what) {
  add(static_cast<double>(abs(wrap(Real(got) - answer.value[index]))), answer.growth[index], what);
}

double Draw::scales(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }

std::vector<std::pair<std::string, Measure>> measures() {
  return {{"Views", measure_views},
          {"Ranges", measure_ranges},
          {"MotionAndTriangles", measure_motion_and_triangles},
          {"FixesByRanges", measure_fixes_by_ranges},
          {"FixesByBearings", measure_fixes_by_bearings},
          {"FixesByBoth", measure_fixes_by_both},
          {"PoseBounds", measure_pose_bounds}};
}

std::string describe(const std::vector<double>& x) { return fmt::format("[{:.17g}]", fmt::join(x, ", ")); }

}  // namespace twocone::exact
