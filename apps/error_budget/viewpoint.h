// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/behaviours/behaviour.h"
#include "apps/error_budget/error_budget.h"
#include "localisation/fix.h"
#include "localisation/odometry.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::error_budget {

/// A rig and a map, true or believed, and the deviations from an ideal measurement. The true world has no deviations.
struct World {
  vision::MirrorViewSettings lower, upper;
  std::vector<Landmark> landmarks;
  double skew_s = 0;  ///< time from the lower exposure to the upper one
  /// Noise of each landmark's pixel in each view, in standard deviations along two independent axes; empty: none.
  std::vector<std::array<Eigen::Vector2d, 2>> noise;
};

/// A robot's answer for one landmark: range and bearing.
struct Answer {
  Eigen::Vector2d range_bearing;
  Eigen::Matrix2d covariance;
};

/// One true pose in the true world. It computes the answers that a robot with wrong beliefs gives there.
class Viewpoint {
 public:
  /// @param edge_noise_px > 0
  /// @param tops_known whether the robot uses its belief about the tops' heights
  Viewpoint(const World& truth, const localisation::Pose& pose, const behaviours::Motion& motion, double edge_noise_px,
            bool tops_known);

  [[nodiscard]] const localisation::Pose& pose() const { return pose_; }
  /// Returns the indices of the landmarks that can be measured from here.
  [[nodiscard]] const std::vector<int>& seen() const { return seen_; }
  [[nodiscard]] double true_range_m(int landmark) const { return p_BL_m(pose_, landmark).norm(); }

  /// Returns the range and bearing of a landmark, or nothing if the triangulation withholds the range.
  /// @param rig the two views of `believed`
  [[nodiscard]] std::optional<Answer> answer(const World& believed, const vision::Rig& rig, int landmark) const;
  /// Returns the fix from all visible landmarks, or nothing if they do not determine exactly one position.
  [[nodiscard]] std::optional<localisation::Fix> fix(const World& believed, const vision::Rig& rig) const;

 private:
  struct View {
    vision::Sighting sighting;  ///< without noise
    Eigen::Matrix2d root_px;    ///< root of the true covariance: noise = root * standard normal variables
  };
  [[nodiscard]] Eigen::Vector2d p_BL_m(const localisation::Pose& pose, int landmark) const;
  /// Returns the pixel of a landmark's near point if its axis is at `p_BL_m`.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(const vision::MirrorView& view, const Eigen::Vector2d& p_BL_m,
                                                     int landmark) const;
  [[nodiscard]] std::optional<View> look(const vision::MirrorView& view, int landmark, double edge_noise_px) const;

  const World* truth_;
  vision::Rig rig_;
  localisation::Pose pose_;
  behaviours::Motion motion_;
  bool tops_known_;
  std::vector<int> seen_;
  std::vector<std::array<std::optional<View>, 2>> views_;  ///< of each landmark, lower and upper
  std::vector<double> inflation_;                          ///< factor on each landmark's sigmas
};

vision::Rig rig_of(const World& world);

// ---- the errors that a world may have

/// One independent number that may be wrong.
struct Part {
  int landmark = -1;  ///< the only landmark that it affects; -1: all
  /// Adds an error of `sigmas` standard deviations to `world`.
  std::function<void(World& world, double sigmas)> apply;
};

/// A line of the error budget: parts with independent errors.
struct Source {
  std::string name;
  std::string size;
  std::vector<Part> parts;
};

/// Returns all sources of the settings, for a world with `landmarks` landmarks.
std::vector<Source> all_sources(const ErrorBudgetSettings& settings, int landmarks);

}  // namespace twocone::error_budget
