// SPDX-License-Identifier: Apache-2.0
// A survey beside a measured map, by numbers alone.
#include "apps/survey/refine.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vision/ranging.h"

namespace twocone::survey {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kTape_m = 0.003;
constexpr double kShape_m = 0.002;

std::vector<Landmark> six_pipes() {
  const std::vector<std::array<double, 3>> colours{{0.8, 0.03, 0.03}, {0.03, 0.8, 0.03}, {0.03, 0.03, 0.8},
                                                   {0.03, 0.8, 0.8},  {0.8, 0.03, 0.8},  {0.8, 0.8, 0.03}};
  const std::vector<std::string> names{"red", "green", "blue", "cyan", "magenta", "yellow"};
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double angle = double(i) + 0.2 * double(i % 2);
    landmarks.push_back({.name = names[i],
                         .colour = colours[i],
                         .x_m = 2.2 * std::cos(angle),
                         .y_m = 1.8 * std::sin(angle),
                         .radius_m = 0.15,
                         .top_m = 0.9,
                         .sigma = {kTape_m, kTape_m, 0.003, 0.001}});
  }
  return landmarks;
}

/// A survey of a room, in a world of its own, with errors that its covariance states: those of its shape, and one of
/// its scale, which all places share.
struct Surveyed {
  std::vector<Landmark> landmarks;
  Eigen::MatrixXd covariance;
};

Surveyed survey_of(const std::vector<Landmark>& truth, std::mt19937_64& random) {
  constexpr double kScale = 0.01;
  const auto size = Eigen::Index(2 * truth.size());
  const Eigen::Rotation2Dd turn(-1.1);
  Eigen::VectorXd places(size);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    places.segment<2>(Eigen::Index(2 * i)) = turn * (vision::place_m(truth[i]) + Eigen::Vector2d(0.4, -0.7));
  }
  Surveyed survey{truth, kShape_m * kShape_m * Eigen::MatrixXd::Identity(size, size) +
                             kScale * kScale * places * places.transpose()};
  std::normal_distribution<double> normal;
  const Eigen::VectorXd error =
      survey.covariance.llt().matrixL() * Eigen::VectorXd::NullaryExpr(size, [&] { return normal(random); });
  for (std::size_t i = 0; i < truth.size(); ++i) {
    Landmark& landmark = survey.landmarks[i];
    landmark.x_m = places[Eigen::Index(2 * i)] + error[Eigen::Index(2 * i)];
    landmark.y_m = places[Eigen::Index(2 * i) + 1] + error[Eigen::Index(2 * i) + 1];
    landmark.name += ".1";
    for (double& channel : landmark.colour) channel = 0.9 * channel + 0.02;  // the room's light
  }
  std::ranges::rotate(survey.landmarks, survey.landmarks.begin() + 2);
  const Eigen::MatrixXd was = survey.covariance;
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index k = 0; k < size; ++k) survey.covariance(i, k) = was((i + 4) % size, (k + 4) % size);
  }
  return survey;
}

std::vector<Landmark> measured(std::vector<Landmark> truth, std::mt19937_64& random) {
  std::normal_distribution<double> error(0, kTape_m);
  for (Landmark& landmark : truth) {
    landmark.x_m += error(random);
    landmark.y_m += error(random);
  }
  return truth;
}

// Catches a landmark that was moved and is not named, and one that was not moved and is: none, one or two of six are
// moved by 50 mm, the survey's scale is wrong by a percent.
TEST(MatchToMap, NamesWhatWasMovedAndNothingElse) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    const std::vector<Landmark> before = six_pipes();
    std::vector<Landmark> now = before;
    std::vector<std::string> names;
    std::vector<std::size_t> order{0, 1, 2, 3, 4, 5};
    std::ranges::shuffle(order, random);
    std::uniform_real_distribution<double> direction(0, 2 * std::numbers::pi);
    for (unsigned i = 0; i < seed % 3; ++i) {
      Landmark& landmark = now[order[i]];
      const double angle = direction(random);
      landmark.x_m += 0.05 * std::cos(angle);
      landmark.y_m += 0.05 * std::sin(angle);
      names.push_back(landmark.name);
    }
    const Surveyed survey = survey_of(now, random);
    const auto match = match_to_map(survey.landmarks, survey.covariance, measured(before, random));
    ASSERT_TRUE(match) << match.error().message;
    std::vector<std::string> moved;
    for (const MovedLandmark& m : match->moved) {
      moved.push_back(m.name);
      const auto was = std::ranges::find(before, m.name, &Landmark::name);
      const auto is = std::ranges::find(now, m.name, &Landmark::name);
      EXPECT_LT((m.by_m - (vision::place_m(*is) - vision::place_m(*was))).norm(), 4.5 * m.sigma_m) << m.name;
      EXPECT_LT(m.sigma_m, 0.015);
    }
    EXPECT_THAT(moved, testing::UnorderedElementsAreArray(names)) << "seed " << seed;
    EXPECT_THAT(match->missing, IsEmpty());
  }
}

// Catches priors of the map for a landmark that is elsewhere, and a new landmark that takes those of another.
TEST(MatchToMap, KeepsWhatTheMapStatesOfTheRest) {
  std::mt19937_64 random(5);
  std::vector<Landmark> map = six_pipes();
  std::vector<Landmark> now = map;
  now[1].x_m += 0.9;  // farther than where it would be sought
  Landmark extra = now[4];
  extra.x_m -= 1.7;
  now.push_back(extra);
  now.erase(now.begin() + 5);  // yellow
  const Surveyed survey = survey_of(now, random);
  const auto match = match_to_map(survey.landmarks, survey.covariance, map);
  ASSERT_TRUE(match) << match.error().message;
  ASSERT_EQ(match->landmarks.size(), survey.landmarks.size());
  EXPECT_THAT(match->missing, testing::ElementsAre("yellow"));
  ASSERT_EQ(match->moved.size(), 1U);
  EXPECT_EQ(match->moved[0].name, "green");
  EXPECT_NEAR(match->moved[0].by_m.x(), 0.9, 0.05);
  for (std::size_t i = 0; i < match->landmarks.size(); ++i) {
    const Landmark& landmark = match->landmarks[i];
    const bool is_new = landmark.name.ends_with(".1");
    const bool is_there = !is_new && landmark.name != "green";
    EXPECT_EQ(std::isinf(landmark.sigma.x_m), !is_there) << landmark.name;
    EXPECT_EQ(std::isinf(landmark.sigma.top_m), is_new) << landmark.name;
    const auto is = std::ranges::min_element(
        now, {}, [&](const Landmark& l) { return (vision::place_m(l) - vision::place_m(landmark)).norm(); });
    EXPECT_LT((vision::place_m(*is) - vision::place_m(landmark)).norm(), 0.06) << landmark.name;
  }
}

TEST(MatchToMap, RefusesAnotherRoom) {
  std::mt19937_64 random(5);
  const Surveyed survey = survey_of(six_pipes(), random);
  std::vector<Landmark> other = six_pipes();
  for (std::size_t i = 0; i < other.size(); ++i) other[i].x_m *= 3 + double(i);
  const auto match = match_to_map(survey.landmarks, survey.covariance, other);
  ASSERT_FALSE(match);
  EXPECT_THAT(match.error().message, HasSubstr("of the map's 6 landmarks were found where it has them"));
}

}  // namespace
}  // namespace twocone::survey
