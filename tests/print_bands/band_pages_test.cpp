// SPDX-License-Identifier: Apache-2.0
#include "apps/print_bands/band_pages.h"

#include <array>
#include <cmath>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "vision/bands/band_code.h"

namespace twocone::print_bands {
namespace {

constexpr double kCell_m = 0.017;

/// Returns what is printed black, from the top down: begin and height in mm.
std::vector<std::array<double, 2>> dark_of(const std::string& page) {
  std::vector<std::array<double, 2>> dark;
  const std::regex rectangle(R"re(<rect x="28" y="([0-9.]+)" width="[0-9.]+" height="([0-9.]+)"/>)re");
  for (std::sregex_iterator it(page.begin(), page.end(), rectangle), end; it != end; ++it) {
    dark.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  }
  return dark;
}

TEST(BandPages, PrintTheDarkBandsAtTrueSize) {
  const auto cells = vision::band_cells(23);
  std::array<bool, vision::kBandCells> printed{};
  for (const auto& [y_mm, height_mm] : dark_of(pages({23}, Paper{}, kCell_m, 0.025))) {
    const double first = (y_mm - kMargin_mm) / 17;
    const double count = height_mm / 17;
    ASSERT_NEAR(first, std::round(first), 1e-4);
    ASSERT_NEAR(count, std::round(count), 1e-4);
    for (int k = 0; k < std::lround(count); ++k) printed.at(std::size_t(std::lround(first) + k)) = true;
  }
  for (std::size_t k = 0; k < vision::kBandCells; ++k) EXPECT_EQ(printed[k], !cells[k]) << "cell " << k;
}

TEST(BandPages, GoRoundThePipeAndAboveEachOther) {
  EXPECT_EQ(sheets_of(Paper{}, kCell_m, 0.025).around, 1);
  EXPECT_EQ(sheets_of(Paper{}, kCell_m, 0.055).around, 3);
  EXPECT_EQ(sheets_of(Paper{}, kCell_m, 0.025).above, 1);
  EXPECT_EQ(sheets_of(Paper{}, 0.03, 0.025).above, 2);
  EXPECT_EQ(sheets_of(Paper{215.9, 279.4}, kCell_m, 0.025).above, 2) << "letter is shorter than A4";
  const std::string all = pages({1, 2}, Paper{}, 0.03, 0.055);
  std::size_t count = 0;
  for (std::size_t at = all.find("<svg"); at != std::string::npos; at = all.find("<svg", at + 1)) ++count;
  EXPECT_EQ(count, 2U * 2U * 3U);
}

TEST(BandPages, RefuseWhatNoPageHolds) {
  EXPECT_THROW(static_cast<void>(sheets_of(Paper{}, 0.3, 0.025)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(sheets_of(Paper{}, 0, 0.025)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(sheets_of(Paper{}, kCell_m, -1)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pages({65}, Paper{}, kCell_m, 0.025)), std::invalid_argument);
}

}  // namespace
}  // namespace twocone::print_bands
