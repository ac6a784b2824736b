// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

#include <Eigen/Core>

#include "vision/mirror_view.h"

namespace twocone::vision {

/// An upright cylinder with a flat top, in polar coordinates about the body's origin.
struct Cylinder {
  double range_m = 0;  ///< horizontal, to its axis
  double bearing_rad = 0;
  double radius_m = 0;
  double top_m = 0;  ///< over the floor
};

/// The edge of a cylinder in a view's image: up one side, over the near rim of the top, down the other side. It is a
/// chain of vertices, each with its derivatives by the cylinder's range and bearing.
///
/// The sides are where planes through the view's axis touch the cylinder; they meet the rim's arc without a corner.
/// Between vertices the chain bulges outwards as a parabola (`bulge_px` at its middle), computed from the neighbouring
/// vertices: otherwise the chord of a rim near the robot would lie a tenth of a pixel inside.
struct Outline {
  // Tuned by hand on synthetic images. outline_ranging_test.cpp,
  // WithoutNoiseFindsEveryLandmarkToAFewHundredthsOfAPixel, allows 0.03 px, of which the segments cause 0.01 px; it
  // does not fix the two numbers.
  static constexpr int kSideSegments = 3;
  static constexpr int kArcSegments = 24;
  static constexpr int kVertices = 2 * kSideSegments + kArcSegments + 1;

  struct Vertex {
    Eigen::Vector2d pixel_px;
    Eigen::Vector2d by_range_pxpm;      ///< d pixel / d range
    Eigen::Vector2d by_bearing_pxprad;  ///< d pixel / d bearing
    Eigen::Vector2d bulge_px;           ///< of the segment that begins here
    double chord_px;                    ///< distance to the opposite vertex
    double width_px;                    ///< the same on the sides, huge on the arc
  };
  std::array<Vertex, kVertices> vertices;

  /// The near point of the top: the middle of the arc.
  [[nodiscard]] const Vertex& near() const { return vertices[kSideSegments + kArcSegments / 2]; }
  /// Unit vector from the left side to the right one, at the ends of the arc.
  [[nodiscard]] Eigen::Vector2d across() const {
    return (vertices[kSideSegments + kArcSegments].pixel_px - vertices[kSideSegments].pixel_px).normalized();
  }
};

/// Returns nothing where the view does not show the whole near rim of the top, or where the cylinder encloses the axis.
/// @param least_radius_px radius at which the sides begin: nearer to the tip a landmark is too thin to separate them
std::optional<Outline> make_outline(const MirrorView& view, const Cylinder& cylinder, double least_radius_px);

}  // namespace twocone::vision
