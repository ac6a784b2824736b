// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <deque>
#include <memory>
#include <vector>

#include "tests/drivers/scripted_kernel.h"

/// Internal types of ScriptedKernel.
namespace twocone::test {

using std::chrono::nanoseconds;

struct ScriptedKernel::File {
  Node* node = nullptr;
  bool is_open = true;
  bool is_dead = false;  ///< the device was unplugged
};

struct ScriptedKernel::Mapping {
  std::shared_ptr<std::vector<std::uint8_t>> memory;
  std::shared_ptr<File> file;  ///< none: detached
  std::size_t length = 0;
};

struct ScriptedKernel::Node {
  struct Buffer {
    std::shared_ptr<std::vector<std::uint8_t>> memory;
    bool is_queued = false;
    Exposure filled{};
    std::uint32_t used = 0;
  };

  ScriptedDevice device;
  v4l2_pix_format format{};
  v4l2_fract period{1, 30};
  std::vector<Buffer> buffers{};
  std::deque<std::uint32_t> to_fill{}, filled{};
  std::shared_ptr<File> owner{};
  bool is_streaming = false;
  bool is_unplugged = false;
  std::uint32_t next_sequence = 0;
  nanoseconds next_exposure{0};
  nanoseconds start{0};
  std::uint64_t exposures = 0;

  [[nodiscard]] std::uint32_t type() const {
    return (device.can & V4L2_CAP_VIDEO_CAPTURE) != 0 ? V4L2_BUF_TYPE_VIDEO_CAPTURE
                                                      : V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
  }
  [[nodiscard]] bool has_planes() const { return type() == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }
  [[nodiscard]] std::uint32_t rows() const {
    return format.pixelformat == V4L2_PIX_FMT_NV12 ? format.height * 3 / 2 : format.height;
  }
  /// The time of the n-th exposure, without the drift of a sum of rounded periods.
  [[nodiscard]] nanoseconds due(std::uint64_t n) const {
    return start + nanoseconds(std::llround(double(n) * 1e9 * period.numerator / period.denominator));
  }
};

}  // namespace twocone::test
