// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "hal/image.h"

namespace twocone::guest {

/// A picture as a camera of format YUYV delivers it: ITU-R BT.601, Y 16 to 235, one colour for two pixels, that of
/// their mean.
/// @param rgb kRgb8, of an even width
Image to_yuyv(const Image& rgb);

/// By which a picture is known again: FNV-1a over the pixels of to_rgb8().
/// Errors: those of to_rgb8().
Result<std::uint64_t> fingerprint(const Image& image);

}  // namespace twocone::guest
