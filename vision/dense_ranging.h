// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/image_quality.h"
#include "vision/uncertain_rig.h"

namespace twocone::vision {

/// Nearer to a mirror's tip, a pixel spans more than 2.4 degrees of azimuth, and the mirror shows the camera itself:
/// nothing is ranged there.
constexpr double kInnermost_px = 24;

/// The reason why a direction has a range, or has none.
enum class DenseVerdict : std::uint8_t {
  kOk,
  kNotShared,    ///< outside the lower mirror, or the upper mirror does not show what is there at any distance
  kOwnBody,      ///< one of the views shows the robot itself there (DenseSettings::own_body)
  kNoTexture,    ///< the brightness along the radius changes no more than the noise does
  kOccluded,     ///< the upper view shows something else there, as where a nearer thing hides what the lower view shows
  kRepeated,     ///< other ranges match as well, as with the pales of a fence
  kBeyondLimit,  ///< the disparity is less than kMinSigmas of its sigma: farther than the views can measure
};
/// Returns ok, not_shared, own_body, no_texture, occluded, repeated, beyond_limit.
std::string_view to_string(DenseVerdict verdict);

/// Directions as seen from the lower mirror: `azimuths` equal parts of the circle, and slopes (rise over run) in equal
/// steps. A step is that of one pixel along the radius in the middle of the mirror's slopes.
struct PanoramaGrid {
  int azimuths = 0;
  int slopes = 0;
  double first_slope = 0;  ///< of slope index 0, the innermost circle of the image
  double slope_step = 0;   ///< > 0

  /// Returns the bearing of an azimuth's middle in the body's frame, (-pi, pi]; ascending with the index.
  [[nodiscard]] double bearing_rad(int azimuth) const;
  [[nodiscard]] double slope(double index) const { return first_slope + slope_step * index; }

  friend bool operator==(const PanoramaGrid&, const PanoramaGrid&) = default;
};

struct DenseSettings {
  int azimuths = 720;      ///< even, >= 64. Half as many take half the time and see half as sharply across
  int rounds = 3;          ///< of least squares, 1 to 3. One is enough for a scan, and takes a third of their time
  double nearest_m = 0.3;  ///< horizontal distance from the body's origin at which the search ends, > 0
  /// Non-zero (CV_8U, of the image's size) where a view shows the robot itself, which moves with it; empty: nowhere.
  /// lower, upper
  std::array<cv::Mat, 2> own_body{};
};

/// The range to whatever each direction shows. All matrices have a row for each azimuth and a column for each slope.
/// Where the verdict is not kOk, the numbers have no meaning.
struct RangeImage {
  PanoramaGrid grid;
  cv::Mat verdict;       ///< CV_8U, DenseVerdict
  cv::Mat range_m;       ///< CV_32F, horizontal distance from the body's origin
  cv::Mat height_m;      ///< CV_32F, over the floor
  cv::Mat bearing_rad;   ///< CV_32F, body frame; that of the azimuth but for the tilts and offsets of the mirrors
  cv::Mat sigma_m;       ///< CV_32F, standard deviation of range_m, by noise and by the rig's errors
  cv::Mat own_sigma_m;   ///< CV_32F, by the noise of this pair alone: this part differs from frame to frame
  cv::Mat disparity_px;  ///< CV_32F, in slope steps

  [[nodiscard]] DenseVerdict verdict_at(int azimuth, int slope) const {
    return static_cast<DenseVerdict>(verdict.at<std::uint8_t>(azimuth, slope));
  }
};

/// Ranges of everything that has texture, from the images of two cone mirrors one above the other.
///
/// Both images are resampled to azimuth and slope in the body's frame, as the rig's numbers say. There the pixels that
/// may show one point have the same azimuth (the epipolar lines of coaxial cones are radii; no other rectification is
/// required), and a point at horizontal distance rho has the disparity
///
///     lower slope - upper slope = s / (rho + rho_V),      rho_V = d sin(apex) (MirrorView).
///
/// 1. Semi-global matching (Hirschmueller 2008, four paths) at half the resolution. The cost is the difference of
///    brightness, less its local mean and over its local deviation, so gain and offset of either camera have no effect;
///    where the deviation is that of noise, every disparity costs the same. The disparity of the floor falls by about a
///    step from slope to slope: it is also matched with the upper view resampled as its floor has it. The upper view
///    shows a point nearer to its tip, and so less sharply across the radius: the lower view is blurred across by as
///    much.
/// 2. A check from the upper view back to the lower one, and whether the lower view repeats along the radius.
/// 3. Least squares at full resolution in a window around each pixel, for a correction of the window's disparities, a
///    gain, and an offset in each azimuth (Lucas & Kanade 1981). A window is 19 slopes x 3 azimuths: across, the
///    disparities of things change suddenly. It expects the disparities of an upright surface, which are equal, or of a
///    level one, which fall or rise linearly to 0 at the horizon, whichever is closer. Pixels keep their own
///    disparities, and count less the more these differ from what is expected.
/// 4. The two rays of the pixels, by MirrorView, meet in the upright plane of their azimuth.
///
/// A range needs texture along the radius: an upright edge on a plain wall has none.
///
/// Tilts and offsets of the units are exact in 4. In the resampling they are exact at twice the nearest distance;
/// elsewhere the pixels of a point differ in azimuth by what parallax the tilts and offsets cause, at most some tenths
/// of a pixel for 2 degrees.
///
/// Sigma: sigma_D^2 = (noise of both views + what the fit leaves) / sum of squared gradients in the window + last
/// correction^2 + a share of the variance of the window's disparities + a floor. Then
/// sigma_range = (rho + rho_V)^2 step / s sigma_D, which the rig's errors add to. In rooms full of texture, 95 %
/// intervals hold 92 to 98 % (dense_ranging_test.cpp, docs/evidence/dense.md). They hold fewer beside the edges of
/// things and where bars or slats repeat, and there more ranges are wrong.
///
/// Thread-safe: measure() is const and has no state.
class DenseRanging {
 public:
  /// @param size of both images
  /// @throws std::invalid_argument naming every argument outside its domain, also where the mirrors have no slope in
  /// common
  DenseRanging(UncertainRig rig, cv::Size size, DenseSettings settings = {});
  ~DenseRanging();
  DenseRanging(DenseRanging&&) noexcept;
  DenseRanging& operator=(DenseRanging&&) noexcept;

  [[nodiscard]] const PanoramaGrid& grid() const;
  [[nodiscard]] const DenseSettings& settings() const;

  /// @param lower,upper CV_8UC3, r g b, sRGB-coded, of one time
  /// @param noise of both cameras; nothing: it is measured in the images
  /// @throws std::invalid_argument for images of another size or type
  [[nodiscard]] RangeImage measure(const cv::Mat& lower, const cv::Mat& upper,
                                   const std::optional<std::array<NoiseModel, 2>>& noise = {}) const;

  /// Resamples an image of any type to the grid: a row for each azimuth and a column for each slope; 0 where the view
  /// shows nothing. @throws std::invalid_argument for an image of another size
  [[nodiscard]] cv::Mat panorama(Side side, const cv::Mat& image) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace twocone::vision
