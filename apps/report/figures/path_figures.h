// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "apps/report/figures/figure.h"

namespace twocone::report {

/// Figure 7: the true trajectory over the arena from above; without `overhead` (CV_8UC3 b g r, the map's bounds) over
/// its plan, without truth the odometry's.
Figure draw_trajectory(const Drawing& drawing, const std::optional<cv::Mat>& overhead);

/// Figure 17: the position's error against the frame number, with the odometry's beside it. Nothing without truth.
std::optional<Figure> draw_position_error(const Drawing& drawing);

/// Figure 18: the true and the calculated trajectory, and the odometry's.
Figure draw_paths(const Drawing& drawing);

}  // namespace twocone::report
