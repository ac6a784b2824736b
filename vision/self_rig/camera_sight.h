// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "vision/self_rig.h"
#include "vision/self_rig/image_pose.h"

/// What one camera shows of its mirror and of the map. Private to the search of the rig.
namespace twocone::vision {

/// Sigma of a rim's radius that is found, over the radius: also where d / R is off by a ruler's millimetre.
constexpr double kFoundRadiusShare = 0.02;

using Sightings = std::vector<std::vector<ColourSighting>>;  // frame by frame
using Poses = std::vector<std::optional<ImagePose>>;         // frame by frame

/// The fit of all frames of one camera.
struct CameraFit {
  Poses poses;
  std::size_t fitted = 0;
  double slope_error = 0;  ///< median over the frames of the mean of slope_error()
  double range_scale = 0;  ///< as SelfView
  double sigma_range_scale = 0;
};

/// One camera's circle, sightings, and their fits under each guess.
struct CameraSight {
  Side camera = Side::kLower;
  SelfView view;  ///< `mirrored`, `fitted` and the scale of ranges are not decided yet
  Sightings sightings;
  std::array<std::array<CameraFit, 2>, 2> fits;  ///< by mirrored, mirror

  [[nodiscard]] const CameraFit& fit_of(const Guess& guess) const {
    return fits[guess.mirrored][std::size_t(guess.mirror)];
  }
  /// Returns the fit with the most landmarks; of equal ones, that of the camera's own mirror, not mirrored.
  [[nodiscard]] const CameraFit& best_fit() const;
  /// Returns by how much tops differ from the map, by their slopes over the horizon; infinite where no pose explains
  /// their directions.
  [[nodiscard]] double least_slope_error() const;
};

/// Finds the circle of a camera's mirror, the landmarks in it, and the poses that explain them. Chooses among
/// concentric circles and believed radii those with which the landmarks are as far and as high as on the map.
CameraSight sight_camera(const SelfRigProblem& problem, Side camera);

/// Returns the standard deviation of values about their median, by base::robust_sigma().
double scatter_about(double median, std::vector<double> values);

}  // namespace twocone::vision
