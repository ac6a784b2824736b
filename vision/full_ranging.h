// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// Method `full`: each landmark's outline is fitted to what the pixels on it cover, in both views; then both are
/// triangulated. The answer is a function of the two pictures alone: nothing of an earlier frame is kept.
///
/// 1. Each view is looked through for each landmark's hue (full/finder.h): wedges that point at the tip, to a pixel or
///    two.
/// 2. The outline of an upright cylinder, sides and near rim of the top, is projected (full/outline.h) and compared
/// with the
///    pixels that it crosses (full/outline_fit.h). How much of a pixel the landmark covers is read from its colour in
///    linear light, between the landmark's colour just inside and the background's just outside; a pixel tells more the
///    darker it is, and less where its colour is no mixture of the two. Weighted least squares over range, bearing and
///    the edges' width, in rounds; the last with the width and the noise that all landmarks of the picture have in
///    common.
/// 3. The covariance is that of the fit, scaled by how the stations along the outlines really scatter, and widened
/// where
///    the two sides are farther apart, or nearer, than the cylinder has them.
/// 4. triangulate() joins the views: RangeVerdict kOk, kOneView, kInconsistent, kBeyondLimit, kImpossible as there.
///
/// Further verdicts: kSameColour and kTwoCandidates (two things of one hue, or the views disagree on the bearing),
/// kOccluded (a part of the top is hidden: no answer; a side: range without bearing, and nothing from one view alone),
/// kTruncated (the top is beyond the rims), kSaturated, kNotSeen, kNoMatch (seen, but its outline is not to be
/// fitted: thinner than about two pixels at the top, or too little contrast).
///
/// Domain: backgrounds less saturated than HueLabels::kMinSaturation. A background that changes within a pixel of an
/// outline moves it by up to a tenth of a pixel (full_ranging_test.cpp); that is what limits a real room.
/// Error growth: sigma_range = (range + d)^2 sigma_h / (v (top - lens - d)) for each view.
class FullRanging {
 public:
  /// @throws std::invalid_argument for targets without hue or radius
  FullRanging(const Rig& rig, const std::vector<Target>& targets, cv::Size lower_size, cv::Size upper_size);
  ~FullRanging();
  FullRanging(FullRanging&&) noexcept;
  FullRanging& operator=(FullRanging&&) noexcept;

  /// One measurement for each target, in their order, each with range, bearing, covariance and sightings where there
  /// are.
  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::vision
