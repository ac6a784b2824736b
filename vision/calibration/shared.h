// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vision/calibration.h"

namespace twocone::vision::calibration {

/// Index of a number among those of its view.
enum ViewNumber : int {
  kColumn,
  kRow,
  kRim,
  kAzimuth,  // of the upper view: minus the lower one's
  kTiltX,
  kTiltY,
  kOffsetX,  // of the upper view: minus the lower one's
  kOffsetY,
  kApex,
  kMirrorRadius,
  kLensToTip,
  kK1,
  kK2,
  kViewNumbers
};
/// The numbers that all frames share: the lower view's, the upper view's, then these.
enum SharedNumber : int {
  kLensHeight = 2 * kViewNumbers,
  kSeparation,
  kWheelRadius,
  kWheelRatio,
  kWheelSeparation,
  kLatency,
  kSkew,
  kLowerReadout,
  kUpperReadout,
  kSharedNumbers
};
using Shared = Eigen::Matrix<double, kSharedNumbers, 1>;

inline int index_of(Side side, int number) { return (side == Side::kLower ? 0 : kViewNumbers) + number; }

/// The constants of a view, which are not estimated.
struct ViewConstants {
  double sense = 1;  ///< -1 where the view is mirrored
  bool has_lens = false;
  Eigen::Vector2d focal_px = Eigen::Vector2d::Ones();
  Eigen::Vector2d principal_px = Eigen::Vector2d::Zero();
  std::array<double, 6> further{};  ///< p1 p2 k3 k4 k5 k6
  std::size_t lens_terms = 4;
};

/// The prior of the shared numbers, which also gives their scale: number = mean + sigma * unknown. A number with sigma
/// 0 is a constant.
struct SharedModel {
  Shared mean = Shared::Zero();
  Shared sigma = Shared::Zero();
  std::array<ViewConstants, 2> views;
  bool has_wheels = false;
  WheelBelief wheels;  ///< used for the wheels' noise
  double landmark_sigma_m = 0;

  explicit SharedModel(const CalibrationProblem& problem);

  /// The numbers with sigma 0.
  [[nodiscard]] std::vector<int> constants() const;
  [[nodiscard]] Shared numbers(const Shared& unknowns) const { return mean + sigma.cwiseProduct(unknowns); }
};

MirrorView to_view(const SharedModel& model, const Shared& numbers, const MirrorViewSettings& like, Side side);
std::string name_of(int shared_number);

}  // namespace twocone::vision::calibration
