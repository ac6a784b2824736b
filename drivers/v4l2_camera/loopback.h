// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hal/image.h"
#include "hal/result.h"

namespace twocone::v4l2 {

/// A device of the kernel module v4l2loopback: what is written into it, other programs capture from it as from a
/// camera.
class LoopbackDevice {
 public:
  virtual ~LoopbackDevice() = default;
  /// Writes an image as RGB3: three bytes (red, green, blue) for a pixel. The first image sets the size, which all
  /// others must have. Does not wait for a program that captures. Errors: kBadData (another size, or no pixels),
  /// kRefused (another program writes), kDisconnected.
  virtual Status write(const Image& image) = 0;
};

/// @param device its path: /dev/video10
/// Errors: kNotFound, kRefused (it accepts no images; no permission), kUnavailable (a build without video devices).
Result<std::unique_ptr<LoopbackDevice>> open_loopback(const std::string& device);

}  // namespace twocone::v4l2
