// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hal/image.h"

namespace twocone::sim_povray {

/// Compresses an image as a camera does before it sends it, and decompresses it: JPEG with a colour value for each two
/// pixels of a row (4:2:2), as USB cameras make it. Pixels without any light stay black, as with read noise: they were
/// not rendered, and programs see by their black that nothing was recorded there.
/// @param image kRgb8 @param quality of libjpeg, 1 to 100
/// @throws std::runtime_error if libturbojpeg refuses (no memory)
[[nodiscard]] Image through_jpeg(const Image& image, int quality);

}  // namespace twocone::sim_povray
