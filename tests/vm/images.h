// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/image.h"

namespace twocone::vm {

/// Converts an image to the format YUYV of a camera: ITU-R BT.601, Y 16 to 235; two pixels share the chroma of their
/// mean.
/// @param rgb kRgb8, with an even width
Image to_yuyv(const Image& rgb);

/// A hash that identifies an image: FNV-1a over the pixels of to_rgb8().
/// Errors: those of to_rgb8().
Result<std::uint64_t> fingerprint(const Image& image);

}  // namespace twocone::vm
