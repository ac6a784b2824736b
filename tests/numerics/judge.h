// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/numerics/exact.h"

namespace twocone::exact {

/// An exact answer and its absolute condition, which is its change by a relative change of one rounding in every input
/// and in the answer: growth_k = |f_k| + sum over i of |df_k / dx_i| scale_i. Times eps, it is the error that no
/// algorithm in doubles can avoid.
struct Answer {
  Vector value;
  std::vector<double> growth;
};

/// Evaluates by differences of 1e-15 scale_i in 50 digits: the slopes are accurate to some 30 digits.
/// @param scale of each input, >= 0: its own size; for a coordinate of which only differences count, the size of the
/// differences; 0 for an input that is not a number but a choice
Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x, const Vector& scale);
/// As above with scale |x|.
Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x);

/// Worst error / (growth eps) of one function over its cases.
struct Record {
  std::string function;
  std::string cases_of;  ///< description of the generated cases
  int cases = 0;
  double worst = 0;        ///< greatest error / (growth eps)
  double bound = 0;        ///< bound of error / (growth eps)
  double worst_error = 0;  ///< in the answer's unit, in the worst case
  double worst_growth = 0;
  std::string worst_case;

  /// Takes the outputs [first, first + got.size()) of an answer together: norm of the errors over norm of the growths.
  void take(const Answer& answer, std::size_t first, const std::vector<double>& got, const std::string& what);
  /// As take(), for an angle, whose error is taken around the circle.
  void take_angle(const Answer& answer, std::size_t index, double got, const std::string& what);

 private:
  void add(double error, double growth, const std::string& what);
};

/// Random numbers for cases.
class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  /// Uniform in the logarithm. @param low > 0
  double scales(double low, double high);
  bool coin() { return uniform(0, 1) < 0.5; }

 private:
  std::mt19937_64 random_;
};

std::string describe(const std::vector<double>& x);

/// The public numerical functions in groups, each with some `cases` generated cases (an eighth of them where a case is
/// expensive).
using Measure = std::function<std::vector<Record>(int cases)>;
std::vector<std::pair<std::string, Measure>> measures();

std::vector<Record> measure_views(int cases);
std::vector<Record> measure_ranges(int cases);
std::vector<Record> measure_motion_and_triangles(int cases);
std::vector<Record> measure_fixes_by_ranges(int cases);
std::vector<Record> measure_fixes_by_bearings(int cases);
std::vector<Record> measure_fixes_by_both(int cases);
std::vector<Record> measure_pose_bounds(int cases);

}  // namespace twocone::exact
