// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/jpeg.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

namespace twocone::sim_povray {

Image through_jpeg(const Image& image, int quality) {
  const auto sent = to_mjpeg(image, quality);
  auto received = sent ? to_rgb8(*sent) : sent;
  if (!received) throw std::runtime_error(received.error().message);
  const std::uint8_t* const from = image.bytes.data();
  std::uint8_t* const to = received->bytes.data();
  for (std::size_t i = 0; i < image.bytes.size(); i += 3) {
    if (from[i] == 0 && from[i + 1] == 0 && from[i + 2] == 0) std::fill_n(to + i, 3, std::uint8_t{0});
  }
  return *std::move(received);
}

}  // namespace twocone::sim_povray
