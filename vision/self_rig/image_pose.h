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

/// Least relative standard deviation of the range that one sighting by colour gives.
constexpr double kLogRangeSigma = 0.2;
/// Sigma of the elevation of a top. Of a mirror that is tilted by a degree, it is off by two degrees.
constexpr double kElevationSigma_rad = 0.05;

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
  double sigma_log;  ///< standard deviation of the range's logarithm: the less steep the ray, the larger
};

/// Pose of the image's x axis in the world.
struct ImagePose {
  Complex place_m;
  double heading_rad = 0;
  double sigma_heading_rad = 0;
  std::vector<std::size_t> fitted;  ///< indices into the frame's sightings
  double mean_log_scale = 0;        ///< of measured ranges over those of the pose
  double sigma_log_scale = 0;       ///< infinite without a range
};

inline Complex place_of(const Landmark& landmark) { return {landmark.x_m, landmark.y_m}; }

/// Returns the view of a mirror that is upright and on the body's axis, with its tip at pixel (0, 0).
MirrorView upright_view(const Rig& rig, Side mirror, double rim_px);

/// Returns by how much a view, with its tip at pixel (0, 0), shows a top too high, over its distance. Nothing where no
/// ray shows it.
std::optional<double> slope_error(const MirrorView& view, const ColourSighting& sighting, const Landmark& landmark,
                                  double distance_m);

/// Returns the sightings of a frame with the ranges that an upright_view gives them.
std::vector<Ranged> ranged(const std::vector<ColourSighting>& sightings, const MirrorView& view, bool mirrored,
                           const std::vector<Landmark>& landmarks);

/// Returns the pose with which most sightings agree; nothing if fewer than kLeastRigLandmarks do. Poses are tried from
/// each two directions with ranges, and, where these are hardly known, from each three directions; then one more
/// landmark must agree.
std::optional<ImagePose> pose_of(const std::vector<Ranged>& sightings, const std::vector<Landmark>& landmarks);

}  // namespace twocone::vision
