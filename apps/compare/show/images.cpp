// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/images.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "vision/unwrap.h"

namespace twocone::compare {
namespace {

constexpr int kWidest_px = 640;
const cv::Size kStrip_px{840, 132};

cv::Mat read(const std::filesystem::path& file, const std::string& what, std::vector<std::string>& notes) {
  if (file.empty()) {
    notes.push_back(fmt::format("There is no {} image.", what));
    return {};
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    notes.push_back(fmt::format("The {} image is missing: {}", what, file.string()));
    return {};
  }
  cv::Mat image;
  try {
    image = cv::imread(file.string(), cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    image.release();  // larger than OpenCV can read
  }
  if (image.empty()) notes.push_back(fmt::format("The {} image cannot be read: {}", what, file.string()));
  return image;
}

cv::Mat resized(const cv::Mat& image, cv::Size size) {
  if (image.size() == size) return image;
  cv::Mat fitted;
  cv::resize(image, fitted, size, 0, 0, cv::INTER_AREA);
  return fitted;
}

cv::Size shown_size(cv::Size size) {
  if (size.width <= kWidest_px) return size;
  return {kWidest_px, std::max(1, static_cast<int>(std::lround(double(size.height) * kWidest_px / size.width)))};
}

/// @param turned_rad added to the bearings
cv::Mat strip_of(const cv::Mat& image, const config::Robot& robot, bool lower, double turned_rad) {
  const vision::Rig rig = config::to_rig(robot);
  vision::MirrorViewSettings settings = (lower ? rig.lower : rig.upper).settings();
  settings.azimuth_rad += std::isfinite(turned_rad) ? turned_rad : 0;
  // Unrolled at twice the width first, because a bearing near the rim has more pixels than the strip.
  return resized(vision::unwrap(image, vision::MirrorView(settings), 2 * kStrip_px.width), kStrip_px);
}

void unroll(ExhibitView& images, const Comparison& comparison, const cv::Mat& simulated, const cv::Mat& real,
            double turned_rad) {
  const bool lower = images.view == vision::Side::kLower;
  const auto attempt = [&](const cv::Mat& image, const config::Robot& robot, double turn_rad, const char* side) {
    cv::Mat strip;
    if (image.empty()) return strip;
    const auto note = [&](const std::exception& error) {
      images.notes.push_back(fmt::format("The {} {} image is not unrolled: {}", side, images.name(), error.what()));
    };
    try {
      strip = strip_of(image, robot, lower, turn_rad);
    } catch (const config::FileError& error) {
      note(error);
    } catch (const std::invalid_argument& error) {
      note(error);
    }
    return strip;
  };
  images.simulated_strip = attempt(simulated, comparison.simulated_robot, turned_rad, "simulated");
  images.real_strip = attempt(real, comparison.real_robot, 0, "real");
}

void subtract(ExhibitView& images) {
  if (images.simulated_strip.empty() || images.real_strip.empty()) return;
  cv::Mat simulated;
  cv::Mat real;
  cv::cvtColor(images.simulated_strip, simulated, cv::COLOR_BGR2GRAY);
  cv::cvtColor(images.real_strip, real, cv::COLOR_BGR2GRAY);
  constexpr int kLevels = 256;
  std::array<cv::Vec3b, std::size_t{2} * kLevels> colours;
  for (std::size_t k = 0; k < colours.size(); ++k) colours[k] = difference_colour(int(k) - kLevels);
  images.difference.create(real.size(), CV_8UC3);
  double sum = 0;
  for (int row = 0; row < real.rows; ++row) {
    for (int column = 0; column < real.cols; ++column) {
      const std::ptrdiff_t grey = real.at<std::uint8_t>(row, column) - simulated.at<std::uint8_t>(row, column);
      sum += double(std::abs(grey));
      images.difference.at<cv::Vec3b>(row, column) = colours[std::size_t(grey + kLevels)];
    }
  }
  images.mean_difference_grey = sum / double(real.total());
}

}  // namespace

cv::Vec3b difference_colour(double grey) {
  // A red and a blue similar to Okabe and Ito's, which people with any common kind of colour vision can distinguish.
  const cv::Vec3d none(247, 247, 247);
  const cv::Vec3d end = grey > 0 ? cv::Vec3d(0, 60, 180) : cv::Vec3d(150, 70, 0);
  const double part = std::min(std::abs(grey) / kStrongestDifference_grey, 1.0);
  const cv::Vec3d colour = none + (end - none) * part;
  return {cv::saturate_cast<std::uint8_t>(colour[0]), cv::saturate_cast<std::uint8_t>(colour[1]),
          cv::saturate_cast<std::uint8_t>(colour[2])};
}

std::array<ExhibitView, 2> read_images(const Comparison& comparison, const Exhibit& exhibit) {
  std::array<ExhibitView, 2> views;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const bool lower = side == vision::Side::kLower;
    ExhibitView& images = views[static_cast<std::size_t>(side)];
    images.view = side;
    const cv::Mat simulated =
        read(lower ? exhibit.simulated_lower : exhibit.simulated_upper, "simulated " + images.name(), images.notes);
    const cv::Mat real = read(lower ? exhibit.real_lower : exhibit.real_upper, "real " + images.name(), images.notes);
    // Both bodies head differently, so equal bearings of the world are different bearings of the bodies.
    unroll(images, comparison, simulated, real,
           std::remainder(exhibit.simulated.heading_rad - exhibit.real.heading_rad, 2 * std::numbers::pi));
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
