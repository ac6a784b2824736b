// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"
#include "localisation/paper_trilateration.h"
#include "tests/numerics/judge.h"

namespace twocone::exact {
namespace {

using Values = std::vector<double>;

// As in measure_vision.cpp, a bound is half the operations on the longest path.
constexpr double kWrapBound = 2;  // sin or cos, atan2
constexpr double kArcBound = 4;   // product, sum, quotient, half, sinc 2, product, product, sum
constexpr double kTriangleBound =
    6;  // difference, hypot, 2 differences, 3 products, root, product, quotient, product, sum, mean
// For 250 fixes with random noise; a second false alarm would have a probability of 1 in 800.
constexpr int kMostFalseAlarms = 1;
constexpr double kFixBound = 8;        // a row and its residual 8, QR and substitution of three columns
constexpr double kPoseBoundBound = 8;  // a row 4, 2 products, up to 5 sums, scaling 2, LDL^T of three columns

void measure_wrap(std::vector<Record>& records, int cases) {
  Record record{"wrap_angle_rad", "angles of 1e-300 to 1e300 rad, against 400 digits", 0, 0, kWrapBound, 0, 0, {}};
  Draw draw(40620);
  for (int i = 0; i < cases; ++i) {
    const double angle = (draw.coin() ? 1 : -1) * (draw.coin() ? draw.scales(1e-300, 1e300) : draw.scales(0.1, 1e6));
    const double exact = wrap_huge(angle);
    // The input is exact, so the answer must be accurate to its own spacing.
    record.take_angle({{Real(exact)}, {std::abs(exact)}}, 0, localisation::wrap_angle_rad(angle), describe({angle}));
  }
  records.push_back(record);
}

void measure_odometry(std::vector<Record>& records, int cases) {
  const std::string of = "turns of 1e-300 to 20 rad, straight on, on the spot, and angles of up to 1e5 rad before";
  Record place{"Odometry::update, place", of, 0, 0, kArcBound, 0, 0, {}};
  Record heading{"Odometry::update, heading", of, 0, 0, kArcBound, 0, 0, {}};
  Draw draw(40630);
  for (int i = 0; i < cases; ++i) {
    const double radius = draw.scales(1e-3, 1);
    const double separation = draw.scales(1e-2, 3);
    Values x = {radius, separation, draw.uniform(-9, 9), draw.uniform(-9, 9),
                draw.uniform(-std::numbers::pi, std::numbers::pi)};
    const double left0 = i % 3 == 0 ? 0 : draw.uniform(-1e5, 1e5);
    const double right0 = i % 3 == 0 ? 0 : draw.uniform(-1e5, 1e5);
    const double way = i % 7 == 0 ? 0 : draw.scales(1e-9, 50);
    const double turn = i % 11 == 0 ? 0 : (draw.coin() ? 1 : -1) * draw.scales(i % 2 == 0 ? 1e-300 : 1e-6, 20);
    x.insert(x.end(), {left0, right0, left0 + (way - turn * separation / 2) / radius,
                       right0 + (way + turn * separation / 2) / radius});
    localisation::Odometry odometry({radius, separation}, {x[2], x[3], x[4]});
    odometry.update(x[5], x[6]);
    const localisation::Pose& pose = odometry.update(x[7], x[8]);
    // Only the wheels' differences count, so the differences are rounded; the readings themselves are exact.
    Vector scale = numbers(x);
    for (Real& s : scale) s = abs(s);
    scale[5] = scale[6] = 0;
    scale[7] = std::abs(x[7] - x[5]);
    scale[8] = std::abs(x[8] - x[6]);
    const Answer answer = evaluate(arc, numbers(x), scale);
    place.take(answer, 0, {pose.x_m, pose.y_m}, describe(x));
    // The previous heading, of up to pi, is rounded in the sum, whatever the result is.
    heading.take_angle(answer, 2, pose.heading_rad, describe(x));
  }
  records.insert(records.end(), {place, heading});
}

void measure_triangle(std::vector<Record>& records, int cases) {
  Record record{"fix_by_triangle",
                "corners of 1e-5 to 1.6 rad, ranges with errors of up to a tenth, origins of up to 1e8 m",
                0,
                0,
                kTriangleBound,
                0,
                0,
                {}};
  Draw draw(40640);
  for (int i = 0; i < cases; ++i) {
    const double far = i % 2 == 0 ? 0 : draw.scales(1, 1e8);
    const double size = draw.scales(1e-3, 1e3);
    const double thin = i % 3 == 0 ? draw.scales(1e-5, 1) : 1;  // landmarks and robot nearly in line
    const auto along = [&] { return far + size * draw.uniform(-1, 1); };
    const auto across = [&] { return -far + size * thin * draw.uniform(-1, 1); };
    const double robot[2] = {along(), across()};
    Values x;
    std::vector<localisation::LandmarkRange> ranges;
    for (int k = 0; k < 3; ++k) {
      const double lx = along();
      const double ly = across();
      const double error = i % 4 == 0 ? draw.uniform(-0.1, 0.1) : 0;
      const double range = std::hypot(lx - robot[0], ly - robot[1]) * (1 + error);
      x.insert(x.end(), {lx, ly, range});
      ranges.push_back({{lx, ly}, range});
    }
    // The quantities that decide the choice of corners must be far above the rounding.
    constexpr double kMargin = 1e-9;
    const auto exact = triangle_centre(numbers(x), kMargin);
    if (!exact) continue;
    const localisation::Fix fix = localisation::fix_by_triangle(ranges);
    // A far origin does not increase the bound: coordinates count by their differences.
    Vector scale;
    for (std::size_t k = 0; k < 9; ++k) {
      double s = x[k];
      for (std::size_t j = k % 3; k % 3 != 2 && j < 9; j += 3) {
        s = j == k % 3 ? 0 : s;
        s = std::max(s, std::abs(x[k] - x[j]));
      }
      scale.push_back(s);
    }
    const auto centre_of = [](const Vector& v) { return *triangle_centre(v, kMargin / 2); };
    const Answer answer = evaluate(centre_of, numbers(x), scale);
    if (!fix.position_m || fix.verdict != localisation::FixVerdict::kOk) {
      record.take(answer, 0, {NAN, NAN}, describe(x));
    } else {
      record.take(answer, 0, {fix.position_m->x(), fix.position_m->y()}, describe(x));
    }
  }
  records.push_back(record);
}

/// The input of a fix, as numbers for the exact problem and as the library takes it.
struct FixCase {
  std::vector<Measured> measured;
  std::vector<localisation::LandmarkMeasurement> measurements;
  Values x;
  Vector scale;  ///< of each entry of x: coordinates count by their distance from the landmarks' middle
};

enum class Kind { kRanges, kBearings, kBoth };

FixCase draw_fix(Draw& draw, Kind kind, int count, double far, bool mixed_sigmas) {
  FixCase c;
  const double robot[3] = {draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(-std::numbers::pi, std::numbers::pi)};
  const double thin = draw.coin() ? draw.scales(1e-3, 1) : 1;
  std::vector<double> distances;
  for (int i = 0; i < count; ++i) {
    localisation::LandmarkMeasurement m;
    m.landmark_m = {far + draw.uniform(-4, 4), -far + thin * draw.uniform(-4, 4)};
    const double dx = (m.landmark_m.x() - far) - robot[0];
    const double dy = (m.landmark_m.y() + far) - robot[1];
    const double sigma_range = mixed_sigmas ? draw.scales(1e-6, 1e-1) : 1e-3 * draw.uniform(0.5, 2);
    const double sigma_bearing = mixed_sigmas ? draw.scales(1e-6, 1e-2) : 1e-4 * draw.uniform(0.5, 2);
    const double rho = draw.uniform(-0.9, 0.9);
    // The noise is well within the stated sigmas, so that nothing counts as an outlier.
    if (kind != Kind::kBearings) m.range_m = std::abs(std::hypot(dx, dy) + sigma_range * draw.uniform(-1, 1) / 2);
    if (kind != Kind::kRanges) {
      m.bearing_rad =
          std::remainder(std::atan2(dy, dx) - robot[2] + sigma_bearing * draw.uniform(-1, 1) / 2, 2 * std::numbers::pi);
    }
    const double both = rho * sigma_range * sigma_bearing;
    m.covariance << sigma_range * sigma_range, both, both, sigma_bearing * sigma_bearing;
    c.measured.push_back({m.range_m.has_value(), m.bearing_rad.has_value()});
    c.measurements.push_back(m);
    c.x.insert(c.x.end(), {m.landmark_m.x(), m.landmark_m.y(), m.range_m.value_or(0), m.bearing_rad.value_or(0),
                           m.covariance(0, 0), m.covariance(0, 1), m.covariance(1, 1)});
  }
  // The library takes no range as more accurate than the doubles that hold it and its landmark: eps of the farthest
  // coordinate and of the problem's size, a power of two, is added to its sigma. At a far origin this matters.
  double size = 0;
  double low[2] = {1e9, 1e9};
  double high[2] = {-1e9, -1e9};
  double farthest = 0;
  for (const auto& m : c.measurements) {
    for (const int k : {0, 1}) {
      low[k] = std::min(low[k], m.landmark_m[k]);
      high[k] = std::max(high[k], m.landmark_m[k]);
      farthest = std::max(farthest, std::abs(m.landmark_m[k]));
    }
    size = std::max(size, m.range_m.value_or(0));
  }
  for (const int k : {0, 1}) size = std::max(size, high[k] - (low[k] / 2 + high[k] / 2));
  const double rounding = std::numeric_limits<double>::epsilon() * (farthest + std::ldexp(1, std::ilogb(size)));
  const double reach = 8;  // greatest distance of a landmark from the landmarks' middle
  for (std::size_t k = 0; k < c.x.size(); ++k) {
    if (k % kMeasurementFields == kVarRange) c.x[k] += rounding * rounding;
    c.scale.push_back(k % kMeasurementFields <= kLandmarkY ? reach : std::abs(c.x[k]));
  }
  return c;
}

void measure_least_squares(std::vector<Record>& records, int cases, Kind kind, const char* name) {
  const std::string of =
      std::string("3 to 6 ") + name + ", nearly in line too, sigmas of 1e-6 to 0.1 mixed, origins of up to 1e8 m";
  Record place{std::string("fix_by_least_squares, ") + name + ": place", of, 0, 0, kFixBound, 0, 0, {}};
  Record heading = place;
  heading.function = std::string("fix_by_least_squares, ") + name + ": heading";
  Record covariance = place;
  covariance.function = std::string("fix_by_least_squares, ") + name + ": covariance";
  covariance.bound = 2 * kFixBound;  // each entry is a product of two columns that were solved for
  Draw draw(40650 + static_cast<unsigned>(kind));
  int false_alarms = 0;
  for (int i = 0; i < cases; ++i) {
    const double far = i % 2 == 0 ? 0 : draw.scales(1, 1e8);
    const FixCase c = draw_fix(draw, kind, (kind == Kind::kBoth ? 3 : 4) + i % 3, far, i % 3 == 0);
    const localisation::Fix fix = localisation::fix_by_least_squares(c.measurements);
    // Where two places or no direction fit the data, there is no single answer to compare with.
    if (fix.verdict != localisation::FixVerdict::kOk) continue;
    // Noise alone counts as a contradiction twice in ten thousand fixes; that answer belongs to another problem.
    if (!fix.outliers.empty()) {
      if (++false_alarms > kMostFalseAlarms)
        throw std::runtime_error(fmt::format("{}: {} false alarms", name, false_alarms));
      continue;
    }
    const PoseProblem problem(c.measured);
    const std::size_t n = problem.unknowns();
    const Vector x = numbers(c.x);
    Vector start = numbers({fix.position_m->x(), fix.position_m->y(), fix.heading_rad.value_or(0)});
    start.resize(n);
    const Vector best = problem.solve_from(start, x);
    Matrix hessian(n, Vector(n));
    static const Real step("1e-18");
    for (std::size_t k = 0; k < n; ++k) {
      Vector up = best;
      up[k] += step;
      const Vector above = problem.gradient(up, x);
      for (std::size_t j = 0; j < n; ++j) hessian[j][k] = above[j] / step;
    }
    const Matrix solver = inverse(hessian);
    const auto answer_of = [&](const Vector& v) {
      const Vector g = problem.gradient(best, v);
      Vector pose = best;
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) pose[k] -= solver[k][j] * g[j];
      }
      Vector out = pose;
      out.resize(3);
      const Matrix inverse_information = inverse(problem.information(pose, v));
      for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < n; ++j) out.push_back(inverse_information[k][j]);
      }
      return out;
    };
    const Answer answer = evaluate(answer_of, x, c.scale);
    const std::string what = fmt::format("case {} of {}: {}", i, name, describe(c.x));
    place.take(answer, 0, {fix.position_m->x(), fix.position_m->y()}, what);
    if (fix.heading_rad) heading.take_angle(answer, 2, *fix.heading_rad, what);
    // Each entry is scaled by the two sigmas to which it belongs.
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t j = 0; j < n; ++j) {
        covariance.take(answer, 3 + n * k + j, {(*fix.covariance)(Eigen::Index(k), Eigen::Index(j)) / fix.widening},
                        what);
      }
    }
  }
  records.push_back(place);
  if (kind != Kind::kRanges) records.push_back(heading);
  records.push_back(covariance);
}

void measure_pose_bound(std::vector<Record>& records, int cases) {
  Record record{"pose_bound",
                "3 to 5 landmarks about the robot, information of rank 1 and 2, sigmas of 1e-6 to 0.1",
                0,
                0,
                kPoseBoundBound,
                0,
                0,
                {}};
  Draw draw(40660);
  for (int i = 0; i < cases; ++i) {
    const localisation::Pose pose{draw.uniform(-3, 3), draw.uniform(-3, 3),
                                  draw.uniform(-std::numbers::pi, std::numbers::pi)};
    Values x = {pose.x_m, pose.y_m};
    std::vector<Eigen::Vector2d> landmarks;
    std::vector<Eigen::Matrix2d> information;
    for (int k = 0; k < 3 + i % 3; ++k) {
      landmarks.emplace_back(draw.uniform(-4, 4), draw.uniform(-4, 4));
      const double a = 1 / draw.scales(1e-6, 1e-1);
      const double b = draw.coin() ? 1 / draw.scales(1e-6, 1e-2) : 0;
      const double rho = b == 0 ? 0 : draw.uniform(-0.9, 0.9);
      Eigen::Matrix2d info;
      info << a * a, rho * a * b, rho * a * b, b * b;
      information.push_back(info);
      x.insert(x.end(), {landmarks.back().x(), landmarks.back().y(), info(0, 0), info(0, 1), info(1, 1)});
    }
    const auto bound = localisation::pose_bound(pose, landmarks, information);
    if (!bound) continue;
    Matrix sum(3, Vector(3));
    const Vector v = numbers(x);
    for (std::size_t at = 2; at < v.size(); at += 5) {
      const Real dx = v[at] - v[0];
      const Real dy = v[at + 1] - v[1];
      const Real r2 = dx * dx + dy * dy;
      const Real r = sqrt(r2);
      const Vector range = {-dx / r, -dy / r, 0};
      const Vector bearing = {dy / r2, -dx / r2, -1};
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t j = 0; j < 3; ++j) {
          sum[k][j] += v[at + 2] * range[k] * range[j] + v[at + 3] * (range[k] * bearing[j] + bearing[k] * range[j]) +
                       v[at + 4] * bearing[k] * bearing[j];
        }
      }
    }
    // The problem is the inverse of a sum that is rounded once it is formed. So its condition is that of the sum,
    // scaled to a unit diagonal: |A| |A^-1| in the Frobenius norm.
    const Matrix exact_bound = inverse(sum);
    Real norm = 0;
    Real inverse_norm = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) {
        norm += sum[k][j] * sum[k][j] / (sum[k][k] * sum[j][j]);
        inverse_norm += exact_bound[k][j] * exact_bound[k][j] * sum[k][k] * sum[j][j];
      }
    }
    const double condition = static_cast<double>(sqrt(norm * inverse_norm));
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) {
        const double size = static_cast<double>(sqrt(exact_bound[k][k] * exact_bound[j][j]));
        record.take({{exact_bound[k][j]}, {condition * size}}, 0, {(*bound)(Eigen::Index(k), Eigen::Index(j))},
                    describe(x));
      }
    }
  }
  records.push_back(record);
}

}  // namespace

std::vector<Record> measure_motion_and_triangles(int cases) {
  std::vector<Record> records;
  measure_wrap(records, cases);
  measure_odometry(records, cases);
  measure_triangle(records, cases);
  return records;
}

// Each case needs a hundred gradients in 50 digits.
std::vector<Record> measure_fixes_by_ranges(int cases) {
  std::vector<Record> records;
  measure_least_squares(records, cases / 8, Kind::kRanges, "ranges");
  return records;
}

std::vector<Record> measure_fixes_by_bearings(int cases) {
  std::vector<Record> records;
  measure_least_squares(records, cases / 8, Kind::kBearings, "bearings");
  return records;
}

std::vector<Record> measure_fixes_by_both(int cases) {
  std::vector<Record> records;
  measure_least_squares(records, cases / 8, Kind::kBoth, "ranges and bearings");
  return records;
}

std::vector<Record> measure_pose_bounds(int cases) {
  std::vector<Record> records;
  measure_pose_bound(records, cases / 8);
  return records;
}

}  // namespace twocone::exact
