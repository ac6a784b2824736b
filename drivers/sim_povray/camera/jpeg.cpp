// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/camera/jpeg.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <stdexcept>

namespace twocone::sim_povray {

Image through_jpeg(const Image& image, int quality) {
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  if (!encoder) throw std::runtime_error("no memory for a JPEG encoder");
  unsigned char* bytes = nullptr;  // libturbojpeg allocates them
  unsigned long size = 0;          // NOLINT(google-runtime-int): its type
  const int status = tjCompress2(encoder.get(), image.bytes.data(), image.width_px, 0, image.height_px, TJPF_RGB,
                                 &bytes, &size, TJSAMP_422, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (status != 0) throw std::runtime_error(tjGetErrorStr2(encoder.get()));
  auto received = to_rgb8({image.width_px, image.height_px, PixelFormat::kMjpeg, {bytes, bytes + size}});
  if (!received) throw std::runtime_error(received.error().message);
  const std::uint8_t* const from = image.bytes.data();
  std::uint8_t* const to = received->bytes.data();
  for (std::size_t i = 0; i < image.bytes.size(); i += 3) {
    if (from[i] == 0 && from[i + 1] == 0 && from[i + 2] == 0) std::fill_n(to + i, 3, std::uint8_t{0});
  }
  return *std::move(received);
}

}  // namespace twocone::sim_povray
