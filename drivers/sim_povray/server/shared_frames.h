// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "base/child_process.h"
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

  SharedFrames(SharedFrames&& other) noexcept;
  SharedFrames& operator=(SharedFrames&&) = delete;
  ~SharedFrames();

  [[nodiscard]] std::uint32_t slots() const { return slots_; }
  [[nodiscard]] std::span<const std::uint8_t> read(std::uint32_t slot) const;
  /// Requires an object that allocate() returned.
  [[nodiscard]] std::span<std::uint8_t> write(std::uint32_t slot);

  /// Returns the descriptor to pass on; the memory stays without it.
  [[nodiscard]] base::UniqueFd take_file() { return std::move(file_); }

 private:
  SharedFrames(base::UniqueFd file, void* memory, std::uint32_t slots, std::uint64_t slot_bytes)
      : file_(std::move(file)), memory_(static_cast<std::uint8_t*>(memory)), slots_(slots), slot_bytes_(slot_bytes) {}

  base::UniqueFd file_;
  std::uint8_t* memory_;
  std::uint32_t slots_;
  std::uint64_t slot_bytes_;
};

}  // namespace twocone::sim_povray::server
