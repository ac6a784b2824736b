// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vision/hue_labels.h"
#include "vision/srgb.h"

namespace twocone::vision {

/// Tables of pixel colours: which landmark's hue a pixel has, and its linear light.
class ColourTable {
 public:
  /// @throws std::invalid_argument as HueLabels
  explicit ColourTable(const std::vector<Eigen::Vector3d>& colours);

  [[nodiscard]] bool is_ambiguous(std::size_t k) const { return hues_.is_ambiguous(k); }

  /// Returns 0 for no colour, k + 1 for colour k: HueLabels of the colour with its last three bits rounded. It serves
  /// for searching, not for measuring.
  [[nodiscard]] std::uint8_t label(const std::uint8_t* rgb) const {
    return labels_[std::size_t(rgb[0] >> kDropped) << (2 * kBits) | std::size_t(rgb[1] >> kDropped) << kBits |
                   std::size_t(rgb[2] >> kDropped)];
  }
  /// Linear light of an sRGB code, 0 to 1 (IEC 61966-2-1).
  [[nodiscard]] float linear(std::uint8_t code) const { return light_[code]; }
  /// The reciprocal of the variance in linear light that a variance of one in the code causes, at linear light, which
  /// is clamped to 0 to 1.
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
