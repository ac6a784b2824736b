// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "drivers/libcamera_camera/interface.h"

namespace twocone::libcamera_camera {

/// The memory of one buffer, mapped as long as this object exists.
class Memory {
 public:
  /// Maps a buffer. Returns nullptr and sets errno if it cannot be mapped.
  static std::shared_ptr<const Memory> of(const lc::FrameBuffer& buffer);
  Memory() = default;
  ~Memory();
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  [[nodiscard]] const std::vector<std::span<const std::uint8_t>>& planes() const { return planes_; }
  /// All planes as one contiguous span; nothing if they do not follow each other.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> whole() const;

  /// Reading must happen between these calls, because a device may write past the processor's caches.
  void begin_reading() const;
  void end_reading() const;

 private:
  struct Area {
    decltype(lc::FrameBuffer::Plane::fd) file;
    void* memory;
    std::size_t length;
  };
  void sync(std::uint64_t flags) const;

  std::vector<Area> areas_;
  std::vector<std::span<const std::uint8_t>> planes_;
  std::vector<std::size_t> offsets_;
};

}  // namespace twocone::libcamera_camera
