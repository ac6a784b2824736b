// SPDX-License-Identifier: Apache-2.0
// Compares sets in which not every landmark has both a range and a bearing with an exhaustive search.
// TWOCONE_CASES: number of rooms of each kind; the default is small.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/localisation/fix_cases.h"
#include "tests/support/cases.h"

namespace twocone::localisation {
namespace {

/// A local minimum of chi-squared.
struct FoundMinimum {
  Eigen::Vector3d pose;  ///< x m, y m, heading rad
  double chi_squared;
};

/// A direction to a landmark has no meaning nearer than this. It is a tenth of a millimetre, since landmarks are
/// thicker.
constexpr double kOnLandmark_m = 1e-4;

struct Model {
  Eigen::Matrix3d hessian_gn = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  double cost = 0;
};

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2 * std::numbers::pi); }

/// Chi-squared of uncorrelated measurements at a pose, written from its definition and without the library.
double cost_of(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  double cost = 0;
  for (const auto& m : all) {
    const double dx = m.landmark_m.x() - pose.x();
    const double dy = m.landmark_m.y() - pose.y();
    if (m.range_m) cost += std::pow(*m.range_m - std::hypot(dx, dy), 2) / m.covariance(0, 0);
    if (m.bearing_rad) {
      cost += std::pow(wrapped(*m.bearing_rad - std::atan2(dy, dx) + pose.z()), 2) / m.covariance(1, 1);
    }
  }
  return cost;
}

/// Half of chi-squared's slope and curvature, with all terms.
Model model_at(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  Model model;
  const auto add = [&](double error, const Eigen::Vector3d& gradient, const Eigen::Matrix2d& bend, double variance) {
    model.cost += error * error / variance;
    model.slope += error / variance * gradient;
    model.hessian_gn += gradient * gradient.transpose() / variance;
    model.hessian.topLeftCorner<2, 2>() += error / variance * bend;
  };
  for (const auto& m : all) {
    const double dx = m.landmark_m.x() - pose.x();
    const double dy = m.landmark_m.y() - pose.y();
    const double d2 = dx * dx + dy * dy;
    const double d = std::sqrt(d2);
    if (m.range_m) {  // error = |d| - range
      Eigen::Matrix2d bend;
      bend << dy * dy, -dx * dy, -dx * dy, dx * dx;
      add(d - *m.range_m, {-dx / d, -dy / d, 0}, bend / (d2 * d), m.covariance(0, 0));
    }
    if (m.bearing_rad) {  // error = direction - heading - bearing
      Eigen::Matrix2d bend;
      bend << 2 * dx * dy, dy * dy - dx * dx, dy * dy - dx * dx, -2 * dx * dy;
      add(wrapped(std::atan2(dy, dx) - pose.z() - *m.bearing_rad), {dy / d2, -dx / d2, -1}, bend / (d2 * d2),
          m.covariance(1, 1));
    }
  }
  model.hessian += model.hessian_gn;
  return model;
}

bool is_on_landmark(const std::vector<LandmarkMeasurement>& all, const Eigen::Vector3d& pose) {
  return std::any_of(all.begin(), all.end(), [&](const LandmarkMeasurement& m) {
    return m.bearing_rad && (m.landmark_m - pose.head<2>()).norm() < kOnLandmark_m;
  });
}

/// Descends by Levenberg and Marquardt, and ends where nothing is gained.
Eigen::Vector3d go_down(const std::vector<LandmarkMeasurement>& all, Eigen::Vector3d pose) {
  Model now = model_at(all, pose);
  double damping = 1e-3;
  for (int i = 0; i < 80 && damping < 1e12; ++i) {
    Eigen::Matrix3d damped = now.hessian_gn;
    damped.diagonal() *= 1 + damping;
    const Eigen::Vector3d step = damped.ldlt().solve(-now.slope);
    const Eigen::Vector3d there = pose + step;
    const Model next = model_at(all, there);
    if (next.cost < now.cost) {
      const bool is_little = now.cost - next.cost < 1e-7 * (1 + next.cost) && damping < 1e-2;
      pose = there;
      now = next;
      damping = std::max(1e-9, damping / 8);
      if (is_little) break;
    } else {
      damping *= 5;
    }
  }
  return pose;
}

/// The slope over the root of the curvature, in sigmas: the distance of a state from the minimum of the local parabola.
/// Negative where the curvature is not positive.
double sigmas_from_minimum(const std::vector<LandmarkMeasurement>& measurements, const FoundMinimum& at) {
  const Model model = model_at(measurements, at.pose);
  const Eigen::LLT<Eigen::Matrix3d> cholesky(model.hessian);
  if (cholesky.info() != Eigen::Success) return -1;
  return cholesky.matrixL().solve(model.slope).norm();
}

/// Every local minimum that an exhaustive search finds, the lowest first. The starts are on a grid of places and
/// headings over the room and round it, and close together along each circle of a range and near each landmark. Each is
/// refined by Levenberg and Marquardt, then by Newton. A result is dropped if its slope is not zero or its curvature is
/// not positive, and so is a place within `kOnLandmark_m` of a landmark whose bearing was measured. Requires a range.
std::vector<FoundMinimum> find_all_minima(const std::vector<LandmarkMeasurement>& measurements) {
  std::vector<FoundMinimum> found;
  // Whether a start leads to a known minimum is known only after refinement, so all are refined.
  const auto try_from = [&](const Eigen::Vector3d& start) {
    if (is_on_landmark(measurements, start)) return;
    Eigen::Vector3d pose = go_down(measurements, start);
    for (int i = 0; i < 8; ++i) {
      const Model model = model_at(measurements, pose);
      const Eigen::LLT<Eigen::Matrix3d> cholesky(model.hessian);
      if (cholesky.info() != Eigen::Success) return;
      pose -= cholesky.solve(model.slope);
    }
    const FoundMinimum m{{pose.x(), pose.y(), wrapped(pose.z())}, cost_of(measurements, pose)};
    constexpr double kConverged = 1e-5;  // sigmas
    const double left = sigmas_from_minimum(measurements, m);
    if (!(left >= 0 && left < kConverged) || is_on_landmark(measurements, pose)) return;
    for (const FoundMinimum& known : found) {
      constexpr double kSame = 1e-6;  // m and rad; sigmas are 1,000 times as large
      const Eigen::Vector3d apart = known.pose - m.pose;
      if (std::hypot(apart.x(), apart.y()) + std::abs(wrapped(apart.z())) < kSame) return;
    }
    found.push_back(m);
  };
  const auto heading_by = [&](const LandmarkMeasurement& m, double x, double y) {
    return std::atan2(m.landmark_m.y() - y, m.landmark_m.x() - x) - *m.bearing_rad;
  };
  // The grid extends as far out as a range of 8 m from the room's walls may have been measured.
  for (double x = -8; x <= 8; x += 1) {
    for (double y = -8; y <= 8; y += 1) {
      for (double turn = 0.3; turn < 2 * std::numbers::pi; turn += std::numbers::pi / 2) try_from({x, y, turn});
    }
  }
  // Along each circle, with the heading that follows from each bearing there: 1 degree, and finer near each landmark.
  for (const auto& ranged : measurements) {
    if (!ranged.range_m) continue;
    std::vector<double> turns;
    for (double turn = 0; turn < 2 * std::numbers::pi; turn += std::numbers::pi / 180) turns.push_back(turn);
    for (const auto& near : measurements) {
      const Eigen::Vector2d d = near.landmark_m - ranged.landmark_m;
      if (d.norm() == 0) continue;
      for (double off = 0.02; off > 1e-5; off /= 1.5) {
        turns.push_back(std::atan2(d.y(), d.x()) + off);
        turns.push_back(std::atan2(d.y(), d.x()) - off);
      }
    }
    for (const double turn : turns) {
      const double x = ranged.landmark_m.x() + *ranged.range_m * std::cos(turn);
      const double y = ranged.landmark_m.y() + *ranged.range_m * std::sin(turn);
      for (const auto& m : measurements) {
        if (m.bearing_rad) try_from({x, y, heading_by(m, x, y)});
      }
    }
  }
  std::ranges::sort(found, {}, &FoundMinimum::chi_squared);
  return found;
}

/// A local minimum up to this much above the lowest is a rival, by fix.h and by the header of the fix.
constexpr double kRivalIs = 27;
/// Both searches compute chi-squared of residuals that are accurate to 1e-12 of 6 m, over sigmas of 1 mm and more.
constexpr double kChiSquaredRounding = 1e-6;

struct Mixed {
  const char* name;
  int both;
  int ranges;
  int bearings;
  bool has_any_sigma;  ///< 0.5 mm to 5 cm and 0.15 to 15 mrad, instead of 3 mm and 0.9 mrad
};
void PrintTo(const Mixed& kind, std::ostream* out) { *out << kind.name; }

std::vector<LandmarkMeasurement> draw_room(const Mixed& kind, std::mt19937_64& random) {
  FixCase c = random_case(random, kind.both + kind.ranges + kind.bearings);
  std::uniform_real_distribution<double> decades(0, 2);
  c.sigma_range_m = kind.has_any_sigma ? 0.0005 * std::pow(10, decades(random)) : 0.003;
  c.sigma_bearing_rad = kind.has_any_sigma ? 0.00015 * std::pow(10, decades(random)) : 0.0009;
  auto all = measure(c, random);
  for (int i = kind.both; i < int(all.size()); ++i) {
    if (i < kind.both + kind.ranges) {
      all[std::size_t(i)].bearing_rad.reset();
    } else {
      all[std::size_t(i)].range_m.reset();
    }
  }
  return all;
}

std::string print(const std::vector<LandmarkMeasurement>& all) {
  std::ostringstream out;
  out.precision(17);
  out << " sigmas " << std::sqrt(all.back().covariance(0, 0)) << " " << std::sqrt(all.back().covariance(1, 1));
  for (const auto& m : all) {
    out << " (" << m.landmark_m.x() << ", " << m.landmark_m.y() << ";";
    if (m.range_m) out << " range " << *m.range_m;
    if (m.bearing_rad) out << " bearing " << *m.bearing_rad;
    out << ")";
  }
  return out.str();
}

std::string test_name(const Mixed& kind) {
  std::string name = kind.name;
  std::replace(name.begin(), name.end(), '+', '_');
  return name;
}

class FixRivals : public ::testing::TestWithParam<Mixed> {};

TEST_P(FixRivals, AgainstASearchFromEverywhere) {
  std::mt19937_64 random(17);
  int verdicts[6] = {};
  int hidden = 0, not_global = 0, without_rival = 0;
  const int rooms = testing_support::cases(8);
  for (int i = 0; i < rooms; ++i) {
    const auto room = draw_room(GetParam(), random);
    const Fix fix = fix_by_least_squares(room);
    ++verdicts[int(fix.verdict)];
    if (fix.verdict != FixVerdict::kOk && fix.verdict != FixVerdict::kAmbiguous) continue;
    const auto minima = find_all_minima(room);
    const auto what = [&] {
      std::string text = "room " + std::to_string(i) + " of " + GetParam().name + ":" + print(room);
      for (const auto& m : minima) {
        text += "\n  " + std::to_string(m.pose.x()) + " " + std::to_string(m.pose.y()) + " " +
                std::to_string(m.pose.z()) + " chi2 " + std::to_string(m.chi_squared);
        if (m.chi_squared > minima.front().chi_squared + 100) break;
      }
      return text;
    };
    const auto given = [&room](const Eigen::Vector2d& at_m, double heading_rad) {
      const Eigen::Vector3d pose(at_m.x(), at_m.y(), heading_rad);
      return FoundMinimum{pose, cost_of(room, pose)};
    };
    const FoundMinimum own = given(*fix.position_m, *fix.heading_rad);
    if (minima.empty() || own.chi_squared > minima.front().chi_squared + kChiSquaredRounding) {
      ++not_global;
      ADD_FAILURE() << "not the global minimum: " << own.pose.transpose() << " chi2 " << own.chi_squared << " "
                    << what();
    }
    if (fix.verdict == FixVerdict::kOk) {
      if (minima.size() > 1 && minima[1].chi_squared < own.chi_squared + kRivalIs - kChiSquaredRounding) {
        ++hidden;
        ADD_FAILURE() << "ok, with a rival: " << what();
      }
      continue;
    }
    const FoundMinimum rival = given(*fix.other_position_m, *fix.other_heading_rad);
    constexpr double kAtMinimum = 1e-4;  // sigmas
    const double left = sigmas_from_minimum(room, rival);
    if (!(left >= 0 && left < kAtMinimum && rival.chi_squared < own.chi_squared + kRivalIs + kChiSquaredRounding &&
          (rival.pose - own.pose).head<2>().norm() > 1e-6)) {
      ++without_rival;
      ADD_FAILURE() << "ambiguous without a rival: " << rival.pose.transpose() << " chi2 " << rival.chi_squared << ", "
                    << left << " sigmas from a minimum; " << what();
    }
  }
  std::printf(
      "%s: %d rooms: %d ok, %d ambiguous, %d weak, %d too_few, %d contradictory; ok with a rival %d, not the "
      "global minimum %d, ambiguous without a rival %d\n",
      GetParam().name, rooms, verdicts[int(FixVerdict::kOk)], verdicts[int(FixVerdict::kAmbiguous)],
      verdicts[int(FixVerdict::kWeak)], verdicts[int(FixVerdict::kTooFew)], verdicts[int(FixVerdict::kContradictory)],
      hidden, not_global, without_rival);
  // Rooms without an answer prove nothing. One range and two bearings with the coarsest sigmas are weak in a third of
  // the rooms.
  EXPECT_GE(verdicts[int(FixVerdict::kOk)] + verdicts[int(FixVerdict::kAmbiguous)], rooms / 2);
}

TEST(FixRivalsByName, TheRivalOfOneRangeAndThreeBearings) {
  std::vector<LandmarkMeasurement> all;
  const auto add = [&](double x_m, double y_m, std::optional<double> range_m, std::optional<double> bearing_rad) {
    LandmarkMeasurement m{.landmark_m = {x_m, y_m}, .range_m = range_m, .bearing_rad = bearing_rad};
    m.covariance = Eigen::Vector2d(0.003 * 0.003, 0.0009 * 0.0009).asDiagonal();
    all.push_back(m);
  };
  add(0.92625718749297903, -0.54791260539394127, 2.7756494278498041, {});
  add(2.0157032881215549, -2.4741086341699732, {}, -1.4265993498460272);
  add(1.9567431334929092, -2.5581363469127774, {}, -1.4539455589323163);
  add(-1.2365187526650232, -0.23036597052104923, {}, 0.13155587967446222);
  const Fix fix = fix_by_least_squares(all);
  ASSERT_EQ(fix.verdict, FixVerdict::kAmbiguous) << to_string(fix.verdict);
  EXPECT_LT((*fix.position_m - Eigen::Vector2d(0.726, -3.316)).norm(), 0.01) << fix.position_m->transpose();
  // The true place has a chi-squared of 3.2, against 0.59 of the best.
  EXPECT_LT((*fix.other_position_m - Eigen::Vector2d(-1.555, -1.795)).norm(), 0.03)
      << fix.other_position_m->transpose();
}

TEST(FixRivalsByName, ARivalBesideALandmark) {
  // The rival is 11 mm from the landmark, which is four sigmas of the range: any direction is near.
  LandmarkMeasurement range{
      .landmark_m = {0.66362509629252564, -0.24516542899601879}, .range_m = 2.9946061864717031, .bearing_rad = {}};
  LandmarkMeasurement one{
      .landmark_m = {-0.84491227332138585, 2.3409873231601086}, .range_m = {}, .bearing_rad = 0.12123051411813503};
  LandmarkMeasurement two{
      .landmark_m = {1.3899570841760625, -2.0448408761398884}, .range_m = {}, .bearing_rad = -1.4474583102456482};
  for (auto* m : {&range, &one, &two}) m->covariance = Eigen::Vector2d(0.003 * 0.003, 0.0009 * 0.0009).asDiagonal();
  const Fix fix = fix_by_least_squares(std::vector{range, one, two});
  EXPECT_TRUE(fix.verdict == FixVerdict::kAmbiguous || fix.verdict == FixVerdict::kTooFew) << to_string(fix.verdict);
}

INSTANTIATE_TEST_SUITE_P(Mixed, FixRivals,
                         ::testing::Values(Mixed{"R+3B", 0, 1, 3, false}, Mixed{"R+B+B", 0, 1, 2, false},
                                           Mixed{"RR+BB", 0, 2, 2, false}, Mixed{"RB+B+B", 1, 0, 2, false}),
                         [](const auto& room) { return test_name(room.param); });
INSTANTIATE_TEST_SUITE_P(MixedOfAnySigma, FixRivals,
                         ::testing::Values(Mixed{"R+3B", 0, 1, 3, true}, Mixed{"R+B+B", 0, 1, 2, true},
                                           Mixed{"RR+BB", 0, 2, 2, true}, Mixed{"RB+B+B", 1, 0, 2, true},
                                           Mixed{"RR+B", 0, 2, 1, true}, Mixed{"RB+R+B", 1, 1, 1, true},
                                           Mixed{"3R+3B", 0, 3, 3, true}),
                         [](const auto& room) { return test_name(room.param); });

}  // namespace
}  // namespace twocone::localisation
