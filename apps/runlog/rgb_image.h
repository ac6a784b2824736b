// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include <opencv2/core.hpp>

#include "hal/result.h"

namespace twocone::runlog {

/// Reads a stored image in the form that vision takes, CV_8UC3 r g b. The cv::Mat owns its pixels. Errors: kNotFound,
/// kBadData.
Result<cv::Mat> read_rgb(const std::filesystem::path& file);

}  // namespace twocone::runlog
