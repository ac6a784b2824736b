// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "base/plane.h"
#include "base/shared_errors.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// The width of a landmark in one view: the distance of its sides, a mean along them.
struct OutlineWidth {
  double expected_px = 0;  ///< that of a landmark of the believed radius, at the place that the outline shows
  double seen_px = 0;
  double sigma_px = 0;  ///< of `seen_px`, from noise alone
};

/// The position of a landmark in one view: the pixel of the *near point* of its top, which is the point of the top's
/// rim nearest to the view's axis (near_top_point). It is measured from the whole outline, so it is sub-pixel and needs
/// no feature of its own in the image.
struct Sighting {
  Eigen::Vector2d pixel_px = Eigen::Vector2d::Zero();  ///< column, row; pixel (0, 0) is the first one's centre
  Eigen::Matrix2d covariance_px2 = Eigen::Matrix2d::Identity();  ///< of column and row
  /// Standard deviation of the outline's position along its normal, for each pixel of its length: noise over contrast.
  /// Empty where no outline was fitted (Stage::kFound).
  std::optional<double> edge_noise_px{};
  /// The row at whose exposure the sighting counts, where rows are exposed one after the other. An outline's bearing is
  /// a mean over its sides, so it is not the near point's row. Empty: it is.
  std::optional<double> exposed_row{};
  /// Empty where no outline shows both sides.
  std::optional<OutlineWidth> width{};
};

/// Returns the position of a landmark's axis.
inline Eigen::Vector2d place_m(const Landmark& landmark) { return {landmark.x_m, landmark.y_m}; }

/// Returns the landmark's axis in the body frame, if the view's ray meets the near point at the height of its top.
/// Returns nothing where the ray does not reach that height.
std::optional<Eigen::Vector2d> axis_at_height(const MirrorView& view, const Ray& ray, double radius_m, double top_m);

/// Returns the near point in the body frame, p_BL - radius_m * outwards at height `top_m` over the floor. `outwards` is
/// the horizontal unit vector from the view's axis (MirrorViewSettings::axis_offset_m) to the landmark's. Returns
/// nothing where the view's axis lies within the landmark, and for input that is not finite.
std::optional<Eigen::Vector3d> near_top_point(const MirrorView& view, const Eigen::Vector2d& p_BL_m, double radius_m,
                                              double top_m);

/// Returns where a place that stands in the world is in the body's frame after the body has moved on for `time_s`,
/// which may be negative. The way is taken as straight, and the turn at its end.
Eigen::Vector2d place_after(const Eigen::Vector2d& p_BL_m, const BodyTwist& twist, double time_s);

/// The motion of the body while the two images of a frame are exposed. The frame's time is the stamp of its lower
/// image.
struct FrameMotion {
  BodyTwist twist;
  double upper_later_s = 0;  ///< stamp of the upper image minus that of the lower one
};
/// @param twist nothing: the motion is not known
inline std::optional<FrameMotion> frame_motion(const std::optional<BodyTwist>& twist, double upper_later_s) {
  return twist ? std::optional(FrameMotion{*twist, upper_later_s}) : std::nullopt;
}

/// Returns how much later than the middle row a sighting is exposed, as a share of the readout time.
inline double readout_share(const Sighting& sighting, int height_px) {
  return readout_share(sighting.exposed_row.value_or(sighting.pixel_px.y()), height_px);
}

/// Returns the pixel that shows a landmark's near point at the frame's time, from the pixel that shows it `late_s`
/// later. The landmark stands in the world where the pixel's ray meets its top, or far away on a ray that does not meet
/// it. Returns the same pixel where there is no ray.
Eigen::Vector2d pixel_at_frame(const MirrorView& view, const Eigen::Vector2d& later_px, const Landmark& landmark,
                               const BodyTwist& twist, double late_s);

/// The reason why a range is given or withheld.
enum class RangeVerdict {
  kOk,
  kNotSeen,      ///< no pixel of its colour in the lower mirror (method `outline`: in neither mirror)
  kTruncated,    ///< its colour reaches the lower rim: the top lies outside the mirror, the landmark is too near
  kNoMatch,      ///< seen, but no match in the upper mirror (method `outline`: no outline can be fitted)
  kBeyondLimit,  ///< the disparity is not positive: farther than the views can measure
  kSameColour,   ///< another landmark has this hue, so the two cannot be distinguished
  kOneView,      ///< given, from one view and the top's known height: the other view does not show the top
  kOccluded,     ///< something hides a part of the outline: given without bearing where the top is whole, else withheld
  kSaturated,    ///< too bright: its colour is lost, so its outline is not trusted
  kTwoCandidates,  ///< two objects of its colour are seen, and nothing shows which one is the landmark
  kInconsistent,   ///< the two views contradict each other, or the map's height and radius of the landmark
  kImpossible,     ///< no place in the world gives these radii
};
/// Returns the name in ranges.csv: ok, not_seen, truncated, no_match, beyond_limit, same_colour, one_view, occluded,
/// saturated, two_candidates, inconsistent, impossible.
std::string_view to_string(RangeVerdict verdict);

/// The measurement of one landmark in one stereo frame. Fields without an answer are empty.
struct RangeMeasurement {
  RangeVerdict verdict = RangeVerdict::kNotSeen;
  std::optional<double> range_m;        ///< horizontal distance from the mirrors' axis to the landmark's axis
  std::optional<double> sigma_range_m;  ///< where the method states one
  std::optional<double> bearing_rad;    ///< in the body frame, (-pi, pi]
  std::optional<double> sigma_bearing_rad;
  std::optional<double> disparity_px;       ///< radial, lower minus upper
  std::optional<Eigen::Vector2d> lower_px;  ///< column, row of the match
  std::optional<Eigen::Vector2d> upper_px;
  std::optional<Eigen::Matrix2d> covariance;  ///< of (range m, bearing rad), where the method states one
  /// The part of `covariance` that the images' noise causes. The rest is by_shared by_shared^T.
  std::optional<Eigen::Matrix2d> own_covariance;
  BySharedErrors<2> by_shared;  ///< of measured minus true (range m, bearing rad), by errors of rig and landmark
  std::optional<Sighting> lower_sighting;  ///< where the method makes them
  std::optional<Sighting> upper_sighting;
};

/// RoughLandmark::hue of banded things begins here: in place of a hue they have a number.
constexpr std::size_t kBandedHue = 1000;

/// What the views show of an upright thing of one colour, or with bands: from a search, located to a pixel or so in
/// both of them (outline/finder.h), or from an outline.
struct RoughLandmark {
  std::size_t hue = 0;  ///< index into the colours of LandmarkSearch, or kBandedHue + the number of its bands
  std::array<Sighting, 2> views{};  ///< of the near point of its top, at the frame's time: lower, upper
  /// Whether that view shows it. The sighting of a view that does not has no meaning.
  std::array<bool, 2> is_shown{true, true};
  double range_m = 0;         ///< to its axis, from the disparity
  double bearing_rad = 0;     ///< body frame
  double top_m = 0;           ///< over the floor
  double radius_m = 0;        ///< from its area in the lower view; too small where a part of it is hidden
  double radius_sigma_m = 0;  ///< of `radius_m` if it was measured otherwise; 0: it is only a start
};

/// Returns the answer, of a method or of a part of one, with that verdict in it.
template <typename Answer>
Answer with_verdict(Answer answer, RangeVerdict verdict) {
  answer.verdict = verdict;
  return answer;
}

}  // namespace twocone::vision
