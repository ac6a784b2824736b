// SPDX-License-Identifier: Apache-2.0
#include "vision/bands/band_code.h"

#include <algorithm>
#include <bit>

#include "base/errors.h"

namespace twocone::vision {
namespace {

constexpr int kWordCells = 12;
constexpr unsigned kWords = 1U << kWordCells;
constexpr int kLeastDistance = 4;
constexpr int kLeastDistanceOnHead = 2;
constexpr int kHighestBand = 4;
constexpr int kMostEdges = 12;

/// Returns whether a cell of a word is light, cell 0 the uppermost.
bool is_light(unsigned word, int cell) { return (word >> unsigned(kWordCells - 1 - cell) & 1U) != 0; }

BandCells cells_of(unsigned word) {
  BandCells cells{};
  cells[1] = cells[kBandCells - 2] = true;
  for (int i = 0; i < kWordCells; ++i) cells[std::size_t(i) + 2] = is_light(word, i);
  return cells;
}

unsigned on_head(unsigned word) {
  unsigned turned = 0;
  for (int i = 0; i < kWordCells; ++i) turned |= unsigned(is_light(word, i)) << unsigned(i);
  return turned;
}

/// Returns the number of edges between bands; nothing where a band is too high or the code too much like a regular
/// pattern.
std::optional<int> edges_of(unsigned word) {
  const BandCells cells = cells_of(word);
  int edges = 0;
  int height = 1;
  for (std::size_t i = 1; i < kBandCells; ++i) {
    const bool is_edge = cells[i] != cells[i - 1];
    edges += is_edge ? 1 : 0;
    height = is_edge ? 1 : height + 1;
    if (height > kHighestBand) return std::nullopt;
  }
  return edges <= kMostEdges ? std::optional(edges) : std::nullopt;
}

int distance(unsigned a, unsigned b) { return std::popcount(a ^ b); }

using Words = std::array<unsigned, kBandNumbers>;

/// Returns the first words that keep the distances from those before them: those of most edges first, because edges
/// give the range, and of these in ascending order. There are 67 of them.
Words first_words() {
  Words words{};
  std::size_t found = 0;
  for (int edges = kMostEdges; edges > 0; --edges) {
    for (unsigned word = 0; word < kWords && found < words.size(); ++word) {
      bool is_apart = edges_of(word) == edges && distance(word, on_head(word)) >= kLeastDistanceOnHead;
      for (std::size_t k = 0; k < found && is_apart; ++k) {
        is_apart =
            distance(word, words[k]) >= kLeastDistance && distance(word, on_head(words[k])) >= kLeastDistanceOnHead;
      }
      if (is_apart) words[found++] = word;
    }
  }
  return words;
}

const Words& all_words() {
  static const Words words = first_words();
  return words;
}

}  // namespace

BandCells band_cells(int number) {
  if (number < 1 || number > kBandNumbers) {
    throw base::InvalidArgument("bands: number {}, must be 1 to {}", number, kBandNumbers);
  }
  return cells_of(all_words()[std::size_t(number) - 1]);
}

std::optional<int> band_number(const BandCells& cells) {
  unsigned word = 0;
  for (std::size_t i = 2; i < kBandCells - 2; ++i) word = word << 1U | unsigned(cells[i]);
  if (cells != cells_of(word)) return std::nullopt;
  const Words& words = all_words();
  const auto at = std::ranges::find(words, word);
  return at != words.end() ? std::optional(static_cast<int>(at - words.begin()) + 1) : std::nullopt;
}

}  // namespace twocone::vision
