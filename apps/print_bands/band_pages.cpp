// SPDX-License-Identifier: Apache-2.0
#include "apps/print_bands/band_pages.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include <fmt/format.h>

#include "base/errors.h"
#include "vision/bands/band_code.h"

namespace twocone::print_bands {
namespace {

using vision::kBandCells;
using vision::kCellsOverLine;

// Beside the bands: number, arrow and cut marks, which the last sheet covers.
constexpr double kTab_mm = 16;
constexpr double kMark_mm = 10;  // length of the line's mark

double bands_width_mm(const Paper& paper) { return paper.width_mm - 2 * kMargin_mm - kTab_mm; }
int cells_of_page(const Paper& paper, double cell_mm) {
  // A hair more, so that 16 cells of 17 mm fit where 272 mm and a rounding are printed.
  return static_cast<int>((paper.height_mm - 2 * kMargin_mm + 0.01) / cell_mm);
}

/// Writes the cells [first, end) of a number as one page.
void add_page(int number, const Paper& paper, double cell_mm, std::size_t first, std::size_t end, std::string& out) {
  const vision::BandCells cells = vision::band_cells(number);
  const double left_mm = kMargin_mm + kTab_mm;
  const double width_mm = bands_width_mm(paper);
  const auto top_of = [&](std::size_t cell) { return kMargin_mm + double(cell - first) * cell_mm; };
  const auto put = std::back_inserter(out);
  fmt::format_to(put, "<svg width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 0 {0} {1}\">\n", paper.width_mm,
                 paper.height_mm);
  for (std::size_t k = first; k < end; ++k) {
    if (cells[k]) continue;
    const std::size_t upper = k;  // of one band: between two rectangles a printer may leave a white line
    while (k + 1 < end && !cells[k + 1]) ++k;
    fmt::format_to(put, "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"{:g}\"/>\n", left_mm, top_of(upper),
                   width_mm, top_of(k + 1) - top_of(upper));
  }
  // The cut: a thin frame. What is outside goes, but for the tab on the left.
  fmt::format_to(put,
                 "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"{:g}\" fill=\"none\" stroke=\"#888\" "
                 "stroke-width=\"0.15\"/>\n",
                 kMargin_mm, top_of(first), kTab_mm + width_mm, top_of(end) - top_of(first));
  if (first <= kCellsOverLine && kCellsOverLine <= end) {
    const double line_mm = top_of(kCellsOverLine);
    fmt::format_to(put, "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"0.6\" fill=\"#d00\"/>\n",
                   left_mm + width_mm - kMark_mm, line_mm - 0.3, kMark_mm);
    fmt::format_to(put, "<text x=\"{:g}\" y=\"{:g}\" font-size=\"3\" fill=\"#d00\">line_m</text>\n", kMargin_mm + 2,
                   line_mm - 1);
    fmt::format_to(put, "<rect x=\"{:g}\" y=\"{:g}\" width=\"{:g}\" height=\"0.6\" fill=\"#d00\"/>\n", kMargin_mm,
                   line_mm - 0.3, kTab_mm);
  }
  const double middle_mm = kMargin_mm + kTab_mm / 2;
  fmt::format_to(put, "<path d=\"M{0:g} {1:g} l-3 5 h2 v8 h2 v-8 h2 z\"/>\n", middle_mm, top_of(first) + 4);
  fmt::format_to(put, "<text x=\"{0:g}\" y=\"{1:g}\" font-size=\"3\" text-anchor=\"middle\">top</text>\n", middle_mm,
                 top_of(first) + 22);
  fmt::format_to(
      put, "<text x=\"{0:g}\" y=\"{1:g}\" font-size=\"7\" text-anchor=\"middle\" font-weight=\"bold\">{2}</text>\n",
      middle_mm, top_of(first) + 33, number);
  if (first > 0 || end < kBandCells) {
    fmt::format_to(put, "<text x=\"{:g}\" y=\"{:g}\" font-size=\"3\" text-anchor=\"middle\">cells {}-{}</text>\n",
                   middle_mm, top_of(first) + 39, first + 1, end);
  }
  const double foot_mm = paper.height_mm - kMargin_mm / 2;
  fmt::format_to(
      put,
      "<path d=\"M{0:g} {1:g} v3 m0 -1.5 h100 m0 -1.5 v3\" fill=\"none\" stroke=\"#000\" "
      "stroke-width=\"0.2\"/>\n<text x=\"{2:g}\" y=\"{1:g}\" font-size=\"3\" dy=\"2.5\">100 mm. Cut along the "
      "frame; glue over the tab.</text>\n</svg>\n",
      kMargin_mm, foot_mm - 1.5, kMargin_mm + 103);
}

}  // namespace

Sheets sheets_of(const Paper& paper, double cell_m, double radius_m) {
  base::Complaints bad;
  const double greatest_m = (paper.height_mm - 2 * kMargin_mm) / 1000;
  bad.require(cell_m > 0 && cell_m <= greatest_m, "a cell is {} m high, must be > 0 and at most {} m: that of a page",
              cell_m, greatest_m);
  bad.positive("the pipe's radius", radius_m, "m");
  bad.raise("bands");
  const double round_mm = 2000 * std::numbers::pi * radius_m;
  const int of_page = cells_of_page(paper, 1000 * cell_m);
  return {static_cast<int>(std::ceil(round_mm / bands_width_mm(paper))),
          (static_cast<int>(kBandCells) + of_page - 1) / of_page};
}

std::string pages(const std::vector<int>& numbers, const Paper& paper, double cell_m, double radius_m) {
  const Sheets sheets = sheets_of(paper, cell_m, radius_m);
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head><meta charset=\"utf-8\"/><title>twocone: bands</title>\n<style>@page "
      "{{ size: {0}mm {1}mm; margin: 0 }} body {{ margin: 0; font-family: sans-serif }} svg {{ display: block; "
      "break-after: page }}</style></head>\n<body>\n",
      paper.width_mm, paper.height_mm);
  const auto of_page = std::size_t(cells_of_page(paper, 1000 * cell_m));
  for (const int number : numbers) {
    for (std::size_t first = 0; first < kBandCells; first += of_page) {
      for (int i = 0; i < sheets.around; ++i) {
        add_page(number, paper, 1000 * cell_m, first, std::min(first + of_page, kBandCells), out);
      }
    }
  }
  return out + "</body>\n</html>\n";
}

}  // namespace twocone::print_bands
