// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/exhibits.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/compare/both_runs.h"
#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/storage/image_file.h"
#include "vision/unwrap.h"

namespace twocone::compare {
namespace {

constexpr int kWidest_px = 320;
const cv::Size kStrip_px{840, 132};

cv::Mat read(const std::filesystem::path& file, const std::string& what, std::vector<std::string>& notes) {
  const auto noted = [&](const std::string& text) {
    notes.push_back(text);
    return cv::Mat();
  };
  if (file.empty()) return noted(fmt::format("There is no {} image.", what));
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return noted(fmt::format("The {} image is missing: {}", what, file.string()));
  }
  const auto image = runlog::read_rgb(file);
  return image ? *image : noted(fmt::format("The {} image cannot be read: {}", what, file.string()));
}

cv::Mat resized(const cv::Mat& image, cv::Size size) {
  if (image.size() == size) return image;
  cv::Mat fitted;
  cv::resize(image, fitted, size, 0, 0, cv::INTER_AREA);
  return fitted;
}

cv::Size shown_size(cv::Size size) {
  if (size.width <= kWidest_px) return size;
  return {kWidest_px, std::max(1, int(std::lround(double(size.height) * kWidest_px / size.width)))};
}

/// Returns the unrolled image. If the rig cannot unroll it, returns nothing and adds a note.
/// @param turned_rad added to the bearings
cv::Mat unrolled(const cv::Mat& image, const config::Robot& robot, double turned_rad, const char* side,
                 ExhibitView& view) {
  if (image.empty()) return {};
  const auto noted = [&](const std::exception& error) {
    view.notes.push_back(fmt::format("The {} {} image is not unrolled: {}", side, view.name(), error.what()));
    return cv::Mat();
  };
  try {
    const vision::Rig rig = config::to_rig(robot);
    vision::MirrorViewSettings settings = of_view(rig, view.view).settings();
    settings.azimuth_rad += std::isfinite(turned_rad) ? turned_rad : 0;
    // The image is unrolled at twice the width first, because near the rim it has more pixels than the strip.
    return resized(vision::unwrap(image, vision::MirrorView(settings), 2 * kStrip_px.width), kStrip_px);
  } catch (const config::FileError& error) {
    return noted(error);
  } catch (const std::invalid_argument& error) {
    return noted(error);
  }
}

void subtract(ExhibitView& images) {
  if (images.simulated_strip.empty() || images.real_strip.empty()) return;
  cv::Mat simulated, real;
  cv::cvtColor(images.simulated_strip, simulated, cv::COLOR_RGB2GRAY);
  cv::cvtColor(images.real_strip, real, cv::COLOR_RGB2GRAY);
  images.difference.create(real.size(), CV_8UC3);
  for (int row = 0; row < real.rows; ++row) {
    for (int column = 0; column < real.cols; ++column) {
      const int grey = real.at<std::uint8_t>(row, column) - simulated.at<std::uint8_t>(row, column);
      images.difference.at<cv::Vec3b>(row, column) = difference_colour(grey);
    }
  }
  images.mean_difference_grey = cv::norm(real, simulated, cv::NORM_L1) / double(real.total());
}

}  // namespace

cv::Vec3b difference_colour(double grey) {
  // A red and a blue similar to Okabe and Ito's, which people with any common kind of colour vision can distinguish.
  const cv::Vec3d none(247, 247, 247);
  const cv::Vec3d end = grey > 0 ? cv::Vec3d(180, 60, 0) : cv::Vec3d(0, 70, 150);
  const double part = std::min(std::abs(grey) / kStrongestDifference_grey, 1.0);
  const cv::Vec3d colour = none + (end - none) * part;
  return {cv::saturate_cast<std::uint8_t>(colour[0]), cv::saturate_cast<std::uint8_t>(colour[1]),
          cv::saturate_cast<std::uint8_t>(colour[2])};
}

std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit) {
  std::array<ExhibitView, 2> views;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const auto k = std::size_t(side);
    ExhibitView& images = views[k];
    images.view = side;
    const cv::Mat simulated = read(exhibit.simulated_images[k], "simulated " + images.name(), images.notes);
    const cv::Mat real = read(exhibit.real_images[k], "real " + images.name(), images.notes);
    // The headings of both bodies differ, so a direction in the world has different bearings from them.
    const double turned_rad =
        std::remainder(exhibit.simulated.heading_rad - exhibit.real.heading_rad, 2 * std::numbers::pi);
    images.simulated_strip = unrolled(simulated, comparison.simulated_robot, turned_rad, "simulated", images);
    images.real_strip = unrolled(real, comparison.real_robot, 0, "real", images);
    subtract(images);
    if (!simulated.empty()) images.simulated = resized(simulated, shown_size(simulated.size()));
    if (real.empty()) continue;
    images.real = resized(real, simulated.empty() ? shown_size(real.size()) : images.simulated.size());
    if (!simulated.empty() && simulated.size() != real.size()) {
      images.notes.push_back(
          fmt::format("The real {} image, {} \u00d7 {} px, is drawn at the size of the simulated one, {} \u00d7 {} "
                      "px, so that both can be blended.",
                      images.name(), real.cols, real.rows, simulated.cols, simulated.rows));
    }
  }
  return views;
}

}  // namespace twocone::compare
