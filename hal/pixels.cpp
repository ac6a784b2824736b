// SPDX-License-Identifier: Apache-2.0
#include "hal/pixels.h"

#include <algorithm>
#include <array>

// By default, Debian's compiler makes code for every x86-64 processor, which has no instruction that interleaves three
// channels. With the instructions of the last ten years' processors, these loops take a third to a half of the time.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define TWOCONE_AND_FOR_NEWER_PROCESSORS __attribute__((target_clones("avx2", "default")))
#else
#define TWOCONE_AND_FOR_NEWER_PROCESSORS
#endif

namespace twocone::pixels {
namespace {

using Byte = std::uint8_t;

/// `value` / 256, clamped to 0 ... 255.
[[gnu::always_inline]] inline Byte clipped(int value) { return static_cast<Byte>(std::clamp(value >> 8, 0, 255)); }

/// The luma of pixel i is light[kStep * i]; the chroma of pair i is u[2 * kStep * i] and v[2 * kStep * i]. One loop
/// computes the channels and a second one interleaves them: a compiler vectorises each of these, but no loop that does
/// both.
template <std::size_t kStep>
[[gnu::always_inline]] inline void from_yuv(const Byte* light, const Byte* u, const Byte* v, std::size_t pairs,
                                            Byte* to) {
  constexpr std::size_t kPairs = 128;
  std::array<Byte, 2 * kPairs> red, green, blue;
  while (pairs > 0) {
    const std::size_t count = std::min(pairs, kPairs);
    for (std::size_t i = 0; i < count; ++i) {
      const int from_u = u[2 * kStep * i] - 128;
      const int from_v = v[2 * kStep * i] - 128;
      for (std::size_t k = 0; k < 2; ++k) {
        const int y = 298 * (light[kStep * (2 * i + k)] - 16) + 128;
        red[2 * i + k] = clipped(y + 409 * from_v);
        green[2 * i + k] = clipped(y - 100 * from_u - 208 * from_v);
        blue[2 * i + k] = clipped(y + 516 * from_u);
      }
    }
    for (std::size_t i = 0; i < 2 * count; ++i) {
      to[3 * i] = red[i];
      to[3 * i + 1] = green[i];
      to[3 * i + 2] = blue[i];
    }
    pairs -= count;
    light += 2 * kStep * count;
    u += 2 * kStep * count;
    v += 2 * kStep * count;
    to += 6 * count;
  }
}

}  // namespace

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_bgr8(const Byte* __restrict from, std::size_t pixels, Byte* __restrict to) {
  for (std::size_t i = 0; i < pixels; ++i) {
    to[3 * i] = from[3 * i + 2];
    to[3 * i + 1] = from[3 * i + 1];
    to[3 * i + 2] = from[3 * i];
  }
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_grey8(const Byte* __restrict from, std::size_t pixels, Byte* __restrict to) {
  for (std::size_t i = 0; i < pixels; ++i) to[3 * i] = to[3 * i + 1] = to[3 * i + 2] = from[i];
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_yuyv(const Byte* __restrict from, std::size_t pairs, Byte* __restrict to) {
  from_yuv<2>(from, from + 1, from + 3, pairs, to);
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_uyvy(const Byte* __restrict from, std::size_t pairs, Byte* __restrict to) {
  from_yuv<2>(from + 1, from, from + 2, pairs, to);
}

TWOCONE_AND_FOR_NEWER_PROCESSORS
void from_nv12(const Byte* __restrict light, const Byte* __restrict colours, std::size_t pairs, Byte* __restrict to) {
  from_yuv<1>(light, colours, colours + 1, pairs, to);
}

}  // namespace twocone::pixels
