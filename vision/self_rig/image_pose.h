// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <optional>
#include <vector>

#include "vision/self_rig.h"

/// The pose from which one camera sees the landmarks of a map, by their colours alone. Private to the search of the
/// rig.
namespace twocone::vision {

using Complex = std::complex<double>;

/// Returns the unit vector of a direction.
inline Complex unit(double rad) { return std::polar(1.0, rad); }

/// Relative standard deviation of the range that one sighting by colour gives: a camera that is tilted by 2 degrees
/// moves tops by 25 px, which is a third of a range at the usual radii of 80 px.
constexpr double kLogRangeSigma = 0.2;

/// The answers that are tried for one camera.
struct Guess {
  bool mirrored = false;
  Side mirror = Side::kLower;  ///< the one that it shows
};

/// A landmark's sighting with the range that one mirror gives.
struct Ranged {
  std::size_t landmark;
  double angle_rad;  ///< counter-clockwise as bearings: negated where the image is mirrored
  double range_m;    ///< to the axis; 0: not known
};

/// Pose of the image's x axis in the world.
struct ImagePose {
  Complex place_m;
  double heading_rad = 0;
  std::vector<std::size_t> fitted;  ///< indices into the frame's sightings
  double mean_log_scale = 0;        ///< of measured ranges over those of the pose
};

/// Returns the sightings of a frame as the guess reads them, for a mirror that is upright and on the body's axis, with
/// a rim of that radius.
std::vector<Ranged> ranged(const std::vector<ColourSighting>& sightings, const Guess& guess, const Rig& rig,
                           double rim_px, const std::vector<Landmark>& landmarks);

/// Returns the pose with which most sightings agree; nothing if fewer than kLeastRigLandmarks do.
std::optional<ImagePose> pose_of(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks);

}  // namespace twocone::vision
