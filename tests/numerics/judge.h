// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/numerics/exact.h"

namespace twocone::exact {

/// An exact answer, and how far a relative change of one rounding in every input, and in the answer, moves it:
/// growth_k = |f_k| + sum over i of |df_k / dx_i| scale_i. That is the absolute condition; with eps before it, it is
/// the error that no algorithm in doubles can be blamed for.
struct Answer {
  Vector value;
  std::vector<double> growth;
};

/// Differences of 1e-15 scale_i in 50 digits: the slopes are right to some 30 digits.
/// @param scale of each input, >= 0: its own size, or for a coordinate that only differences of count that of those
/// differences; 0 for an input that is no number but a choice
Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x, const Vector& scale);
/// With scale |x|.
Answer evaluate(const std::function<Vector(const Vector&)>& f, const Vector& x);

/// Worst error / (growth eps) of one function over its cases.
struct Record {
  std::string function;
  std::string cases_of;  ///< what was generated
  int cases = 0;
  double worst = 0;        ///< of error / (growth eps)
  double bound = 0;        ///< on that
  double worst_error = 0;  ///< in the answer's unit, in that case
  double worst_growth = 0;
  std::string worst_case;

  /// Takes the outputs [first, first + got.size()) of an answer together: norm of the errors over norm of the growths.
  void take(const Answer& answer, std::size_t first, const std::vector<double>& got, const std::string& what);
  /// The same for an angle, whose error is taken around the circle.
  void take_angle(const Answer& answer, std::size_t index, double got, const std::string& what);

 private:
  void add(double error, double growth, const std::string& what);
};

/// Numbers to draw cases from.
class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  /// Evenly in the logarithm. @param low > 0
  double scales(double low, double high);
  bool coin() { return uniform(0, 1) < 0.5; }

 private:
  std::mt19937_64 random_;
};

std::string describe(const std::vector<double>& x);

/// The public numerical functions in groups, each over some `cases` generated cases (an eighth where one is dear).
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
