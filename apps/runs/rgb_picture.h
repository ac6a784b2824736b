// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <opencv2/core.hpp>

#include "hal/result.h"

namespace twocone::runs {

/// A stored picture as vision sees it, CV_8UC3 r g b; the cv::Mat owns its pixels. Errors: kNotFound, kBadData.
Result<cv::Mat> read_rgb(const std::filesystem::path& file);

}  // namespace twocone::runs
