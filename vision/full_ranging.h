// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "vision/mirror_view.h"
#include "vision/ranging.h"

namespace twocone::vision {

/// How far a landmark has been taken.
enum class Stage {
  /// From the pixels of its colour alone: the top to a third of a pixel, by far the cheapest. Whether something hides a
  /// part of the landmark, and whether it is saturated, is hardly seen so: a hidden top gives a wrong place, which only
  /// other landmarks can contradict. Landmarks only a few pixels wide have an answer too.
  kFound,
  kCoarse,  ///< its outline in every third row and column, fitted roughly
  kFine,    ///< its whole outline: FullRanging::measure()
};
/// found, coarse, fine.
std::string_view to_string(Stage stage);

enum class Views { kBoth, kLower, kUpper };

class FullRanging;

/// One stereo frame, looked at landmark by landmark. Of the FullRanging that made it, and not to outlive it, nor the
/// pictures' pixels, which are not copied. A function of the pictures and of what is asked, in that order: no clock.
class Looking {
 public:
  ~Looking();
  Looking(Looking&&) noexcept;
  Looking& operator=(Looking&&) noexcept;

  /// Where a landmark should stand, body frame, good to half a pixel or so in both views: a fix from what has been
  /// taken so far tells. take() then begins there and saves the coarse fits; where the outline is not there, it begins
  /// with what was found, as without. Beyond a range of its radius: nothing is expected.
  void expect(std::size_t landmark, double range_m, double bearing_rad);

  /// Takes these landmarks as far as that in these views, at least; what the other view shows stays as it is. What fits
  /// of one view have in common (blur, noise, scatter) is that of those taken so far. @throws std::out_of_range for a
  /// landmark that is none of the targets
  void take(std::span<const std::size_t> landmarks, Stage stage, Views views = Views::kBoth);

  /// One for each target, as far as it has been taken; after the look alone, all at kFound.
  [[nodiscard]] std::vector<RangeMeasurement> measurements() const;

  /// Landmarks whose whole outline was fitted in one view or both.
  [[nodiscard]] int refined() const;

 private:
  friend class FullRanging;
  class Impl;
  explicit Looking(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

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
///    kInconsistent is also what the map's height and radius exclude: both views show the whole top, but at another
///    height, however far from the map's; or the only view with an outline shows it wider than it is at that range.
///
/// Further verdicts: kSameColour and kTwoCandidates (two things of one hue, each large enough to be the landmark
/// somewhere within Target::greatest_range_m (full/rivals.h), or the views disagree on the bearing),
/// kOccluded (a part of the top is hidden: no answer; a side: range without bearing, and nothing from one view alone),
/// kTruncated (the top is beyond the rims), kSaturated, kNotSeen, kNoMatch (seen, but its outline is not to be
/// fitted: thinner than about two pixels at the top, or too little contrast).
///
/// Domain: backgrounds less saturated than HueLabels::kMinSaturation. A background that changes within a pixel of an
/// outline moves it by up to a tenth of a pixel (full_ranging_test.cpp); that is what limits a real room.
/// Error growth: sigma_range = (range + d)^2 sigma_h / (v (top - lens - d)) for each view.
class FullRanging {
 public:
  /// @param wanted those of the targets that are looked for; empty: all. The others' hues are still told apart from
  /// theirs, and their verdict is kNotSeen. @throws std::invalid_argument for sizes that are not > 0 and for targets
  /// without hue or radius, or with a greatest range that is not beyond it, std::out_of_range for a wanted one that is
  /// none of them
  FullRanging(const Rig& rig, const std::vector<Target>& targets, cv::Size lower_size, cv::Size upper_size,
              const std::vector<std::size_t>& wanted = {});
  ~FullRanging();
  FullRanging(FullRanging&&) noexcept;
  FullRanging& operator=(FullRanging&&) noexcept;

  /// Runs the finder on both pictures. @param lower,upper as of measure()
  [[nodiscard]] Looking look(const cv::Mat& lower, const cv::Mat& upper) const;

  /// look(), and all landmarks taken to kFine.
  /// One measurement for each target, in their order, each with range, bearing, covariance and sightings where there
  /// are.
  /// @param lower,upper CV_8UC3, r g b, sRGB-coded. @throws std::invalid_argument for another type or size
  [[nodiscard]] std::vector<RangeMeasurement> measure(const cv::Mat& lower, const cv::Mat& upper) const;

 private:
  friend class Looking;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::vision
