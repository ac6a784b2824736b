// SPDX-License-Identifier: Apache-2.0
#include "vision/hue_labels.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/errors.h"

namespace twocone::vision {
namespace {

/// Returns the angle about the grey axis with red at 0 and green at 120 degrees (hexagonal hue, as in HSV). Requires
/// max > min.
double hue_of(double r, double g, double b) {
  const double max = std::max({r, g, b});
  const double chroma = max - std::min({r, g, b});
  double sextant = 0;
  if (max == r) {
    sextant = (g - b) / chroma;
  } else if (max == g) {
    sextant = 2 + (b - r) / chroma;
  } else {
    sextant = 4 + (r - g) / chroma;
  }
  return sextant * std::numbers::pi / 3;
}

double hue_distance(double a_rad, double b_rad) {
  return std::abs(std::remainder(a_rad - b_rad, 2 * std::numbers::pi));
}

}  // namespace

double saturation(const std::array<double, 3>& rgb) {
  const auto [least, greatest] = std::ranges::minmax(rgb);
  return greatest > 0 ? (greatest - least) / greatest : 0;
}

double hue_rad(const std::array<double, 3>& rgb) { return saturation(rgb) > 0 ? hue_of(rgb[0], rgb[1], rgb[2]) : 0; }

std::string_view hue_name(const std::array<double, 3>& colour) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  const double hue = std::fmod(hue_rad(colour) * kDegrees + 360, 360);
  // Upper ends, in linear light: an orange of sRGB has 22 degrees there.
  constexpr std::array<std::pair<double, std::string_view>, 9> kNames{{{12, "red"},
                                                                       {40, "orange"},
                                                                       {75, "yellow"},
                                                                       {165, "green"},
                                                                       {200, "cyan"},
                                                                       {260, "blue"},
                                                                       {285, "violet"},
                                                                       {345, "magenta"},
                                                                       {360.1, "red"}}};
  return std::ranges::find_if(kNames, [hue](const auto& name) { return hue < name.first; })->second;
}

double hue_distance_rad(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return hue_distance(hue_rad(a), hue_rad(b));
}

HueLabels::HueLabels(const std::vector<Eigen::Vector3d>& colours) {
  if (colours.size() > 255) throw base::InvalidArgument("HueLabels: {} colours, at most 255", colours.size());
  for (const Eigen::Vector3d& c : colours) {
    if (!c.allFinite() || c.minCoeff() < 0 || !(c.maxCoeff() > c.minCoeff())) {
      throw base::InvalidArgument(
          "HueLabels: colour [{}, {}, {}] has no hue: needs finite values >= 0 that are not all equal", c.x(), c.y(),
          c.z());
    }
    hues_rad_.push_back(hue_of(c.x(), c.y(), c.z()));
  }
  for (const double hue_rad : hues_rad_) {
    const auto is_close = [hue_rad](double other_rad) { return hue_distance(hue_rad, other_rad) < kHueWindow_rad; };
    ambiguous_.push_back(std::ranges::count_if(hues_rad_, is_close) > 1);  // one is the hue itself
  }
}

std::uint8_t HueLabels::label_of(double hue_rad) const {
  const auto distance = [hue_rad](double other_rad) { return hue_distance(hue_rad, other_rad); };
  const auto best = std::ranges::min_element(hues_rad_, {}, distance);
  if (best == hues_rad_.end() || !(distance(*best) < kHueWindow_rad)) return 0;
  return static_cast<std::uint8_t>(best - hues_rad_.begin() + 1);
}

cv::Mat HueLabels::label(const cv::Mat& rgb) const {
  const std::array<float, 256>& light = light_of_code();
  cv::Mat labels(rgb.size(), CV_8U, cv::Scalar(0));
  for (int row = 0; row < rgb.rows; ++row) {
    const auto* in = rgb.ptr<cv::Vec3b>(row);
    auto* out = labels.ptr<std::uint8_t>(row);
    for (int column = 0; column < rgb.cols; ++column) {
      const float r = light[in[column][0]];
      const float g = light[in[column][1]];
      const float b = light[in[column][2]];
      const float max = std::max({r, g, b});
      const float chroma = max - std::min({r, g, b});
      if (max < kMinBrightness || chroma < kMinSaturation * max) continue;
      out[column] = label_of(hue_of(r, g, b));
    }
  }
  return labels;
}

ColourTable::ColourTable(const std::vector<Eigen::Vector3d>& colours) : hues_(colours) {
  constexpr int kSteps = 1 << kBits;
  cv::Mat cells(kSteps * kSteps, kSteps, CV_8UC3);
  const auto middle = [](int step) { return static_cast<std::uint8_t>((step << kDropped) + (1 << kDropped) / 2); };
  for (int r = 0; r < kSteps; ++r) {
    for (int g = 0; g < kSteps; ++g) {
      for (int b = 0; b < kSteps; ++b) cells.at<cv::Vec3b>(r * kSteps + g, b) = {middle(r), middle(g), middle(b)};
    }
  }
  const cv::Mat labels = hues_.label(cells);
  labels_.assign(labels.datastart, labels.dataend);
  for (int step = 0; step <= kLinearSteps; ++step) {
    const double slope = light_per_grey(linear_to_srgb(double(step) / kLinearSteps));
    weight_of_linear_[std::size_t(step)] = static_cast<float>(1 / (slope * slope));
  }
}

}  // namespace twocone::vision
