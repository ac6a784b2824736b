// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vision/srgb.h"

namespace twocone::vision {

/// Returns (max - min) / max of a colour in linear light, 0 of black.
double saturation(const std::array<double, 3>& rgb);
/// Returns the hexagonal hue of a colour in linear light (as in HSV: red 0, green 120 degrees), in [-pi/3, 5 pi/3).
/// Grey counts as red.
double hue_rad(const std::array<double, 3>& rgb);
/// Returns the name of a hue in English, such as red, of a colour in linear light.
std::string_view hue_name(const std::array<double, 3>& rgb);
/// Returns the angle between the hexagonal hues of two colours in linear light (hue as in HSV), 0 to pi. Grey counts as
/// red.
double hue_distance_rad(const std::array<double, 3>& a, const std::array<double, 3>& b);

/// Labels each pixel with the landmark whose colour it has, if any: the "colour threshold" of method `paper`.
///
/// Pixels are decoded from sRGB to linear light. In linear light, shadow and distance scale r, g and b alike, so hue
/// and saturation do not change. A pixel that a landmark covers in part is a mixture in that proportion. A pixel has a
/// landmark's colour when its saturation (max - min) / max is at least kMinSaturation, its brightness max is at least
/// kMinBrightness, and its hue is within kHueWindow_rad of the landmark's and nearer to it than to any other's.
class HueLabels {
 public:
  /// A pixel has about this saturation where a landmark covers half of it in front of a wall of the same brightness.
  static constexpr double kMinSaturation = 0.5;
  /// Share of full scale. Below it, 8-bit sRGB steps are coarser than a tenth of the value, and hue is noise.
  static constexpr double kMinBrightness = 0.01;
  /// 20 degrees: six landmarks with hues 60 degrees apart keep gaps of 20 degrees between their windows.
  static constexpr double kHueWindow_rad = 20 * std::numbers::pi / 180;

  /// @param colours linear rgb, at most 255. @throws std::invalid_argument for a colour that is grey, negative or
  /// infinite, and for too many colours
  explicit HueLabels(const std::vector<Eigen::Vector3d>& colours);

  /// Returns CV_8U: 0 for no colour, k + 1 for colour k. @param rgb CV_8UC3, r g b, sRGB-coded
  [[nodiscard]] cv::Mat label(const cv::Mat& rgb) const;

  /// Returns whether another colour's hue lies within kHueWindow_rad of colour k's, so that pixels cannot distinguish
  /// the two safely.
  [[nodiscard]] bool is_ambiguous(std::size_t k) const { return ambiguous_.at(k); }
  /// Returns the number of colours.
  [[nodiscard]] std::size_t size() const { return hues_rad_.size(); }

 private:
  [[nodiscard]] std::uint8_t label_of(double hue_rad) const;

  std::vector<double> hues_rad_;
  std::vector<bool> ambiguous_;
};

/// Tables of pixel colours: which landmark's hue a pixel has, and its linear light.
class ColourTable {
 public:
  /// @throws std::invalid_argument as HueLabels
  explicit ColourTable(const std::vector<Eigen::Vector3d>& colours);

  [[nodiscard]] bool is_ambiguous(std::size_t k) const { return hues_.is_ambiguous(k); }
  /// Returns the number of colours.
  [[nodiscard]] std::size_t size() const { return hues_.size(); }

  /// Returns 0 for no colour, k + 1 for colour k: HueLabels of the colour with its last three bits rounded. It serves
  /// for searching, not for measuring.
  [[nodiscard]] std::uint8_t label(const std::uint8_t* rgb) const {
    return labels_[std::size_t(rgb[0] >> kDropped) << (2 * kBits) | std::size_t(rgb[1] >> kDropped) << kBits |
                   std::size_t(rgb[2] >> kDropped)];
  }
  /// Returns the linear light of an sRGB code, 0 to 1 (IEC 61966-2-1).
  [[nodiscard]] float linear(std::uint8_t code) const { return light_[code]; }
  /// Returns the reciprocal of the variance in linear light that a variance of one in the code causes, at the light
  /// `linear`, which is clamped to 0 to 1.
  [[nodiscard]] float weight_of(float linear) const {
    return weight_of_linear_[std::size_t(std::clamp(linear, 0.F, 1.F) * kLinearSteps)];
  }

 private:
  // Size of the tables. Chosen by hand; no test fixes the two values.
  static constexpr int kBits = 5;
  static constexpr int kDropped = 8 - kBits;

  HueLabels hues_;
  std::vector<std::uint8_t> labels_;
  const std::array<float, 256>& light_ = light_of_code();
  static constexpr int kLinearSteps = 4095;
  std::array<float, kLinearSteps + 1> weight_of_linear_{};
};

}  // namespace twocone::vision
