// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/plane.h"
#include "base/shared_errors.h"
#include "vision/mirror_view.h"

/// A rig whose numbers are not known exactly, and the effect of their errors on what is seen.
namespace twocone::vision {

/// Index of a number among those of one view.
enum ViewNumber : int {
  kColumn,
  kRow,
  kRim,
  kAzimuth,
  kTiltX,
  kTiltY,
  kOffsetX,
  kOffsetY,
  kApex,
  kMirrorRadius,
  kLensToTip,
  kK1,  ///< of the lens; where a view has none, about lens_axis_px and in units of v
  kK2,
  kViewNumbers
};
/// The numbers of a rig: the lower view's, the upper view's, then these.
enum RigNumber : int { kLensHeight = 2 * kViewNumbers, kSeparation, kRigNumbers };

/// Returns the index of a ViewNumber of one view among those of the rig.
constexpr int rig_number(Side side, int number) { return (side == Side::kLower ? 0 : kViewNumbers) + number; }

/// Returns the name of a RigNumber, which is its key in a robot file: lower.centre_px.column, mirror_separation_m.
std::string rig_number_name(int number);
/// Returns the numbers of a rig, by RigNumber. k1 and k2 of a view without a lens are 0.
Eigen::VectorXd numbers_of(const Rig& rig);

/// The numbers of Rig::exposures, s.
enum TimeNumber : int { kLateOfLower, kLateOfUpper, kReadoutOfLower, kReadoutOfUpper, kTimeNumbers };

/// Numbers of a landmark that a map holds.
enum LandmarkNumber : int { kPlaceX, kPlaceY, kTop, kRadius, kLandmarkNumbers };

/// The effect of the shared errors on what is believed of a rig and of landmarks, true minus believed numbers. A matrix
/// without columns: known exactly.
struct BeliefErrors {
  BySharedErrors<kRigNumbers> rig;
  BySharedErrors<kTimeNumbers> times;  ///< of Rig::exposures; they count while the body moves
  /// Standard deviation of an error of each sighting, px in either direction, that its own covariance does not count:
  /// the model's, which a calibration finds (CalibrationResult::systematic_px).
  double sighting_px = 0;
  std::vector<BySharedErrors<kLandmarkNumbers>> landmarks;  ///< one for each landmark; empty: all are known exactly
};

/// Returns the rig with `errors` (kRigNumbers numbers, in m, rad and px) added to its numbers; its exposures stay.
/// @throws as MirrorView
Rig with_errors(const Rig& rig, const Eigen::VectorXd& errors);

/// A rig with the uncertainty of its numbers.
class UncertainRig {
 public:
  /// Makes a rig that is known exactly.
  explicit UncertainRig(Rig rig) : UncertainRig(std::move(rig), BySharedErrors<kRigNumbers>()) {}
  /// @param by_shared true minus believed numbers
  UncertainRig(Rig rig, BySharedErrors<kRigNumbers> by_shared);

  [[nodiscard]] const Rig& rig() const { return rig_; }
  [[nodiscard]] bool is_exact() const { return by_shared_.cols() == 0; }
  [[nodiscard]] Eigen::Index errors() const { return by_shared_.cols(); }
  [[nodiscard]] const BySharedErrors<kRigNumbers>& by_shared() const { return by_shared_; }

  /// Returns the variance of the mirror's edge in the undistorted image, seen from its centre, px^2.
  [[nodiscard]] double edge_variance_px2(Side side) const;
  /// Returns the variance, rad^2, of the angle by which the image of an upright line leans, whose top is `radius_px`
  /// from the tip: a tilt of the unit leans it by up to as much, and a shift of the tip by its share of the radius.
  [[nodiscard]] double lean_variance_rad2(Side side, double radius_px) const;
  /// Returns the effect of the shared errors on the pixel of a landmark's near point (near_top_point), true minus
  /// believed, by central differences. Zero columns where the rig is exact; zeros where a view cannot show the point.
  /// @param p_BL_m position of the landmark's axis, body frame
  [[nodiscard]] BySharedErrors<2> pixel_by_shared(Side side, const Eigen::Vector2d& p_BL_m, double radius_m,
                                                  double top_m) const;
  /// Returns the effect of the shared errors on (range m, bearing rad) of a landmark by one view alone: measured minus
  /// true, to first order. Zeros where the view cannot show the near point.
  /// @param by_landmark true minus believed numbers; no columns: known exactly
  [[nodiscard]] BySharedErrors<2> place_by_shared(Side side, const Eigen::Vector2d& p_BL_m, const Landmark& landmark,
                                                  const BySharedErrors<kLandmarkNumbers>& by_landmark) const;

 private:
  /// The view with one number changed by a small step either way.
  struct Stepped {
    int number;  ///< a RigNumber
    double step;
    std::array<MirrorView, 2> views;  ///< with the number less, and more, by the step
  };
  [[nodiscard]] double variance(Side side, ViewNumber number) const;
  /// Returns the variance of the tip in one direction, the mean of column and row.
  [[nodiscard]] double centre_variance_px2(Side side) const;

  Rig rig_;
  BySharedErrors<kRigNumbers> by_shared_;
  std::array<std::vector<Stepped>, 2> stepped_;  ///< of both sides: the numbers that are uncertain and move its image
};

}  // namespace twocone::vision
