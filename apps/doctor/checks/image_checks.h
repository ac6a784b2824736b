// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "apps/doctor/report.h"
#include "hal/image.h"
#include "vision/rim.h"

namespace twocone::doctor {

/// Brightness in the mirror, or in the whole image if no circle is given.
struct Exposure {
  double mean_grey = 0;    ///< 0 to 255
  double black_share = 0;  ///< share of pixels with all channels at the lower end: no hue is left
  double white_share = 0;  ///< share of pixels with all channels at the upper end
};
/// @param rgb CV_8UC3, not empty
Exposure exposure_of(const cv::Mat& rgb, const std::optional<vision::RimCircle>& circle);

/// Returns the blur of the rim's edge in pixels: the step of brightness over its steepest slope, the median over all
/// directions in which the step is clear. The sharpest possible edge has 1 to 2; a Gaussian blur of sigma gives sqrt(2
/// pi) sigma. It measures the focus at the rim's distance, which is a little nearer than the mirror's image. Returns
/// nothing where the rim is visible in too few directions.
std::optional<double> edge_width_px(const cv::Mat& rgb, const vision::RimCircle& rim);

/// Returns the measurement and the advice; the caller sets the part.
Row judge_exposure(const Exposure& exposure);
/// @param found nothing: there is no rim near the believed one; the robot file is then wrong only if `may_show`
/// (vision::rim_may_show)
/// @param view as in `rig:`
Row judge_mirror(const std::optional<vision::RimCircle>& found, bool may_show, const vision::RimCircle& believed,
                 const std::string& view);
Row judge_focus(const std::optional<double>& width_px);

/// Adds the rows exposure, mirror and focus of an image; without a believed rim, only exposure.
/// @param image kRgb8
void check_image(const std::string& part, const Image& image, const std::optional<vision::RimCircle>& believed,
                 Report& report);

}  // namespace twocone::doctor
