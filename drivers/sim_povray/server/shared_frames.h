// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/unique_fd.h"
#include "hal/result.h"

namespace twocone::sim_povray::server {

/// Memory for images that two programs share: an anonymous file that the kernel frees with its last user, sealed
/// against any change of its size, so that an access cannot fail.
class SharedFrames {
 public:
  /// Makes memory to write into. All of it is allocated when this returns. Errors: kUnavailable: the memory is not
  /// available.
  static Result<SharedFrames> allocate(std::uint32_t slots, std::uint64_t slot_bytes);
  /// Opens memory that allocate() made elsewhere, to read from. Errors: kBadData: not of that size, or not sealed.
  static Result<SharedFrames> adopt(base::UniqueFd file, std::uint32_t slots, std::uint64_t slot_bytes);

  [[nodiscard]] std::uint32_t slots() const { return slots_; }
  [[nodiscard]] std::span<const std::uint8_t> read(std::uint32_t slot) const { return bytes_of(slot); }
  /// Requires an object that allocate() returned.
  [[nodiscard]] std::span<std::uint8_t> write(std::uint32_t slot) { return bytes_of(slot); }

  /// Returns the descriptor to pass on; the memory stays without it.
  [[nodiscard]] base::UniqueFd take_file() { return std::move(file_); }

 private:
  struct Unmap {
    std::size_t bytes;
    void operator()(std::uint8_t* memory) const;
  };

  SharedFrames(base::UniqueFd file, void* memory, std::uint32_t slots, std::uint64_t slot_bytes)
      : file_(std::move(file)),
        memory_(static_cast<std::uint8_t*>(memory), {slots * slot_bytes}),
        slots_(slots),
        slot_bytes_(slot_bytes) {}
  [[nodiscard]] std::span<std::uint8_t> bytes_of(std::uint32_t slot) const;

  base::UniqueFd file_;
  std::unique_ptr<std::uint8_t, Unmap> memory_;
  std::uint32_t slots_;
  std::uint64_t slot_bytes_;
};

}  // namespace twocone::sim_povray::server
