// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/shared_errors.h"
#include "localisation/odometry.h"
#include "localisation/pose_filter.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

namespace twocone::localisation {

/// A landmark that a MapFilter found.
struct FoundLandmark {
  std::size_t hue = 0;                                ///< RoughLandmark::hue
  Eigen::Vector4d numbers = Eigen::Vector4d::Zero();  ///< by vision::LandmarkNumber, m, in the world of the start pose
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
  std::size_t sightings = 0;    ///< number of observe() calls that saw it
  std::size_t first_frame = 0;  ///< number of the first one
  std::size_t last_frame = 0;   ///< number of the last one
};

/// Simultaneous localisation and mapping with an extended Kalman filter: the pose and landmarks that no map lists.
///
/// State: that of PoseHypothesis, and for each landmark place, top, and the logarithm of its radius, so that no radius
/// becomes negative. Measurements are the pixels of the near points of tops in the views that show them, and radii
/// where things have them measured. It is a Schmidt-Kalman filter of the shared errors of rig, exposure times and
/// wheels (PoseHypothesis): they are not estimated, but do not average away. The world is that of the start pose, which
/// is exact by definition.
///
/// Association: a thing is the landmark of its hue whose predicted pixels agree best, if chi-squared is within the
/// 1 - kGate quantile. It is a new landmark if both views show it, and it is farther than kApart_m and kApartSigmas
/// from every landmark of its hue. Between the two it is left out.
class MapFilter {
 public:
  /// The probability that a landmark that was seen before is not recognised.
  static constexpr double kGate = 1e-5;
  static constexpr double kApart_m = 0.4;
  static constexpr double kApartSigmas = 4;

  /// @param errors of the rig and of its exposure times @param wheels_by_shared as for PoseFilter; the same columns
  /// @param noise >= 0 each, time and angle > 0
  MapFilter(const vision::Rig& rig, const vision::BeliefErrors& errors, const WheelGeometry& wheels,
            const OdometryNoise& noise, const BySharedErrors<3>& wheels_by_shared, const Pose& start);

  /// Predicts the pose from the wheels' total angles at a time. The first call sets the zero.
  /// @throws std::invalid_argument as PoseFilter::predict
  void predict(double t_s, double left_rad, double right_rad);

  /// Updates pose and landmarks by what a frame shows, and adds the landmarks that are new. Returns for each thing the
  /// index of its landmark; nothing where it was left out.
  std::vector<std::optional<std::size_t>> observe(std::span<const vision::RoughLandmark> things);

  /// Updates a landmark by a radius that was measured otherwise. @param radius_m > 0 @param sigma_m > 0
  void update_radius(std::size_t landmark, double radius_m, double sigma_m);

  /// Removes the landmark with that index; those behind it move up.
  void remove(std::size_t landmark);

  [[nodiscard]] PoseEstimate pose() const;
  [[nodiscard]] std::size_t size() const { return known_.size(); }
  [[nodiscard]] FoundLandmark landmark(std::size_t index) const;
  /// Returns whether a view would show that landmark's top from the estimated pose, if nothing stands before it.
  [[nodiscard]] bool is_in_view(std::size_t index) const;
  /// Returns the number of calls of observe().
  [[nodiscard]] std::size_t frames() const { return frames_; }

 private:
  static constexpr Eigen::Index kPoseSize = 8;
  struct Known {
    std::size_t hue, sightings, first_frame, last_frame;
  };
  template <int kCols>
  using UpTo4Rows = Eigen::Matrix<double, Eigen::Dynamic, kCols, 0, 4, kCols>;
  using UpTo4By4 = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4>;
  /// Two measured numbers of each view that shows the landmark: measured minus expected = slopes (true - estimated pose
  /// and landmark) + noise + by_shared times the shared errors.
  struct Linear {
    UpTo4Rows<3> by_pose;
    UpTo4Rows<4> by_landmark;
    UpTo4Rows<1> difference;
    UpTo4By4 noise;
    Eigen::MatrixXd by_shared;
  };
  [[nodiscard]] static Eigen::Index at(std::size_t landmark) {
    return kPoseSize + vision::kLandmarkNumbers * Eigen::Index(landmark);
  }
  /// @param numbers of a landmark @returns nothing where a view that shows the thing cannot show it there
  [[nodiscard]] std::optional<Linear> linear(const vision::RoughLandmark& thing, const Eigen::Vector4d& numbers) const;
  /// Returns how the shared errors change what is measured minus what is expected of a landmark, by the estimates too.
  [[nodiscard]] Eigen::MatrixXd remaining_by_shared(const Linear& l, std::size_t landmark) const;
  [[nodiscard]] UpTo4By4 spread(const Linear& l, std::size_t landmark) const;
  /// Returns the probability that a thing which is that landmark differs as much from what is expected, or more; 0
  /// where a view cannot show it there.
  [[nodiscard]] double likeness(const vision::RoughLandmark& thing, std::size_t landmark) const;
  bool update(const vision::RoughLandmark& thing, std::size_t landmark);
  [[nodiscard]] bool is_apart(const vision::RoughLandmark& thing) const;
  std::optional<std::size_t> add(const vision::RoughLandmark& thing);
  [[nodiscard]] Pose estimated() const { return {state_[0], state_[1], state_[2]}; }
  /// Returns the numbers of a landmark, by vision::LandmarkNumber.
  [[nodiscard]] Eigen::Vector4d numbers(std::size_t landmark) const;

  vision::UncertainRig rig_;
  double sighting_px_;
  WheelGeometry wheels_;
  OdometryNoise noise_;
  BySharedErrors<3> wheels_by_shared_;
  Eigen::VectorXd state_;
  Eigen::MatrixXd own_;        ///< covariance of the state without the shared errors' part
  Eigen::MatrixXd by_shared_;  ///< of estimated minus true state
  std::vector<Known> known_;
  std::size_t frames_ = 0;
  struct Reading {
    double t_s, left_rad, right_rad;
  };
  std::optional<Reading> last_;
};

}  // namespace twocone::localisation
