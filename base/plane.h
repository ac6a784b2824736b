// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

namespace twocone {

/// Pose X_WB of the robot's body B in the world W. World and body are right-handed, x forward, y left, z up
/// (REP 103); the body's origin lies on the floor below the mirrors' common axis.
struct Pose2 {
  double x_m = 0;
  double y_m = 0;
  double heading_rad = 0;  ///< counter-clockwise from world x, in (-pi, pi]

  friend bool operator==(const Pose2&, const Pose2&) = default;
};

/// The body's velocity: forward along its x axis, and its turn rate.
struct BodyTwist {
  double forward_mps = 0;
  double turn_radps = 0;
};

struct FloorPoint {
  double x_m = 0;
  double y_m = 0;

  friend bool operator==(const FloorPoint&, const FloorPoint&) = default;
};

struct Disc {
  FloorPoint centre;
  double radius_m = 0;  ///< > 0

  friend bool operator==(const Disc&, const Disc&) = default;
};

/// A rectangle parallel to the axes of the world, min < max.
struct Bounds {
  double min_x_m = 0, max_x_m = 0;
  double min_y_m = 0, max_y_m = 0;

  friend bool operator==(const Bounds&, const Bounds&) = default;
};

/// Standard deviations of what is believed of a landmark, independent of each other, >= 0; 0: known exactly.
struct LandmarkSigma {
  double x_m = 0;
  double y_m = 0;
  double top_m = 0;
  double radius_m = 0;

  friend bool operator==(const LandmarkSigma&, const LandmarkSigma&) = default;
};

/// The printed bands round a cylinder, light and dark, that carry its number (vision/bands/band_code.h).
struct Bands {
  int number = 0;         ///< 1 to vision::kBandNumbers
  double cell_m = 0.017;  ///< height of one of the equal cells, > 0; 16 cells of this default fit on a page of A4

  friend bool operator==(const Bands&, const Bands&) = default;
};

/// An upright cylinder at a known place. World frame, metres.
struct Landmark {
  std::string name{};
  /// Linear rgb, each in [0, 1]; its hue identifies the landmark. Of a banded landmark it has no meaning.
  std::array<double, 3> colour{};
  double x_m = 0;  ///< of the axis
  double y_m = 0;
  double radius_m = 0;  ///< > 0
  /// Height above the floor, > 0, of the circle that sightings are of: the rim of the flat top, or, of a banded
  /// landmark, the line of its bands that the print marks.
  double top_m = 0;
  /// Greatest distance of a robot from its axis, > radius_m, which limits how small the landmark can appear. Empty: it
  /// may be as small as the smallest object that method `outline` detects.
  std::optional<double> greatest_range_m{};
  LandmarkSigma sigma{};
  std::optional<Bands> bands{};  ///< nothing: its hue identifies it

  friend bool operator==(const Landmark&, const Landmark&) = default;
};

/// Returns whether two landmarks have the same colour, or the same bands: whether they may be one.
inline bool look_alike(const Landmark& a, const Landmark& b) {
  return a.bands == b.bands && (a.bands || a.colour == b.colour);
}

namespace base {

/// Returns `angle_rad` wrapped to (-pi, pi], accurate to the spacing of doubles for any number of turns. The doubles
/// nearest to pi and -pi are both inside and do not change. A value that is not finite becomes NaN.
inline double wrap_angle_rad(double angle_rad) {
  if (std::abs(angle_rad) <= std::numbers::pi) return angle_rad;
  // std::remainder with a rounded 2 pi would be off by 4e-17 for each turn; the library reduces the arguments of sin
  // and cos with all digits of pi.
  return std::atan2(std::sin(angle_rad), std::cos(angle_rad));
}

}  // namespace base
}  // namespace twocone
