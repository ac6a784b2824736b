// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "localisation/least_squares_fix.h"
#include "tests/vision/lab_rig.h"
#include "vision/triangulation.h"
#include "vision/uncertain_rig.h"

/// Robots whose rig and map differ from what they believe, by errors that are drawn from the stated standard
/// deviations, and their sightings without images.
namespace twocone::vision {

/// Standard deviations of what a robot believes.
struct BeliefSigmas {
  std::vector<double> rig = std::vector<double>(kRigNumbers, 0);  ///< by RigNumber
  LandmarkSigma landmark{};

  void set(std::initializer_list<ViewNumber> numbers, double sigma) {
    for (const Side side : {Side::kLower, Side::kUpper}) {
      for (const ViewNumber number : numbers) rig[std::size_t(rig_number(side, number))] = sigma;
    }
  }
};

/// Six landmarks of a room of six by five metres, with tops of three heights.
inline std::vector<Landmark> room_landmarks() {
  std::vector<Landmark> all;
  const double places_m[][3] = {{-2.45, -0.35, 0.93}, {-1.40, 1.95, 1.08}, {1.50, 1.95, 0.93},
                                {2.45, 0.30, 1.21},   {1.30, -1.95, 0.93}, {-1.50, -1.95, 1.08}};
  for (const auto& [x_m, y_m, top_m] : places_m) {
    all.push_back({.name = "", .colour = {}, .x_m = x_m, .y_m = y_m, .radius_m = 0.15, .top_m = top_m});
  }
  return all;
}

/// Returns the errors of a belief with these standard deviations, one column for each number that is uncertain.
inline BeliefErrors errors_of(const BeliefSigmas& sigmas, std::size_t landmarks) {
  std::vector<double> all = sigmas.rig;
  for (std::size_t i = 0; i < landmarks; ++i) {
    const LandmarkSigma& s = sigmas.landmark;
    all.insert(all.end(), {s.x_m, s.y_m, s.top_m, s.radius_m});
  }
  const auto count = std::ranges::count_if(all, [](double sigma) { return sigma > 0; });
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(Eigen::Index(all.size()), count);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i] > 0) matrix(Eigen::Index(i), column++) = all[i];
  }
  BeliefErrors errors;
  errors.rig = matrix.topRows(kRigNumbers);
  for (std::size_t i = 0; i < landmarks; ++i) {
    errors.landmarks.emplace_back(
        matrix.middleRows(kRigNumbers + kLandmarkNumbers * Eigen::Index(i), kLandmarkNumbers));
  }
  return errors;
}

/// A robot that believes lab_rig() and room_landmarks(), and is otherwise.
class RobotAsBuilt {
 public:
  /// @param errors by which the truth is drawn
  RobotAsBuilt(const BeliefErrors& errors, std::mt19937_64& random)
      : true_rig(lab_rig()), believed(room_landmarks()), truth(room_landmarks()) {
    std::normal_distribution<double> normal;
    Eigen::VectorXd draw =
        Eigen::VectorXd::NullaryExpr(errors.rig.cols(), [&](Eigen::Index) { return normal(random); });
    true_rig = with_errors(lab_rig(), errors.rig * draw);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const Eigen::Vector4d moved = errors.landmarks[i] * draw;
      truth[i].x_m += moved[kPlaceX];
      truth[i].y_m += moved[kPlaceY];
      truth[i].top_m += moved[kTop];
      truth[i].radius_m += moved[kRadius];
    }
  }

  /// Returns the sighting of a true landmark from a pose, with noise of that standard deviation; nothing where the view
  /// does not show it.
  [[nodiscard]] std::optional<Sighting> sighting(Side side, std::size_t landmark, const localisation::Pose& pose,
                                                 double noise_px, std::mt19937_64& random) const {
    const Landmark& l = truth[landmark];
    const double c = std::cos(pose.heading_rad);
    const double s = std::sin(pose.heading_rad);
    const Eigen::Vector2d to_m(l.x_m - pose.x_m, l.y_m - pose.y_m);
    const Eigen::Vector2d p_BL_m(c * to_m.x() + s * to_m.y(), -s * to_m.x() + c * to_m.y());
    const MirrorView& view = of_view(true_rig, side);
    const auto near_m = near_top_point(view, p_BL_m, l.radius_m, l.top_m);
    const auto pixel_px = near_m ? view.project(*near_m) : std::nullopt;
    if (!pixel_px) return std::nullopt;
    std::normal_distribution<double> noise(0, noise_px);
    const Eigen::Vector2d seen_px = *pixel_px + Eigen::Vector2d(noise(random), noise(random));
    return Sighting{seen_px, noise_px * noise_px * Eigen::Matrix2d::Identity()};
  }

  Rig true_rig;
  std::vector<Landmark> believed;
  std::vector<Landmark> truth;
};

}  // namespace twocone::vision
