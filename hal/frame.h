// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>

#include "hal/clock.h"
#include "hal/image.h"
#include "hal/result.h"

namespace twocone {

/// The pixels, which many may read, or the reason why there are none.
using ImageResult = Result<std::shared_ptr<const Image>>;

/// One image of one camera. Cheap to copy: copies share the pixels.
///
/// The pixels may arrive after the frame: a simulation renders in the background. On hardware they are already present.
class Frame {
 public:
  struct Header {
    /// Number of the exposure, lost exposures included; may start again from its first value at start().
    std::uint64_t sequence = 0;
    Timestamp captured;                ///< middle of the exposure, as well as the backend knows it
    std::uint64_t lost_before = 0;     ///< exposures lost since the previous frame that was returned
    std::uint64_t skipped_before = 0;  ///< how many of them had arrived, but were skipped for a newer one
  };

  Frame(Header header, std::shared_future<ImageResult> pixels) : header_(header), pixels_(std::move(pixels)) {}
  /// Makes a frame whose pixels are already present.
  Frame(Header header, Image image);

  [[nodiscard]] const Header& header() const { return header_; }

  /// Waits for the pixels at most `timeout` and at most kLongestWait. It may be called again and from several threads.
  /// Errors: kTimeout (not yet arrived), or the backend's error: kUnavailable, kDisconnected, kBadData, kRefused.
  [[nodiscard]] ImageResult image(std::chrono::milliseconds timeout) const;

 private:
  Header header_;
  std::shared_future<ImageResult> pixels_;
};

}  // namespace twocone
