// SPDX-License-Identifier: Apache-2.0
#include "hal/frame.h"

#include <algorithm>

#include <fmt/format.h>

namespace twocone {

Frame::Frame(Header header, Image image) : header_(header) {
  std::promise<ImageResult> ready;
  ready.set_value(std::make_shared<const Image>(std::move(image)));
  pixels_ = ready.get_future().share();
}

ImageResult Frame::image(std::chrono::milliseconds timeout) const {
  // Each call waits on its own copy: two threads must not wait on one shared_future object.
  const auto pixels = pixels_;
  if (pixels.wait_for(std::min(timeout, kLongestWait)) != std::future_status::ready) {
    return Error{ErrorCode::kTimeout,
                 fmt::format("the pixels of frame {} did not come within {} ms", header_.sequence, timeout.count())};
  }
  return pixels.get();
}

}  // namespace twocone
