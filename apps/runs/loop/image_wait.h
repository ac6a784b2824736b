// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <utility>

#include "hal/stereo_rig.h"

namespace twocone::runs {

/// Waits for a frame's pixels, at most 150 s, which is longer than a renderer's own limit for one image, so that the
/// renderer's message is the one that is reported. Errors: those of Frame::image; kCancelled once `stop` is set.
ImageResult wait_for_image(const Frame& frame, const std::atomic<bool>& stop);
/// Waits for the pixels of both views, in the same way.
Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const std::atomic<bool>& stop);

/// How often a wait looks whether it must end.
constexpr std::chrono::milliseconds kStopSlice{100};

inline double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace twocone::runs
