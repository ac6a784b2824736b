// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/rgb_image.h"

#include <fmt/format.h>

#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/run_folder.h"

namespace twocone::runlog {

Result<cv::Mat> read_rgb(const std::filesystem::path& file) {
  const auto image = read_image(file);
  if (!image) return image.error();
  const auto rgb = to_rgb8(*image);
  if (!rgb) return Error{rgb.error().code, fmt::format("{}: {}", file.string(), rgb.error().message)};
  return estimation::as_mat(*rgb).clone();
}

}  // namespace twocone::runlog
