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

/// What arrives at the promise's end: pixels that many may read, or why there are none.
using ImageResult = Result<std::shared_ptr<const Image>>;

/// One picture of one camera. Cheap to copy: copies share the pixels.
///
/// The pixels may still be on their way (a simulation renders in the background; on hardware they are already there).
class Frame {
 public:
  struct Header {
    std::uint64_t sequence =
        0;               ///< counts the camera's exposures, also those that were lost; may begin anew at a start
    Timestamp captured;  ///< middle of the exposure, as well as the backend knows it
    std::uint64_t lost_before = 0;     ///< exposures lost since the frame handed out before this one
    std::uint64_t skipped_before = 0;  ///< those of them that had come, and were passed over for a newer one
  };

  Frame(Header header, std::shared_future<ImageResult> pixels) : header_(header), pixels_(std::move(pixels)) {}
  /// A frame whose pixels are there.
  Frame(Header header, Image image);

  [[nodiscard]] const Header& header() const { return header_; }

  /// Waits at most `timeout` (and kLongestWait) for the pixels; may be called again and from several threads.
  /// Errors: kTimeout (still on their way), or what the backend met: kUnavailable, kDisconnected, kBadData, kRefused.
  [[nodiscard]] ImageResult image(std::chrono::milliseconds timeout) const;

 private:
  Header header_;
  std::shared_future<ImageResult> pixels_;
};

}  // namespace twocone
