// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

/// The code of banded landmarks: horizontal bands round a cylinder, light and dark, that carry a number.
///
/// From the top down there are kBandCells cells of equal height. The first two are dark and light, the last two light
/// and dark: their two edges are a known distance apart, wherever the code is. The twelve cells between them hold one
/// of kBandNumbers words. Two words differ in four cells or more, so that up to three cells that are read wrongly give
/// no number instead of a wrong one; a word that stands on its head differs from all in two or more. No band is higher
/// than four cells, and none of the codes alternates from end to end, as a blind does.
namespace twocone::vision {

constexpr std::size_t kBandCells = 16;
/// The print marks the line below this number of cells; its height over the floor is Landmark::top_m. It is nearer to
/// the top because the upper view shows the lower cells small or not at all.
constexpr std::size_t kCellsOverLine = 6;
constexpr int kBandNumbers = 64;

/// From the top down; true: light.
using BandCells = std::array<bool, kBandCells>;

/// @throws std::invalid_argument for a number that is not 1 to kBandNumbers
BandCells band_cells(int number);
/// Returns the number of these cells; nothing where they are no code.
std::optional<int> band_number(const BandCells& cells);

}  // namespace twocone::vision
