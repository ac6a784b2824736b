// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/place.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace twocone::sim_povray {
namespace {

using testing::AllOf;
using testing::HasSubstr;

PlaceSettings place() {
  PlaceSettings place{
      .walls = Bounds{-2, 2, -1.5, 1.5},
      .solids = {{"landmark red", Disc{{1.9, 0.7}, 0.08}}, {"obstacle 1", Outline{{0, 0}, {1, 0}, {0.5, 0.7}}}},
      .moving = {{"cart", {{0, 1}, {1, 1}}, 0.23, true, 0.19}}};
  return place;
}

TEST(Outline, EqualPlacesAgree) { EXPECT_EQ(first_difference(outline_of(place()), outline_of(place())), ""); }

// Catches a part of the map that is not compared: two robots would assume two different worlds.
TEST(Outline, EveryPartThatDiffersIsNamed) {
  const std::string world = outline_of(place());
  PlaceSettings other = place();
  std::get<Disc>(other.solids[0].shape).centre.x_m = 1.902;
  EXPECT_EQ(first_difference(outline_of(other), world),
            "the map has landmark red: at (1.902, 0.700) m, radius 0.080 m; the world has landmark red: at (1.900, "
            "0.700) m, radius 0.080 m");
  other = place();
  std::get<Outline>(other.solids[1].shape)[2].y_m = 0.71;
  EXPECT_THAT(first_difference(outline_of(other), world), HasSubstr("obstacle 1"));
  other = place();
  other.solids.pop_back();
  EXPECT_THAT(first_difference(outline_of(other), world),
              AllOf(HasSubstr("obstacle 1"), HasSubstr("which the map has not")));
  EXPECT_THAT(first_difference(world, outline_of(other)), HasSubstr("which is not in the world"));
  other = place();
  other.walls->max_y_m = 1.6;
  EXPECT_THAT(first_difference(outline_of(other), world), HasSubstr("walls"));
  other = place();
  other.moving[0].loop = false;
  EXPECT_THAT(first_difference(outline_of(other), world), HasSubstr("moving cart"));
}

// Catches a text that the link would cut: the missing part would not be compared.
TEST(Outline, OfAnyLengthFitsIntoAMessageAndIsCompared) {
  PlaceSettings large;
  for (int i = 0; i < 500; ++i) large.solids.push_back({fmt::format("landmark {}", i), Disc{{0.1 * i, 1}, 0.1}});
  const std::string outline = outline_of(large);
  EXPECT_LE(outline.size(), 4096u);
  std::get<Disc>(large.solids.back().shape).centre.y_m = 2;
  EXPECT_THAT(first_difference(outline_of(large), outline), HasSubstr("all else"));
}

}  // namespace
}  // namespace twocone::sim_povray
