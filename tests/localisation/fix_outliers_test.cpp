// SPDX-License-Identifier: Apache-2.0
// Many wrong measurements among more correct ones. TWOCONE_CASES: number of draws of each kind.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/localisation/fix_cases.h"
#include "tests/support/cases.h"

namespace twocone::localisation {
namespace {

struct Planted {
  std::vector<LandmarkMeasurement> measurements;
  std::vector<int> wrong;  ///< ascending
  Pose truth;
};

/// `count` landmarks, `wrong` of which are elsewhere in the room than in the map.
Planted plant(int count, int wrong, unsigned seed) {
  std::mt19937_64 random(seed);
  const double size = count > 40 ? 5 : 1;  // scale of the room: not all of a thousand landmarks are near others
  std::uniform_real_distribution<double> x(-3 * size, 3 * size);
  std::uniform_real_distribution<double> y(-2.5 * size, 2.5 * size);
  std::uniform_real_distribution<double> turn(-3.14159, 3.14159);
  FixCase c;
  c.truth = {x(random), y(random), turn(random)};
  while (int(c.landmarks_m.size()) < count) {
    const Eigen::Vector2d l(x(random), y(random));
    if ((l - Eigen::Vector2d(c.truth.x_m, c.truth.y_m)).norm() > 0.3) c.landmarks_m.push_back(l);
  }
  Planted planted{measure(c, random), {}, c.truth};
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  std::shuffle(all.begin(), all.end(), random);
  planted.wrong.assign(all.begin(), all.begin() + wrong);
  std::sort(planted.wrong.begin(), planted.wrong.end());
  for (const int i : planted.wrong) planted.measurements[std::size_t(i)].landmark_m = {x(random), y(random)};
  return planted;
}

/// The outliers that could be identified if the correct measurements were known: the fix of these forecasts every
/// measurement, and an outlier differs from its forecast by more than noise does once in 10,000 sets. A planted error
/// within that noise cannot be identified, and a correct measurement beyond it counts as an outlier.
std::vector<int> knowable(const Planted& planted) {
  std::vector<LandmarkMeasurement> right;
  std::set<int> wrong(planted.wrong.begin(), planted.wrong.end());
  const int count = int(planted.measurements.size());
  for (int i = 0; i < count; ++i) {
    if (!wrong.contains(i)) right.push_back(planted.measurements[std::size_t(i)]);
  }
  const Fix fix = fix_by_least_squares(right);
  const double limit = 2 * std::log(count / 1e-4);
  std::vector<int> named;
  for (int i = 0; i < count; ++i) {
    const LandmarkMeasurement& m = planted.measurements[std::size_t(i)];
    const Eigen::Vector2d d = m.landmark_m - *fix.position_m;
    const double r = d.norm();
    Eigen::Matrix<double, 2, 3> j;
    j << -d.x() / r, -d.y() / r, 0, d.y() / (r * r), -d.x() / (r * r), -1;
    const Eigen::Vector2d e(*m.range_m - r,
                            wrap_angle_rad(*m.bearing_rad - std::atan2(d.y(), d.x()) + *fix.heading_rad));
    const double sign = wrong.contains(i) ? 1 : -1;
    const Eigen::Matrix2d c = m.covariance + sign * j * (*fix.covariance / fix.widening) * j.transpose();
    if (e.dot(c.inverse() * e) > limit) named.push_back(i);
  }
  return named;
}

double cpu_ms() { return 1e3 * double(std::clock()) / CLOCKS_PER_SEC; }

void expect_found(int count, int wrong, int usual) {
  int found = 0;
  int quietly_wrong = 0;
  double with_ms = 0;
  double without_ms = 0;
  const int total = testing_support::cases(usual);
  for (int i = 0; i < total; ++i) {
    const Planted planted = plant(count, wrong, unsigned(i + 1));
    const double begin_ms = cpu_ms();
    const Fix fix = fix_by_least_squares(planted.measurements);
    with_ms += cpu_ms() - begin_ms;
    const auto right = knowable(planted);
    const bool is_found = fix.verdict == FixVerdict::kOk && fix.outliers == right;
    found += is_found ? 1 : 0;
    if (fix.verdict == FixVerdict::kOk) {
      const Eigen::Vector3d error = error_of(fix, planted.truth);
      quietly_wrong += error.dot(fix.covariance->inverse() * error) > 36 ? 1 : 0;
    }
    const Planted clean = plant(count, 0, unsigned(i + 1));
    const double clean_ms = cpu_ms();
    EXPECT_EQ(fix_by_least_squares(clean.measurements).used, count) << i;
    without_ms += cpu_ms() - clean_ms;
  }
  std::printf(
      "%d measurements, %d wrong: found in %d of %d, %d wrong by more than 6 sigma; %.1f times the fix without\n",
      count, wrong, found, total, quietly_wrong, with_ms / without_ms);
  EXPECT_GE(found, int(std::ceil(0.99 * total)));
  EXPECT_EQ(quietly_wrong, 0);
}

TEST(FixOutliers, EightOfThirtyTwo) { expect_found(32, 8, 100); }
TEST(FixOutliers, ThreeHundredOfAThousand) { expect_found(1000, 300, 5); }
TEST(FixOutliers, ThreeOfNine) { expect_found(9, 3, 100); }

TEST(FixOutliers, TwoAgainstOneCannotBeDecided) {
  std::mt19937_64 random(35);
  for (int i = 0; i < 200; ++i) {
    FixCase c = random_case(random, 3);
    auto m = measure(c, random);
    const double exchanged_m = (m[0].landmark_m - m[1].landmark_m).norm();
    std::swap(m[0].landmark_m, m[1].landmark_m);
    if (exchanged_m < 0.5) continue;  // up to three times the sigmas is still kOk, with a wider covariance
    const Fix fix = fix_by_least_squares(m);
    EXPECT_TRUE(fix.outliers.empty()) << i << " " << to_string(fix.verdict);
    if (fix.verdict != FixVerdict::kOk) continue;
    EXPECT_GT(fix.widening, 1) << i;
    const Eigen::Vector3d error = error_of(fix, c.truth);
    EXPECT_LT(error.dot(fix.covariance->inverse() * error), 36) << i;
  }
}

TEST(FixOutliers, TwoLabelsExchangedAmongFive) {
  std::mt19937_64 random(36);
  for (int i = 0; i < 100; ++i) {
    FixCase c = random_case(random, 5);
    auto m = measure(c, random);
    std::swap(m[1].landmark_m, m[3].landmark_m);
    const Fix fix = fix_by_least_squares(m);
    if (fix.verdict != FixVerdict::kOk) continue;  // this may be impossible to decide too
    EXPECT_EQ(fix.outliers, (std::vector<int>{1, 3})) << i;
  }
}

}  // namespace
}  // namespace twocone::localisation
