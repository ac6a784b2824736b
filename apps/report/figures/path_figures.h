// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "apps/report/figures/drawing.h"

namespace twocone::report {

/// Draws figure 7: the true trajectory (without ground truth: the one by odometry) over the arena from above, or over
/// its plan if there is no `overhead` (CV_8UC3 b g r, covering the map's bounds).
Figure draw_trajectory(const Drawing& drawing, const std::optional<cv::Mat>& overhead);

/// Draws figure 17: the position error and the error of odometry against the frame number. Returns nothing without
/// truth.
std::optional<Figure> draw_position_error(const Drawing& drawing);

/// Draws figure 18: the true and the calculated trajectory, and the one by odometry.
Figure draw_paths(const Drawing& drawing);

}  // namespace twocone::report
