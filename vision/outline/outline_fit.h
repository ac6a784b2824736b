// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "base/plane.h"
#include "vision/hue_labels.h"
#include "vision/mirror_view.h"

/// The outline of a landmark in a view, the pixels along it, and the landmark's place that fits them best.
namespace twocone::vision {

/// An upright cylinder with a flat top, in polar coordinates about the body's origin.
struct Cylinder {
  double range_m = 0;  ///< horizontal, to its axis
  double bearing_rad = 0;
  double radius_m = 0;
  double top_m = 0;  ///< over the floor, see Landmark::top_m
  /// Relative standard deviation of the width that it appears to have in a view, because of what is not known exactly
  /// of rig and map. 0: it has that width.
  double width_doubt = 0;
  /// Standard deviation of the angle by which its image leans, rad, for the same cause.
  double lean_doubt_rad = 0;
  std::optional<Bands> bands{};  ///< round it; `top_m` is then the height of their line
  /// Standard deviation of `top_m`, for the same cause: bands show range and height apart. 0: it has that height.
  double height_doubt_m = 0;

  /// Returns the place of its axis in the body frame.
  [[nodiscard]] Eigen::Vector2d place_m() const {
    return {range_m * std::cos(bearing_rad), range_m * std::sin(bearing_rad)};
  }
  /// Returns the same cylinder at another place.
  [[nodiscard]] Cylinder at(const Eigen::Vector2d& place_m) const {
    Cylinder there = *this;
    there.range_m = place_m.norm();
    there.bearing_rad = std::atan2(place_m.y(), place_m.x());
    return there;
  }
};

/// The edge of a cylinder in a view's image: up one side, along the rim of the top, down the other side. It is a chain
/// of vertices, each with its derivatives by the cylinder's range and bearing. A view that looks up at the top shows
/// the near half of its rim, one that looks down shows the far half.
///
/// The sides are where planes through the view's axis touch the cylinder; they meet the rim's arc without a corner.
/// Between vertices the chain is a parabola (`bulge_px` at its middle), computed from the neighbouring vertices: the
/// chord of a rim near the robot would lie a tenth of a pixel inside, and that of a side, which a tilted mirror or a
/// lens bends, as much beside it.
struct Outline {
  // Tuned by hand on synthetic images. outline_ranging_test.cpp,
  // WithoutNoiseFindsEveryLandmarkToAFewHundredthsOfAPixel, allows 0.03 px, of which the segments cause 0.01 px; it
  // does not fix the two numbers.
  static constexpr int kSideSegments = 3;
  static constexpr int kArcSegments = 24;
  static constexpr int kVertices = 2 * kSideSegments + kArcSegments + 1;
  static constexpr int kMiddle = kSideSegments + kArcSegments / 2;  ///< index of the arc's middle

  enum Part : std::int8_t { kLeft, kArc, kRight };
  struct Vertex {
    Eigen::Vector2d pixel_px;
    Eigen::Vector2d by_range_pxpm;      ///< d pixel / d range
    Eigen::Vector2d by_bearing_pxprad;  ///< d pixel / d bearing
    /// d pixel / d ln(radius), while the near point stays; 0 where Cylinder::width_doubt is 0.
    Eigen::Vector2d by_width_px;
    Eigen::Vector2d by_height_pxpm;  ///< d pixel / d height; 0 where Cylinder::height_doubt_m is 0
    Eigen::Vector2d by_lean_px;      ///< d pixel / d angle, rad, of a turn of the image about the near point
    Eigen::Vector2d bulge_px;        ///< of the segment that begins here
    double chord_px;                 ///< distance to the opposite vertex
    double width_px;                 ///< the same on the sides, huge on the arc
  };
  std::array<Vertex, kVertices> vertices;
  Vertex near;  ///< the near point of the top, without what depends on neighbours

  /// The part of a band that a view shows: where a pixel of it must lie.
  struct Band {
    double from_px, to_px;  ///< distance from the tip, `from_px` of the lower end
    bool is_light;
  };
  /// A part of the edges of bands. Bands have edges that they bring along: light on one side, dark on the other. The
  /// background is seen beside the sides only.
  struct Strand {
    Part part;
    std::vector<Vertex> vertices;
    Band inside;                  ///< of an arc, the band below it
    std::optional<Band> outside;  ///< of an arc, the band above it
  };
  /// Of a banded landmark, in place of the chain, whose arc is then the line that the print marks.
  std::vector<Strand> strands;
  Eigen::Vector2d tip_px;

  /// Returns the unit vector from the left side to the right one, at the ends of the arc.
  [[nodiscard]] Eigen::Vector2d across() const {
    return (vertices[kSideSegments + kArcSegments].pixel_px - vertices[kSideSegments].pixel_px).normalized();
  }
};

/// Projects the cylinder's outline into the view. Returns nothing where the view does not show the whole of it, or
/// where the cylinder encloses the axis.
/// @param least_radius_px radius at which the sides begin; nearer to the tip a landmark is too thin to separate them
std::optional<Outline> make_outline(const MirrorView& view, const Cylinder& cylinder, double least_radius_px);

// ---- the pixels along an outline

/// The share of a pixel inside a straight edge, and its derivative by the edge's distance. It is exact for a square
/// pixel where `wide` and `narrow` are the larger and the smaller of |x| and |y| of the edge's normal, times the
/// pixel's width.
struct Coverage {
  double value, slope;
};
/// Computes the coverage of a pixel whose centre lies `inside_px` inside the edge (negative: outside).
inline Coverage coverage(double inside_px, double wide, double narrow) {
  const double half = (wide + narrow) / 2;
  const double distance = std::abs(inside_px);
  if (distance >= half) return {inside_px > 0 ? 1.0 : 0.0, 0.0};
  if (distance <= (wide - narrow) / 2) return {0.5 + inside_px / wide, 1 / wide};
  const double corner = half - distance;
  const double area = corner * corner / (2 * wide * narrow);
  return {inside_px > 0 ? 1 - area : area, corner / (wide * narrow)};
}

/// One pixel on the outline: its place relative to the outline, and the landmark's coverage measured by its colour.
struct EdgePixel {
  float inside_px;  ///< signed distance of its centre to the outline, inside positive
  float coverage;   ///< measured: 0 background, 1 landmark; noise may take it beyond either
  float variance;   ///< of `coverage` for a noise of one grey level
  bool is_inside;   ///< its colour is that of the landmark, not of the background
};

/// A place along the outline where it crosses one row or column of pixels.
struct EdgeSample {
  Outline::Part part;
  bool is_usable;                     ///< its colour inside, another colour outside, enough contrast, within the image
  float wide, narrow;                 ///< larger and smaller of the normal's |x| and |y|
  float by_range_pxpm;                ///< outward motion of the outline with the landmark's range ...
  float by_bearing_pxprad;            ///< ... and bearing ...
  float by_width_px, by_lean_px;      ///< ... and width and lean, see Outline::Vertex
  float by_height_pxpm;               ///< ... and height
  float row;                          ///< of the image, where it is
  float width_px;                     ///< distance to the opposite side
  float inside_noise, outside_noise;  ///< variance of the landmark's and the background's colour, over that of a pixel
  /// Distance by which the outline lies outside the straight edge that cuts a pixel into the same areas: its curvature,
  /// 1/px, over kBends. EdgePixel::inside_px is the distance to the straight edge.
  float bend_px;
  static constexpr float kBends = 24;
  float doubt;       ///< variance of coverage because the background beside it differs from the one assumed
  int first, count;  ///< index of its first pixel, and their number
};

/// The outline's edge samples in order along it, with their pixels.
struct EdgeSamples {
  std::vector<EdgeSample> edge_samples;
  std::vector<EdgePixel> pixels;
  int too_bright = 0;        ///< number of edge samples whose contrast is lost in channels at full scale
  double code_variance = 0;  ///< of pixels beside the outline about their neighbours, grey levels squared, median
  void clear();
};

/// The pixels that are read on either side of an outline.
struct SampleReach {
  /// Distance inside and outside at which the colours of landmark and background are read. It is larger than the error
  /// of the outline.
  double colours_px = 0;
  double blur_px = 1;  ///< assumed width of the edges
  /// Width of the edges where earlier fits have measured it. A pixel of a landmark that is no wider than two edges is a
  /// mixture, in shares that follow from it.
  double measured_blur_px = 1;
  /// A colour is the mean of this number of pixels of a row or column, if so many show that colour alone. Few pixels
  /// are more accurate where light and background change along the row; many pixels are more accurate where there is
  /// noise. Tuned by hand on synthetic images; no test fixes it.
  int samples = 3;
};

/// How a landmark's surface differs from others.
struct Surface {
  std::uint8_t label = 0;      ///< in the table of colours; 0: it is banded
  float limit_of_light = 0.F;  ///< BandCandidate::limit
};

/// Reads the pixels along an outline.
/// @param stride distance of the rows and columns that are read: 1 for all
void read_edge_samples(const cv::Mat& rgb, const ColourTable& table, const Surface& surface, const Outline& outline,
                       const SampleReach& reach, int stride, EdgeSamples& edge_samples);

// ---- the fit

/// The scatter of pixels about the model.
struct PixelNoise {
  double code_variance = 1;  ///< grey levels squared
  /// The variance of a pixel's coverage c is this share of c (1 - c): 1 where each pixel is a single ray, 0 where it is
  /// the mean over its area. The default serves coarse fits; it is tuned by hand on synthetic images, and no test fixes
  /// it.
  double sampling = 0.1;
};

/// The limits of a fit. All calls in this library set all three values, so the defaults are not used.
struct FitLimits {
  /// The interval of the edges' width. The fit starts at its lower end, which is 1 where a pixel is the mean over its
  /// own area.
  double least_blur_px = 1;
  double most_blur_px = 8;
  double converged_px = 1e-7;  ///< the fit stops at a step below this
};

/// Sums of the edge samples' scores (the slopes of the likelihood), squared and with the products of neighbours. They
/// measure the real scatter of the data, whatever its cause.
struct Scores {
  double found = 0;
  double expected = 0;  ///< for the given PixelNoise and no correlation; also the information of the samples, in 1/px^2
};

/// What a fit shows of the image's noise and blur.
struct EdgeStatistics {
  double code_variance = 0;  ///< EdgeSamples::code_variance
  double residual = 0;       ///< sum over edge pixels of squared coverage residuals
  double grey = 0;           ///< sum over edge pixels of the coverage variance caused by a noise of one grey level
  double spread = 0;         ///< sum over edge pixels of c (1 - c)
  double mixed = 0;          ///< the same sum of the measured coverages, limited to 0 to 1
  double blur = 1;           ///< width of the edges, in pixels
};

/// The most likely place of one cylinder in one view.
struct OutlineFit {
  Cylinder cylinder;
  Outline outline;              ///< of the cylinder from which the fit started
  Eigen::Vector2d step;         ///< from that cylinder to `cylinder`, (range m, bearing rad)
  Eigen::Matrix2d information;  ///< of (range m, bearing rad) for the given PixelNoise
  double height_step_m = 0;     ///< from that cylinder's top to that of `cylinder`
  /// Covariance of (range m, bearing rad, height m), where the height is in doubt.
  std::optional<Eigen::Matrix3d> with_height{};
  double exposed_row = 0;  ///< see Sighting::exposed_row
  double length_px = 0;    ///< length of the outline that was used
  double arc_support = 0;  ///< share of the arc, and of each side, that can be used
  double left_support = 0, right_support = 0;
  /// Width of the cylinder's outline minus the observed width, a mean along the sides.
  double narrowness_px = 0;
  double sigma_narrowness_px = 0;
  double mean_width_px = 0;  ///< of the cylinder's outline, the same mean
  // These are pooled over the landmarks of an image:
  Scores arc_scores, side_scores;
  EdgeStatistics edges;
};

/// Fits range, bearing and blur to the pixels' coverage by least squares. Returns nothing where too little of the
/// outline is usable.
/// @param outline the outline of `cylinder`, from which the edge samples were read
std::optional<OutlineFit> fit_outline(const EdgeSamples& edge_samples, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits);

}  // namespace twocone::vision
