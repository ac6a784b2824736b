// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/image.h"

/// Images in linear light, in which shutter samples add up and lenses blur.
namespace twocone::sim_povray {

/// Linear RGB, interleaved, rows from the top; 1 is full scale. Values may exceed 1 until they are coded again.
struct Light {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> values;
};

/// Returns the linear light of an sRGB code value (IEC 61966-2-1).
[[nodiscard]] float decode_srgb(std::uint8_t code);
/// Returns the sRGB code value that is nearest in code values; light outside 0 to 1 is clipped. Inverts decode_srgb.
[[nodiscard]] std::uint8_t encode_srgb(float light);

/// Returns the mean of images, row by row. @param row_sources for each row, indices of the images to average, at least
/// one
[[nodiscard]] Light mean_light(const std::vector<const Image*>& images,
                               const std::vector<std::vector<int>>& row_sources);
/// Returns a kRgb8 image.
[[nodiscard]] Image to_image(const Light& light);

}  // namespace twocone::sim_povray
