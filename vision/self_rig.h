// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "base/plane.h"
#include "vision/calibration.h"
#include "vision/hue_labels.h"
#include "vision/mirror_search.h"
#include "vision/mirror_view.h"

/// Finds from images what a rig file states in pixels and angles, without believing these numbers: where each mirror
/// is, whether an image is mirrored, whether the two cameras are exchanged, and how each camera is turned. The physical
/// sizes and heights of the rig, and the map, are believed: no image shows them.
namespace twocone::vision {

/// One landmark's colour in one view, by its direction in the image.
struct ColourSighting {
  std::size_t landmark = 0;
  double angle_rad = 0;  ///< atan2(row, column) about the tip, undistorted image
  double top_px = 0;     ///< radius of its top, undistorted image
  double area_px = 0;
  bool at_rim = false;  ///< the rim cuts it: `top_px` is a lower bound
};

/// Landmarks in agreement below which no pose is found.
constexpr std::size_t kLeastRigLandmarks = 3;

/// Finds the landmarks' colours within an approximate circle. Up to two regions of each colour are given, the larger
/// first.
/// @param circle in the camera's image. @param lens undistorts the places; of the view nothing else is used
/// @param rgb CV_8UC3
std::vector<ColourSighting> sight_by_colour(const cv::Mat& rgb, const RimCircle& circle, const MirrorView& lens,
                                            const ColourTable& colours, std::size_t landmarks);

/// One frame of both cameras, named as the robot file names them.
struct SelfRigFrame {
  cv::Mat lower, upper;  ///< CV_8UC3, r g b, sRGB-coded; each camera's images have one size
  /// Pose of the body in the body frame of the previous frame of the list, from the wheels. Empty: not known.
  std::optional<Pose2> motion{};
  /// Heading in the world where it is known otherwise, such as at the start. Empty: not known.
  std::optional<double> heading_rad{};
};

struct SelfRigProblem {
  Rig rig;  ///< believed: sizes, heights and lenses are used, all else only where nothing is found
  /// Whether the believed centres and radii of the rims may serve where no rim is found. False: the robot file has
  /// none.
  bool has_believed_circles = true;
  std::vector<Landmark> landmarks;
  std::vector<SelfRigFrame> frames;  ///< at least one; some thirty of a drive are enough
};

/// The reason why something was not found.
enum class NotFound {
  kNothing,      ///< it was found
  kNoMirror,     ///< no mirror in one camera's images: MirrorSearch::verdict
  kNoLandmarks,  ///< fewer than three of the landmarks' colours in the images
  kNotTheMap,    ///< no pose explains the directions and ranges of the colours: another map, or wrong colours
  kUndecided,    ///< the images fit both answers, or contradict each other
  kNoMotion,     ///< needs a drive, or a heading that is known otherwise
};
std::string_view to_string(NotFound reason);

/// The answer to a question that has two. `value` is given if `reason` is kNothing.
struct Decision {
  std::optional<bool> value{};
  double sigmas = 0;  ///< how far the evidence is from the other answer
  NotFound reason = NotFound::kUndecided;
};

/// An angle with its sigma; given if `reason` is kNothing.
struct FoundAngle {
  std::optional<double> rad{};
  double sigma_rad = 0;
  NotFound reason = NotFound::kUndecided;
};

/// What was found in the images of one camera.
struct SelfView {
  MirrorSearch mirror;
  /// The circle with which the landmarks were sought; from the images, or believed. Empty: there is none.
  std::optional<RimMeasurement> circle{};
  bool is_circle_believed = false;  ///< no rim was found: the circle is that of the rig, or its radius from landmarks
  /// Position of the tip: the mean of rim and upright edges by their sigmas and by how far they are apart. Sigma is at
  /// least kLeastCentreSigma_px and, if they are apart by more than their sigmas, half of that distance.
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double sigma_centre_px = 0;
  Decision mirrored{};
  std::size_t landmarks = 0;  ///< number of different colours that were seen
  std::size_t fitted = 0;     ///< sightings that agree with the map
  /// Radius of the rim that the landmarks' ranges need, over that of `circle`, with its sigma; 0: not known.
  double range_scale = 0;
  double sigma_range_scale = 0;
  /// Tilt of the mirror and its camera, as MirrorViewSettings::tilt_rad; given if a pose was found.
  std::optional<Eigen::Vector2d> tilt_rad{};
  double sigma_tilt_rad = 0;  ///< about either axis

  /// Returns whether these images give nothing: no mirror was found, and no landmarks where the rig believes it to be.
  [[nodiscard]] bool is_blind() const { return !circle || (is_circle_believed && landmarks < 3); }
};

/// Everything that was found, in the order in which it was found.
struct SelfRig {
  std::array<SelfView, 2> views;  ///< of the cameras that the robot file calls lower and upper
  Decision exchanged;             ///< camera lower shows the upper mirror, and camera upper the lower one
  bool shows_one_mirror = false;  ///< both cameras show the same mirror, or the same image
  FoundAngle relative_azimuth;    ///< of the upper mirror's camera minus that of the lower mirror's, (-pi, pi]
  FoundAngle azimuth;             ///< of the lower mirror's camera

  /// Returns whether one camera gives nothing, or nothing that the other does not give: no rig can be found, and a
  /// believed one cannot be used.
  [[nodiscard]] bool is_blind() const { return shows_one_mirror || views[0].is_blind() || views[1].is_blind(); }
  /// The first reason for which a rig cannot be made, or kNothing. A missing `azimuth` is none: the lower view's
  /// azimuth only fixes which way the body calls forward.
  [[nodiscard]] NotFound missing() const;
};

/// Finds the rig from images:
///
/// 1. find_mirror() for each camera. Of several concentric circles the one is taken with which the landmarks have the
///    slopes over the horizon, and the ranges, that the map needs.
/// 2. Exchanged cameras: the lower mirror shows a top at the greater radius, relative to v = (d / R + cot a) r_m; the
///    logarithm of the ratio, averaged, has a sign and a sigma. Where no top is above both mirrors' tips, it shows a
///    top at the greater slope over the horizon, by their separation over the distance; a wave once round, which tilts
///    of the mirrors cause, is found with it.
/// 3. Mirrored images: directions and ranges of three and more landmarks fit the map by a rotation and a shift, or only
///    after a reflection. A range counts by the slope of its ray: where it is hardly known, four directions must fit.
///    Independent of the map: when the wheels turn the body left, image angles decrease.
/// 4. Relative azimuth: the difference of the image angles of landmarks that both views show. Azimuth: the direction in
///    which the body moves over the map, against the wheels' motion; or the given headings.
/// 5. Tilts: the slopes at which tops are seen from the poses, against those of the map, have a wave once round.
/// @throws std::invalid_argument for images of wrong type or size, no frame, or landmarks without a hue
SelfRig find_rig(const SelfRigProblem& problem);

/// Returns the believed rig with the centres, rim radii, azimuths, mirrored flags and tilts that were found. The views
/// are in the order of the mirrors: with exchanged cameras `lower` describes the images of the camera that the file
/// calls upper. Requires `missing()` to be kNothing.
Rig to_rig(const SelfRig& found, const SelfRigProblem& problem);

/// Centres that are a pixel off look like so much tilt.
constexpr double kLeastTiltSigma_rad = 0.003;
/// What edges without anti-aliasing leave, and a lens that makes the rim an ellipse beside the tip. Sixty robots as
/// built, in synthetic images, have 0.105 px in either direction.
constexpr double kLeastCentreSigma_px = 0.12;
/// Tilts of two degrees, and centres one pixel off, turn single bearings by about a degree; they average out over
/// landmarks all around, but not all of it.
constexpr double kLeastAzimuthSigma_rad = 0.005;

}  // namespace twocone::vision
