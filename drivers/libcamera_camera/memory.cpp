// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera_camera/memory.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

namespace twocone::libcamera_camera {

std::shared_ptr<const Memory> Memory::of(const lc::FrameBuffer& buffer) {
  auto mapped = std::make_shared<Memory>();
  for (const auto& plane : buffer.planes()) {
    const std::size_t length = std::size_t(plane.offset) + plane.length;
    void* memory = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
    if (memory == MAP_FAILED) return nullptr;
    mapped->areas_.push_back({plane.fd, memory, length});
    mapped->planes_.push_back({static_cast<const std::uint8_t*>(memory) + plane.offset, plane.length});
    mapped->offsets_.push_back(plane.offset);
  }
  return mapped;
}

Memory::~Memory() {
  for (const Area& area : areas_) ::munmap(area.memory, area.length);
}

std::optional<std::span<const std::uint8_t>> Memory::whole() const {
  if (areas_.empty()) return std::nullopt;
  for (std::size_t i = 1; i < areas_.size(); ++i) {
    const bool follows =
        areas_[i].file.get() == areas_[i - 1].file.get() && offsets_[i] == offsets_[i - 1] + planes_[i - 1].size();
    if (!follows) return std::nullopt;
  }
  // Every mapping, also the last plane's, begins at the start of the file.
  const auto* const file = static_cast<const std::uint8_t*>(areas_.back().memory);
  return std::span(file + offsets_.front(), areas_.back().length - offsets_.front());
}

void Memory::begin_reading() const { sync(DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ); }
void Memory::end_reading() const { sync(DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ); }

void Memory::sync(std::uint64_t flags) const {
  for (std::size_t i = 0; i < areas_.size(); ++i) {
    if (i > 0 && areas_[i].file.get() == areas_[i - 1].file.get()) continue;
    dma_buf_sync sync{flags};
    // Memory of another kind refuses this call, but needs no synchronisation either.
    ::ioctl(areas_[i].file.get(), DMA_BUF_IOCTL_SYNC, &sync);
  }
}

}  // namespace twocone::libcamera_camera
