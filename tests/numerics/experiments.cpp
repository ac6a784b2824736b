// SPDX-License-Identifier: Apache-2.0
#include "tests/numerics/experiments.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <fmt/format.h>

#include "localisation/least_squares_fix.h"
#include "localisation/odometry.h"
#include "localisation/paper_trilateration.h"
#include "tests/numerics/formulas.h"
#include "tests/numerics/judge.h"
#include "tests/support/disparity_range.h"
#include "vision/triangulation.h"

namespace twocone::numerics {
namespace {

using exact::Draw;
using exact::Real;
using exact::Vector;

double to_double(const Real& x) { return static_cast<double>(x); }
double distance(const Real& dx, const Real& dy) { return to_double(sqrt(dx * dx + dy * dy)); }

/// The largest error at each x, and the number of invalid answers (NaN, infinite).
class Worst {
 public:
  void add(double x, double error) {
    ++count_;
    if (!std::isfinite(error)) {
      ++without_;
      return;
    }
    double& worst = at_.try_emplace(x, 0).first->second;
    worst = std::max(worst, error);
  }
  [[nodiscard]] Series series(std::string name, Look look) const {
    return {std::move(name), look, {at_.begin(), at_.end()}};
  }
  [[nodiscard]] double at(double x) const { return at_.contains(x) ? at_.at(x) : NAN; }
  [[nodiscard]] double largest() const {
    double worst = 0;
    for (const auto& [x, error] : at_) worst = std::max(worst, error);
    return worst;
  }
  [[nodiscard]] int without() const { return without_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  std::map<double, double> at_;
  int without_ = 0;
  int count_ = 0;
};

/// 10^(from / per), ..., 10^(to / per).
std::vector<double> decades(int from, int to, int per) {
  std::vector<double> x;
  for (int k = from; k <= to; ++k) x.push_back(std::pow(10.0, double(k) / per));
  return x;
}

struct Four {
  Worst textbook_float, textbook_double, ours_float, ours_double;
  [[nodiscard]] std::vector<Series> series(const std::string& textbook, const std::string& ours) const {
    return {textbook_float.series(textbook + ", float", Look::kTextbookFloat),
            textbook_double.series(textbook + ", double", Look::kTextbookDouble),
            ours_float.series(ours + ", float", Look::kOursFloat),
            ours_double.series(ours + ", double", Look::kOursDouble)};
  }
};

template <class T>
void cross_circles(Draw& draw, double gap, Worst& textbook, Worst& ours) {
  const T a = T(draw.uniform(0.5, 2));
  const T b = T(draw.uniform(0.5, 2));
  const T apart = T(double(a) + double(b) - gap * (double(a) + double(b)));
  const Real closing = Real(a) + Real(b) - Real(apart);
  if (closing <= 4 * std::numeric_limits<T>::epsilon() * Real(apart)) return;  // the circles touch, to rounding
  // The height h follows from 4 d h = sqrt of Heron's product.
  const Real d = apart;
  const Real half_chord = sqrt((Real(a) + b + d) * closing * (d + Real(a) - b) * (d - Real(a) + b)) / (2 * d);
  const auto error = [&](T got) { return to_double(abs(Real(got) - half_chord) / half_chord); };
  const T by_textbook = formulas::half_chord_textbook(apart, a, b);
  textbook.add(gap, std::isfinite(by_textbook) ? error(by_textbook) : NAN);
  ours.add(gap, error(formulas::half_chord_ours(apart, a, b)));
}

template <class T>
void trilaterate(Draw& draw, double offset, Worst& textbook, Worst& ours, Worst* library) {
  // As for a real robot, the position is not a number of the type.
  const Real truth[2] = {Real(offset) + draw.uniform(1, 2), Real(offset) + draw.uniform(1, 2)};
  std::array<formulas::Range<T>, 3> m;
  const double base = draw.uniform(-std::numbers::pi, std::numbers::pi);
  for (std::size_t i = 0; i < 3; ++i) {
    const double direction = base + 2 * double(i) + draw.uniform(-0.3, 0.3);
    const double range = draw.uniform(1, 3);
    m[i].landmark = {T(to_double(truth[0] + range * std::cos(direction))),
                     T(to_double(truth[1] + range * std::sin(direction)))};
    m[i].range = T(distance(Real(m[i].landmark.x()) - truth[0], Real(m[i].landmark.y()) - truth[1]));
  }
  const auto error = [&](const auto& p) { return distance(Real(p.x()) - truth[0], Real(p.y()) - truth[1]); };
  const auto checked = [&](const auto& p) { return p.allFinite() ? error(p) : NAN; };
  textbook.add(offset, checked(formulas::trilaterate_textbook(m)));
  if constexpr (std::is_same_v<T, double>) {
    std::vector<localisation::LandmarkRange> ranges;
    std::vector<localisation::LandmarkMeasurement> measurements;
    for (const auto& r : m) {
      ranges.push_back({r.landmark, r.range});
      measurements.push_back({r.landmark, r.range, std::nullopt, 1e-6 * Eigen::Matrix2d::Identity()});
    }
    const auto of = [&](const localisation::Fix& fix) { return fix.position_m ? error(*fix.position_m) : NAN; };
    ours.add(offset, of(localisation::fix_by_triangle(ranges)));
    library->add(offset, of(localisation::fix_by_least_squares(measurements)));
  } else {
    ours.add(offset, checked(formulas::trilaterate_ours(m)));
  }
}

template <class T>
void drive_arc(Draw& draw, double turn_rate, Worst& textbook, Worst& ours) {
  const T heading = T(draw.uniform(-3, 3));
  const T way = T(draw.uniform(0.05, 0.15));
  const T turn = T(turn_rate * 0.1);
  const auto error = [](const auto& got, const Vector& exact) {
    return distance(Real(got.x) - exact[0], Real(got.y) - exact[1]);
  };
  const auto end = [&](const Real& w, const Real& t) {
    return Vector{w / t * (sin(Real(heading) + t) - sin(Real(heading))),
                  -w / t * (cos(Real(heading) + t) - cos(Real(heading)))};
  };
  const formulas::Place<T> by_textbook = formulas::arc_textbook(way, turn, heading);
  textbook.add(turn_rate, std::isfinite(by_textbook.x) ? error(by_textbook, end(way, turn)) : NAN);
  if constexpr (std::is_same_v<T, double>) {
    // The wheels have a radius of 1 m and are 1 m apart, so angles are metres.
    const double left = way - turn / 2;
    const double right = way + turn / 2;
    localisation::Odometry odometry({1, 1}, {0, 0, heading});
    odometry.update(0, 0);
    const localisation::Pose& pose = odometry.update(left, right);
    const Vector x = exact::numbers({1, 1, 0, 0, heading, 0, 0, left, right});
    ours.add(turn_rate, error(formulas::Place<double>{pose.x_m, pose.y_m}, exact::arc(x)));
  } else {
    ours.add(turn_rate, error(formulas::arc_ours(way, turn, heading), end(way, turn)));
  }
}

template <class T>
void solve_mixed(Draw& draw, double ratio, Worst& textbook, Worst& ours) {
  constexpr int kRows = 6;
  formulas::Rows<T, kRows> j;
  formulas::Column<T, kRows> e;
  formulas::Column<T, kRows> sigma;
  const double step[2] = {draw.uniform(-1, 1), draw.uniform(-1, 1)};
  for (int i = 0; i < kRows; ++i) {
    const double direction = draw.uniform(-std::numbers::pi, std::numbers::pi);
    const double s = i == 2 ? 1 / ratio : draw.uniform(0.5, 1);  // one accurate range among others
    j.row(i) << T(std::cos(direction)), T(std::sin(direction));
    e[i] = T(step[0] * std::cos(direction) + step[1] * std::sin(direction) + s * draw.uniform(-1, 1));
    sigma[i] = T(s);
  }
  exact::Matrix a(2, Vector(2));
  Vector b(2);
  for (int i = 0; i < kRows; ++i) {
    const Real w = 1 / (Real(sigma[i]) * Real(sigma[i]));
    for (int k = 0; k < 2; ++k) {
      for (int l = 0; l < 2; ++l) a[std::size_t(k)][std::size_t(l)] += w * j(i, k) * Real(j(i, l));
      b[std::size_t(k)] += w * j(i, k) * Real(e[i]);
    }
  }
  const Vector right = exact::solve(a, b);
  const double size = distance(right[0], right[1]);
  const auto error = [&](const formulas::Point<T>& p) {
    return p.allFinite() ? distance(Real(p.x()) - right[0], Real(p.y()) - right[1]) / size : NAN;
  };
  textbook.add(ratio, error(formulas::step_textbook<T, kRows>(j, e, sigma)));
  ours.add(ratio, error(formulas::step_ours<T, kRows>(j, e, sigma)));
}

template <class T>
void measure_angle(Draw& draw, double angle, Worst& textbook, Worst& ours) {
  const double from = draw.uniform(-std::numbers::pi, std::numbers::pi);
  const formulas::Point<T> u(T(std::cos(from)), T(std::sin(from)));
  const formulas::Point<T> v(T(std::cos(from + angle)), T(std::sin(from + angle)));
  const Real right = abs(atan2(Real(u.x()) * Real(v.y()) - Real(u.y()) * Real(v.x()),
                               Real(u.x()) * Real(v.x()) + Real(u.y()) * Real(v.y())));
  const auto error = [&](T got) { return std::isfinite(got) ? to_double(abs(Real(got) - right)) : NAN; };
  textbook.add(angle, error(formulas::angle_textbook(u, v)));
  ours.add(angle, error(formulas::angle_ours(u, v)));
}

}  // namespace

Experiment circles_near_tangency(int draws) {
  Four four;
  Draw draw(40801);
  for (const double gap : decades(-60, 0, 4)) {
    if (gap > 0.3) continue;
    for (int i = 0; i < draws; ++i) {
      cross_circles<float>(draw, gap, four.textbook_float, four.ours_float);
      cross_circles<double>(draw, gap, four.textbook_double, four.ours_double);
    }
  }
  const double shown = std::pow(10.0, -12);
  return {
      "stability_circles",
      "Circles that nearly touch",
      "Half the chord of two circles of radius 0.5 to 2 m whose centres are nearer to each other than the radii's sum "
      "by "
      "a small part of it. Textbook: the law of cosines, `sqrt(a^2 - ((d^2 + a^2 - b^2) / 2 d)^2)`. Ours: Kahan's form "
      "of "
      "Heron's formula, transcribed from localisation/paper_trilateration.cpp for both types. Where the gap is within "
      "4 eps the circles touch, and no series goes on.",
      "gap over the sum of the radii",
      "relative error of the half chord",
      {1e-15, 1},
      {1e-17, 10},
      four.series("law of cosines", "Kahan-Heron"),
      fmt::format(
          "At a gap of 1e-12 the law of cosines in double is off by {:.1e} of the chord, Kahan's form by {:.1e}; over "
          "all gaps the law of cosines reaches {:.1e} in double and {:.1e} in float ({} and {} answers were no "
          "number), while "
          "Kahan's form stays below {:.1e} and {:.1e}.",
          four.textbook_double.at(shown), four.ours_double.at(shown), four.textbook_double.largest(),
          four.textbook_float.largest(), four.textbook_double.without(), four.textbook_float.without(),
          four.ours_double.largest(), four.ours_float.largest())};
}

Experiment trilateration_far_from_the_origin(int draws) {
  Four four;
  Worst library;
  Draw draw(40802);
  for (const double offset : decades(0, 32, 4)) {
    for (int i = 0; i < draws; ++i) {
      // Beyond this offset, three landmarks a few metres apart are no longer three different points in float.
      if (offset < 2e5) trilaterate<float>(draw, offset, four.textbook_float, four.ours_float, nullptr);
      trilaterate<double>(draw, offset, four.textbook_double, four.ours_double, &library);
    }
  }
  Experiment e{"stability_origin",
               "Landmarks far from the origin",
               "The place of a robot from three landmarks 1 to 3 m from it, all of them some way from the origin, with "
               "ranges right "
               "to rounding. Textbook: one circle's equation subtracted from the others', solved directly. Ours: "
               "fix_by_triangle and "
               "fix_by_least_squares (double), and fix_by_triangle transcribed (float). Half the spacing of the type's "
               "numbers is the "
               "least error that any answer there can promise.",
               "coordinates of the place / m",
               "error of the place / m",
               {1, 1e8},
               {1e-17, 100},
               four.series("linearised", "triangle"),
               {}};
  e.series.push_back(library.series("least squares, double", Look::kReference));
  const double far = std::pow(10.0, 8);
  e.conclusion = fmt::format(
      "At 1e8 m the linearised form in double is off by {:.2g} m, fix_by_triangle by {:.1e} m and fix_by_least_squares "
      "by {:.1e} m, "
      "where neighbouring doubles are 1.5e-8 m apart; near the origin (1 m) all three are off by less than {:.0e} m.",
      four.textbook_double.at(far), four.ours_double.at(far), library.at(far),
      std::pow(10,
               std::ceil(std::log10(std::max({four.textbook_double.at(1), four.ours_double.at(1), library.at(1)})))));
  return e;
}

Experiment arcs_of_little_turn(int draws) {
  Four four;
  Draw draw(40803);
  for (const double rate : decades(-60, 0, 4)) {
    for (int i = 0; i < draws; ++i) {
      drive_arc<float>(draw, rate, four.textbook_float, four.ours_float);
      drive_arc<double>(draw, rate, four.textbook_double, four.ours_double);
    }
  }
  return {"stability_arc",
          "Arcs that are nearly straight",
          "The end of an arc of 0.05 to 0.15 m driven in 0.1 s. Textbook: speed over turn rate, `v / w (sin(heading + "
          "w t) - "
          "sin heading)`. Ours: the chord by sin(x) / x; Odometry itself (double), transcribed (float).",
          "turn rate / (rad/s)",
          "error of the place / m",
          {1e-15, 1},
          {1e-19, 1},
          four.series("v / w", "sinc"),
          fmt::format("At 1e-9 rad/s v / w is off by {:.1e} m in double and by {:.1e} m in float on a way of a tenth "
                      "of a metre, the "
                      "sinc form by {:.1e} m and {:.1e} m; over all turn rates the sinc form stays below {:.1e} m in "
                      "double and {:.1e} m "
                      "in float.",
                      four.textbook_double.at(std::pow(10.0, -9)), four.textbook_float.at(std::pow(10.0, -9)),
                      four.ours_double.at(std::pow(10.0, -9)), four.ours_float.at(std::pow(10.0, -9)),
                      four.ours_double.largest(), four.ours_float.largest())};
}

Experiment least_squares_of_mixed_sigmas(int draws) {
  Four four;
  Draw draw(40804);
  for (const double ratio : decades(0, 32, 4)) {
    for (int i = 0; i < draws; ++i) {
      solve_mixed<float>(draw, ratio, four.textbook_float, four.ours_float);
      solve_mixed<double>(draw, ratio, four.textbook_double, four.ours_double);
    }
  }
  const double shown = std::pow(10.0, 6);
  return {"stability_sigmas",
          "Sure and unsure measurements in one fit",
          "One step of a fit of two unknowns to six ranges, one of which is more accurate by the ratio of "
          "their sigmas. "
          "Textbook: normal equations, (J^T W J)^-1 J^T W e, by Cholesky's LDL^T. Ours: Householder's QR of the rows "
          "over their sigmas, "
          "the most accurate first; transcribed from localisation/least_squares for both types.",
          "ratio of the sigmas",
          "relative error of the step",
          {1, 1e8},
          {1e-17, 1e3},
          four.series("normal equations", "whitened QR"),
          fmt::format("At a ratio of 1e6 the normal equations in double are off by {:.1e} of the step, QR by {:.1e}; "
                      "over all ratios QR "
                      "stays below {:.1e} in double and {:.1e} in float, while the normal equations reach {:.1e} and "
                      "{:.1e}, without any "
                      "number in {} and {} cases.",
                      four.textbook_double.at(shown), four.ours_double.at(shown), four.ours_double.largest(),
                      four.ours_float.largest(), four.textbook_double.largest(), four.textbook_float.largest(),
                      four.textbook_double.without(), four.textbook_float.without())};
}

Experiment ranges_of_little_disparity(int draws) {
  // The lab's rig: v s = 212.4 px m, d = 0.12 m.
  const vision::DisparityGeometry g{708, 0.3, 0.12, 236};
  constexpr double kSigma_px = 0.1;
  const int noises = draws * 100;
  Series mean_range{"mean of the ranges", Look::kTextbookDouble, {}};
  Series second_order{"(sigma / disparity)^2", Look::kReference, {}};
  Series mean_inverse{"mean of the inverse ranges", Look::kOursDouble, {}};
  double bias_at_3 = NAN;
  double inverse_at_3 = NAN;
  double no_range_at_1 = NAN;
  double answered_at_1 = NAN;
  for (int k = -2; k <= 12; ++k) {
    const double ratio = std::pow(10.0, k / 8.0);
    const double disparity = ratio * kSigma_px;
    std::mt19937_64 random(40805);
    std::normal_distribution<double> noise(0, kSigma_px);
    double ranges = 0;
    double inverses = 0;
    int positive = 0;
    int answered = 0;
    for (int i = 0; i < noises; ++i) {
      const double measured = disparity + noise(random);
      const vision::InverseRange got = vision::range_from_disparity(measured, kSigma_px, g);
      inverses += got.inverse_per_m;
      answered += got.verdict == vision::RangeVerdict::kOk ? 1 : 0;
      if (measured > 0) {
        ranges += g.focal_length_px * g.mirror_separation_m / measured;
        ++positive;
      }
    }
    const double exact_m = g.focal_length_px * g.mirror_separation_m / disparity;
    const double bias = std::abs(ranges / positive / exact_m - 1);
    const double inverse_bias = std::abs(inverses / noises * exact_m - 1);
    mean_range.points.emplace_back(ratio, bias);
    second_order.points.emplace_back(ratio, 1 / (ratio * ratio));
    mean_inverse.points.emplace_back(ratio, inverse_bias);
    if (k == 4) bias_at_3 = bias, inverse_at_3 = inverse_bias;
    if (k == 0) no_range_at_1 = 1 - double(positive) / noises, answered_at_1 = double(answered) / noises;
  }
  return {"stability_disparity",
          "Ranges from disparities as small as their noise",
          fmt::format("{} disparities with noise of 0.1 px about one true value, with the lab's rig (v s = 212.4 px "
                      "m). Textbook: the mean "
                      "of v s / disparity over those above zero. Ours: the mean of the inverse ranges of "
                      "range_from_disparity (double). This is a "
                      "matter of noise, not of rounding, so there is no float. What is left of the inverse's bias is "
                      "the sample's own "
                      "mean.",
                      noises),
          "true disparity over its sigma",
          "relative bias",
          {0.5, 35},
          {1e-4, 1e2},
          {mean_range, second_order, mean_inverse},
          fmt::format("Where the disparity is 3.2 sigma the mean range is {:.0f} % too long and the mean inverse range "
                      "is off by {:.1g} %; at "
                      "1 sigma {:.0f} % of the disparities give no positive range at all, and range_from_disparity "
                      "answers with a range in {:.1f} % "
                      "only, with a verdict in the rest.",
                      100 * bias_at_3, 100 * inverse_at_3, 100 * no_range_at_1, 100 * answered_at_1)};
}

Experiment angles_between_near_directions(int draws) {
  Four four;
  Draw draw(40806);
  for (const double angle : decades(-48, 0, 4)) {
    for (int i = 0; i < draws; ++i) {
      // Below this angle, two different directions are the same floats.
      if (angle > 1e-7) measure_angle<float>(draw, angle, four.textbook_float, four.ours_float);
      measure_angle<double>(draw, angle, four.textbook_double, four.ours_double);
    }
  }
  return {"stability_angle",
          "Angles between directions that are nearly one",
          "The angle between two bearings, as unit vectors rounded to the type. Textbook: acos of the scalar product. "
          "Ours: atan2 of vector "
          "and scalar product, as everywhere in vision/ and localisation/ (for example MirrorView::bearing_rad and "
          "project); transcribed "
          "for both types.",
          "angle / rad",
          "error of the angle / rad",
          {1e-12, 1},
          {1e-19, 1e-2},
          four.series("acos", "atan2"),
          fmt::format("acos is off by up to {:.1e} rad in double and {:.1e} rad in float, and gives no number in {} "
                      "and {} cases of {}; "
                      "atan2 stays below {:.1e} rad and {:.1e} rad.",
                      four.textbook_double.largest(), four.textbook_float.largest(), four.textbook_double.without(),
                      four.textbook_float.without(), four.textbook_double.count(), four.ours_double.largest(),
                      four.ours_float.largest())};
}

}  // namespace twocone::numerics
