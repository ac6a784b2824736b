// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// The innermost loops of dense ranging, compiled for each instruction set of the processor's family. The fastest that
/// the processor has is chosen when the program runs.
namespace twocone::vision {

/// Writes min(|value - others[i]|, most), or floors[i] where that is more.
void difference_costs(std::uint8_t value, const std::uint8_t* others, const std::uint8_t* floors, std::size_t count,
                      std::uint8_t most, std::uint8_t* costs);
/// Writes a + b + c. @param count of all; sums are at most 255
void add_three(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, std::size_t count,
               std::uint8_t* sums);
/// Writes (a + b + c) / 4.
void quarter_of_three(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, std::size_t count,
                      std::uint8_t* quarters);
/// Writes a + b + c + d.
void add_four(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, const std::uint8_t* d,
              std::size_t count, std::uint16_t* sums);

/// The penalties of semi-global matching, for a change of the disparity by one and by more.
struct Penalties {
  std::uint8_t one, more;
};
/// Steps along a path: L(d) = C(d) + min(L'(d), L'(d +- 1) + one, min L' + more) - min L'.
/// @param costs,previous,path of `disparities` >= 2 each; all sums are below 256
void path_step(const std::uint8_t* costs, const std::uint8_t* previous, std::size_t disparities,
               const Penalties& penalties, std::uint8_t* path);

/// Of a row of pixels: upper brightness u, its gradient g, lower minus upper brightness r, disparity and weight. The
/// windows of the first and the last pixels, and a vector of the processor, may be read beyond both ends: kMargin
/// further pixels before and after, of weight 0.
struct MatchedRow {
  static constexpr std::size_t kMargin = 64;
  const float *u, *g, *r, *disparity, *weight;
};
/// The disparity that a window expects of its pixels falls or rises from that of its middle along the row: by nothing,
/// as on an upright wall, or as on a level surface, whichever is closer to the disparities of the middle's row.
struct ExpectedSlants {
  /// The step of a level surface's disparity for each px of disparity, by pixel. Level surfaces of all heights have
  /// disparities that fall or rise linearly along the row, to 0 at the horizon. With the margin of a row behind it.
  const float* level;
  float most_px;   ///< greatest such step
  float other_px;  ///< disparities that differ by more from what is expected are of something else
};
/// Weighted sums over the windows of a row's pixels: of weight, of disparity less what is expected of it, d, and dd;
/// and of the products of u, g and r less their means in each row of the window. An edge along the radius, which says
/// nothing of a disparity, changes only those means.
struct WindowSums {
  enum Sum : std::size_t { kN, kD, kDd, kUu, kUg, kGg, kUr, kGr, kRr, kSums };
  std::array<std::vector<float>, kSums> of;
  explicit WindowSums(std::size_t width) {
    for (auto& sum : of) sum.assign(width + MatchedRow::kMargin, 0);
  }
};
/// Sums over the windows of a row's pixels: those of `rows`, from `reach` before to `reach` after each. A pixel counts
/// less the more its disparity differs from what is expected of it, and not at all from `same_px` on.
/// @param here disparities of the row, with its margins
void sum_windows(std::span<const MatchedRow> rows, const float* here, const ExpectedSlants& slants, std::size_t width,
                 std::size_t reach, float same_px, WindowSums& sums);

}  // namespace twocone::vision
