// SPDX-License-Identifier: Apache-2.0
#include "apps/runs/loop/image_wait.h"

namespace twocone::runs {
namespace {

constexpr std::chrono::milliseconds kImageTimeout{150'000};

}  // namespace

ImageResult wait_for_image(const Frame& frame, const std::atomic<bool>& stop) {
  const auto deadline = std::chrono::steady_clock::now() + kImageTimeout;
  while (true) {
    const auto begin = std::chrono::steady_clock::now();
    auto image = frame.image(kStopSlice);
    const auto now = std::chrono::steady_clock::now();
    // A time-out that comes at once is the renderer's, not this wait's.
    const bool is_pending = !image && image.error().code == ErrorCode::kTimeout && now - begin >= kStopSlice / 2;
    if (!is_pending || now >= deadline) return image;
    if (stop) return Error{ErrorCode::kCancelled, "interrupted while its image was awaited"};
  }
}

Result<std::pair<std::shared_ptr<const Image>, std::shared_ptr<const Image>>> wait_for_images(
    const StereoFrame& frame, const std::atomic<bool>& stop) {
  const auto lower = wait_for_image(frame.lower, stop);
  if (!lower) return lower.error();
  const auto upper = wait_for_image(frame.upper, stop);
  if (!upper) return upper.error();
  return std::pair(*lower, *upper);
}

}  // namespace twocone::runs
