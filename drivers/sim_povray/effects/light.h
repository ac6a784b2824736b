// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/image.h"

/// Pictures in linear light, where exposures add up and lenses blur.
namespace twocone::sim_povray {

/// Linear rgb, interleaved, rows from the top; 1 is what full scale codes for. May go beyond until it is coded again.
struct Light {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> values;
};

/// Linear light of an sRGB code value (IEC 61966-2-1).
[[nodiscard]] float decode_srgb(std::uint8_t code);
/// The nearest sRGB code value, the nearest as code values go; what is outside 0 to 1 is clipped. Gives back what
/// decode_srgb was given.
[[nodiscard]] std::uint8_t encode_srgb(float light);

/// @param row_sources for each row, indices of the pictures that it is the mean of, at least one
[[nodiscard]] Light mean_light(const std::vector<const Image*>& pictures,
                               const std::vector<std::vector<int>>& row_sources);
/// kRgb8.
[[nodiscard]] Image to_image(const Light& light);

}  // namespace twocone::sim_povray
