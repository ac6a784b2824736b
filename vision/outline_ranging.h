// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "base/plane.h"
#include "vision/mirror_view.h"
#include "vision/ranging.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {

/// The stage to which a landmark has been measured.
enum class Stage {
  /// From the pixels of its colour alone: the top to a third of a pixel, at by far the lowest cost. This stage hardly
  /// detects that the landmark is saturated or that something hides a part of it. A hidden top gives a wrong place,
  /// which only other landmarks can contradict. Landmarks only a few pixels wide have an answer too.
  kFound,
  kCoarse,  ///< its outline in every third row and column, fitted roughly
  kFine,    ///< its whole outline: OutlineRanging::measure()
};
/// Returns found, coarse or fine.
std::string_view to_string(Stage stage);

enum class Views { kBoth, kLower, kUpper };

/// The places of landmarks in the body frame at a frame's time, as they are expected before they are looked for: for
/// each target, or for none of them. Directions must be accurate to kExpectedWithin_rad.
using ExpectedPlaces = std::vector<std::optional<Eigen::Vector2d>>;
constexpr double kExpectedWithin_rad = 8 * std::numbers::pi / 180;

class OutlineRanging;

/// One stereo frame that is measured landmark by landmark. It must not outlive the OutlineRanging that made it, nor the
/// images' pixels, which are not copied. Its answers are a function of the images and of the sequence of calls; it uses
/// no clock.
class FrameObservation {
 public:
  ~FrameObservation();
  FrameObservation(FrameObservation&&) noexcept;
  FrameObservation& operator=(FrameObservation&&) noexcept;

  /// Sets the expected place of a landmark, body frame, accurate to half a pixel or so in both views: for example from
  /// a fix of the landmarks measured so far. take() then starts at that place and saves coarse fits. If the outline
  /// is not there, it starts from the found candidate, as it does without an expected place. The call has no effect if
  /// the range is not greater than the landmark's radius.
  void expect(std::size_t landmark, double range_m, double bearing_rad);

  /// Measures these landmarks to at least this stage in these views; their state in the other view does not change. The
  /// values that the fits of one view share (blur, noise, scatter) are those of the landmarks measured so far.
  /// @throws std::out_of_range for a landmark that is not one of the targets
  void take(std::span<const std::size_t> landmarks, Stage stage, Views views = Views::kBoth);

  /// Returns one measurement for each target, at the stage that it has reached: kFound before the first take().
  [[nodiscard]] std::vector<RangeMeasurement> measurements() const;

  /// Returns the number of landmarks whose whole outline was fitted in one view or both.
  [[nodiscard]] int refined() const;

 private:
  friend class OutlineRanging;
  struct Impl;
  explicit FrameObservation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Method `outline`: each landmark's outline is fitted to the pixel coverage in both views; then the views are
/// triangulated. The answer is a function of the two images alone: no state of an earlier frame is kept.
///
/// 1. Each view is searched for each landmark's hue (outline/finder.h). Landmarks appear as wedges that point at the
///    tip and are found to a pixel or two.
/// 2. The outline of an upright cylinder, sides and near rim of the top, is projected and compared with the pixels that
///    it crosses (outline/outline_fit.h). The landmark's coverage of a pixel is read from the pixel's colour in linear
///    light, between the landmark's colour just inside and the background's colour just outside. A pixel has more
///    weight the darker it is, and less where its colour is not a mixture of the two. The fit is weighted least squares
///    over range, bearing and the edges' width, in rounds; the last round uses the width and the noise that all
///    landmarks of the image share. If the rig is uncertain, so are the landmark's width in the image and the
///    direction of its sides. Then they are unknowns, too: sides that contradict the believed rig do not move the top.
/// 3. The covariance is that of the fit, scaled by the observed scatter of the edge samples along the outlines. It is
///    widened where the two sides are farther apart, or nearer, than those of the cylinder.
/// 4. While the body moves, pixels are moved to where the frame's time would have shown them (pixel_at_frame).
/// 5. triangulate() combines the views: RangeVerdict kOk, kOneView, kInconsistent, kBeyondLimit, kImpossible as there.
///    kInconsistent is also the verdict where the map's height and radius are contradicted: both views show the whole
///    top, but at another height than the map's, however different; or the only view with an outline shows the landmark
///    wider than it is at that range.
///
/// A banded landmark (Landmark::bands) is read instead by bands/band_finder.h, where all its bands are in the mirror; a
/// view that cannot read them looks where the other one reads them. What is fitted are the edges of its bands, between
/// light and dark of its own, and its sides. It has no rivals but a second one of its number, needs no top inside the
/// mirror, and whatever hue its surroundings have. Bands whose own size contradicts the height of their line are
/// kInconsistent.
///
/// Further verdicts: kSameColour and kTwoCandidates (two objects of one hue, each large enough to be the landmark
/// somewhere within Landmark::greatest_range_m (outline/view_fitter.h), or the views disagree on the bearing),
/// kOccluded (a part of the top is hidden: no answer; a side is hidden: range without bearing, and no answer from one
/// view alone), kTruncated (the top is beyond the rims), kSaturated, kNotSeen, kNoMatch (seen, but its outline cannot
/// be fitted: thinner than about two pixels at the top, or too little contrast).
///
/// Domain: backgrounds less saturated than HueLabels::kMinSaturation. A background that changes within a pixel of an
/// outline moves the outline by up to a tenth of a pixel (outline_ranging_test.cpp); this is the limit in a real room.
/// Error growth: sigma_range = (range + d)^2 sigma_h / (v (top - lens - d)) for each view.
class OutlineRanging {
 public:
  /// @param wanted indices of the targets to search for; empty: all. The hues of the others are still distinguished
  /// from theirs, and the verdict of the others is kNotSeen.
  /// @param errors of rig and targets, which count in covariances and in all comparisons of the views
  /// @throws std::invalid_argument for sizes that are not > 0 and for targets without hue or bands, or whose radius or
  /// top is not > 0, or whose greatest range is not greater than the radius; std::out_of_range for a wanted index that
  /// is not a target
  OutlineRanging(const Rig& rig, const std::vector<Landmark>& targets, cv::Size lower_size, cv::Size upper_size,
                 const std::vector<std::size_t>& wanted = {}, const BeliefErrors& errors = {});

  /// Runs the finder on both images. @param lower,upper as for measure()
  /// @param motion nothing: the body stands
  /// @param expected a target that has a place is sought in its direction only, so that targets may share a colour.
  /// @throws std::invalid_argument also for places of another number than the targets
  [[nodiscard]] FrameObservation look(const cv::Mat& lower, const cv::Mat& upper,
                                      const std::optional<FrameMotion>& motion = {},
                                      const ExpectedPlaces& expected = {}) const;

  /// Calls look() and measures all landmarks to kFine.
  /// Returns one measurement for each target, in their order, with range, bearing, covariance and sightings where they
  /// exist. Range and bearing are those at the frame's time. The sightings are those of the images: of the times at
  /// which they are exposed (Rig::exposures).
  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper,
                                                      const std::optional<FrameMotion>& motion = {},
                                                      const ExpectedPlaces& expected = {}) const;

 private:
  friend class FrameObservation;
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace twocone::vision
