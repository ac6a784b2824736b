// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/rim.h"

/// Finds the mirror in a camera's images without any expectation of where it is.
namespace twocone::vision {

enum class MirrorVerdict {
  kFound,
  kDark,      ///< so dark that no pixel has a hue: a lens cap, no light, or a dead camera
  kEven,      ///< no edges: fog, a cover, an overexposed image
  kNoCircle,  ///< edges, but no circle that could be a rim
  kNoMirror,  ///< a circle, but its inside is not the image of a cone: the upright edges do not point at its middle
};
std::string_view to_string(MirrorVerdict verdict);

/// The mirror in the images of one view.
struct MirrorSearch {
  MirrorVerdict verdict = MirrorVerdict::kNoCircle;
  std::optional<RimMeasurement> rim;  ///< given with kFound
  /// Circles about the same middle with as much support: a bright ring around the mirror has two edges. The images
  /// alone cannot decide which is the rim; `rim` is the innermost. Ranges of landmarks decide (vision/self_rig.h).
  std::vector<RimMeasurement> others;
  std::optional<TipMeasurement> tip;  ///< where enough upright edges are seen
  /// Share of the edges inside the circle that point at its middle, within kUpright_rad. Edges in all directions give
  /// kUprightByChance.
  double upright_share = 0;
};

/// Searches all circles with a centre in the image and a radius of a tenth to seven tenths of its longer side.
///
/// 1. Images are reduced to about 160 pixels. The direction of each edge is averaged over the images, with doubled
///    angles: the rim and its mountings stay in place and add up, also where the background changes between brighter
///    and darker than the rim, and what moves does not.
/// 2. For each centre and radius, the support is the share of the directions, of those that lie in the image, in which
///    an edge of that radius is perpendicular to the direction. So a mast before the rim or an image that ends before
///    the rim costs only these directions.
/// 3. The best circles are located by measure_rim() in the median image, or, if this gives nothing, by find_rim().
/// 4. measure_tip() finds the tip near the circle's middle.
///
/// A circle is the mirror only if the image inside is that of a cone: images of upright edges point at the tip.
///
/// Sigmas are those of measure_rim(). If only find_rim() gives an answer (a black background), they are
/// kRoughRimSigma_px.
/// @param images CV_8UC3 of one size, at least one: of a robot at rest or in motion
/// @throws std::invalid_argument otherwise
MirrorSearch find_mirror(std::span<const cv::Mat> images);

/// find_rim() accepts edges within a pixel of the circle. Before black it takes the middle of a step in coded values,
/// which is up to half a pixel from the middle of the light.
constexpr double kRoughRimSigma_px = 0.5;
constexpr double kUpright_rad = 0.25;
constexpr double kUprightByChance = 2 * kUpright_rad / std::numbers::pi;

}  // namespace twocone::vision
