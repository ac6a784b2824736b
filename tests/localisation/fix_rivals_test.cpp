// SPDX-License-Identifier: Apache-2.0
// Compares sets in which not every landmark has both a range and a bearing with an exhaustive search.
// TWOCONE_CASES: number of rooms of each kind; the default is small.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/localisation/exhaustive_search.h"
#include "tests/localisation/fix_cases.h"

namespace twocone::localisation {
namespace {

/// A local minimum up to this much above the lowest is a rival, by fix.h and by the header of the fix.
constexpr double kRivalIs = 27;
/// Both searches compute chi-squared of residuals that are accurate to 1e-12 of 6 m, over sigmas of 1 mm and more.
constexpr double kChiSquaredRounding = 1e-6;

int rooms() {
  const char* const cases = std::getenv("TWOCONE_CASES");
  return cases ? std::max(1, std::atoi(cases)) : 8;
}

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
  for (int i = 0; i < rooms(); ++i) {
    const auto room = draw_room(GetParam(), random);
    const Fix fix = fix_by_least_squares(room);
    ++verdicts[int(fix.verdict)];
    if (fix.verdict != FixVerdict::kOk && fix.verdict != FixVerdict::kAmbiguous) continue;
    const auto minima = find_all_minima(room);
    const auto what = [&] {
      std::string text = "room " + std::to_string(i) + " of " + GetParam().name + ":" + print(room);
      for (const auto& m : minima) {
        text += "\n  " + std::to_string(m.x_m) + " " + std::to_string(m.y_m) + " " + std::to_string(m.heading_rad) +
                " chi2 " + std::to_string(m.chi_squared);
        if (m.chi_squared > minima.front().chi_squared + 100) break;
      }
      return text;
    };
    const FoundMinimum own{fix.position_m->x(), fix.position_m->y(), *fix.heading_rad,
                           chi_squared_at(room, fix.position_m->x(), fix.position_m->y(), *fix.heading_rad)};
    if (minima.empty() || own.chi_squared > minima.front().chi_squared + kChiSquaredRounding) {
      ++not_global;
      ADD_FAILURE() << "not the global minimum: " << own.x_m << " " << own.y_m << " chi2 " << own.chi_squared << " "
                    << what();
    }
    if (fix.verdict == FixVerdict::kOk) {
      if (minima.size() > 1 && minima[1].chi_squared < own.chi_squared + kRivalIs - kChiSquaredRounding) {
        ++hidden;
        ADD_FAILURE() << "ok, with a rival: " << what();
      }
      continue;
    }
    const Eigen::Vector2d& other = *fix.other_position_m;
    const FoundMinimum rival{other.x(), other.y(), *fix.other_heading_rad,
                             chi_squared_at(room, other.x(), other.y(), *fix.other_heading_rad)};
    constexpr double kAtMinimum = 1e-4;  // sigmas
    const double left = sigmas_from_minimum(room, rival);
    if (!(left >= 0 && left < kAtMinimum && rival.chi_squared < own.chi_squared + kRivalIs + kChiSquaredRounding &&
          std::hypot(rival.x_m - own.x_m, rival.y_m - own.y_m) > 1e-6)) {
      ++without_rival;
      ADD_FAILURE() << "ambiguous without a rival: " << rival.x_m << " " << rival.y_m << " chi2 " << rival.chi_squared
                    << ", " << left << " sigmas from a minimum; " << what();
    }
  }
  std::printf(
      "%s: %d rooms: %d ok, %d ambiguous, %d weak, %d too_few, %d contradictory; ok with a rival %d, not the "
      "global minimum %d, ambiguous without a rival %d\n",
      GetParam().name, rooms(), verdicts[int(FixVerdict::kOk)], verdicts[int(FixVerdict::kAmbiguous)],
      verdicts[int(FixVerdict::kWeak)], verdicts[int(FixVerdict::kTooFew)], verdicts[int(FixVerdict::kContradictory)],
      hidden, not_global, without_rival);
  // Rooms without an answer prove nothing. One range and two bearings with the coarsest sigmas are weak in a third of
  // the rooms.
  EXPECT_GE(verdicts[int(FixVerdict::kOk)] + verdicts[int(FixVerdict::kAmbiguous)], rooms() / 2);
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
