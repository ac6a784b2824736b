// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "apps/doctor/report.h"
#include "hal/image.h"
#include "vision/rim.h"

namespace twocone::doctor {

/// Light in the mirror, or in the whole picture where no circle is given.
struct Exposure {
  double mean_grey = 0;    ///< 0 to 255
  double black_share = 0;  ///< of pixels all of whose channels are at the lower end: no hue is left
  double white_share = 0;  ///< of pixels all of whose channels are at the upper end
};
/// @param rgb CV_8UC3, not empty
Exposure exposure_of(const cv::Mat& rgb, const std::optional<vision::RimCircle>& circle);

/// How blurred the rim's edge is: step of brightness over its steepest slope, pixels, the median of all directions in
/// which the step is clear. An edge as sharp as pixels can show has 1 to 2; a Gaussian blur of sigma gives sqrt(2 pi)
/// sigma. It tells the focus at the rim's distance, which is a little nearer than what the mirror shows. Nothing where
/// the rim stands out in too few directions.
std::optional<double> edge_width_px(const cv::Mat& rgb, const vision::RimCircle& rim);

/// What was measured and what to do, without the part.
Row judge_exposure(const Exposure& exposure);
/// @param found nothing: no rim near the one that is believed; which tells against the robot file if `may_show`
/// (vision::rim_may_show) @param view as in `rig:`
Row judge_mirror(const std::optional<vision::RimCircle>& found, bool may_show, const vision::RimCircle& believed,
                 const std::string& view);
Row judge_focus(const std::optional<double>& width_px);

/// Rows exposure, mirror and focus of a picture; without a believed rim, exposure alone.
/// @param picture kRgb8
void check_picture(const std::string& part, const Image& picture, const std::optional<vision::RimCircle>& believed,
                   Report& report);

}  // namespace twocone::doctor
