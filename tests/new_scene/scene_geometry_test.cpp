// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene_geometry.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fails_with.h"
#include "tests/support/temporary_folder.h"

namespace twocone::sim_povray {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Result<SceneGeometry> geometry_of(const std::string& text) {
  const testing_support::TemporaryFolder folder;
  return SceneGeometry::read(folder.write("s.pov", text), {});
}

/// Positions are sums and products of a few numbers below 100.
constexpr double kRounding = 1e-12;

TEST(SceneGeometry, AMovedCylinderIsFoundWhereItStands) {
  const auto geometry = geometry_of(
      "#declare Post = cylinder { 0, 2*y, 0.3 pigment { rgb <0.1, 0.7, 0.2> } }\n"
      "union { object { Post scale <1.5, 2.3, 1.5> rotate 37*y translate <3, 0.25, -7> } sphere { 0, 1 } }\n"
      "object { Post rotate 180*x }\n");
  ASSERT_TRUE(geometry) << geometry.error().message;
  ASSERT_EQ(geometry->cylinders().size(), 2U);
  const auto& post = geometry->cylinders()[0];
  EXPECT_NEAR(post.base.x, 3, kRounding);
  EXPECT_NEAR(post.base.y, 0.25, kRounding);
  EXPECT_NEAR(post.base.z, -7, kRounding);
  EXPECT_NEAR(post.radius, 0.45, kRounding);
  EXPECT_NEAR(post.height, 4.6, kRounding);
  EXPECT_EQ(post.colour, (Colour{0.1, 0.7, 0.2}));
  EXPECT_EQ(geometry->solids()[post.solid].kind, "cylinder");
  EXPECT_NEAR(geometry->cylinders()[1].base.y, -2, kRounding) << "turned upside down";
}

TEST(SceneGeometry, OnlyWholeUprightRoundCylindersCount) {
  const auto geometry = geometry_of(
      "cylinder { 0, 2*y, 0.3 rotate 1*x }\n"
      "cylinder { 0, 2*y, 0.3 scale <1, 1, 1.01> }\n"
      "cylinder { 0, 2*y, 0.3 open }\n"
      "cylinder { 0, 2*y, 0.3 clipped_by { box { -1, 1 } } }\n"
      "difference { cylinder { 0, 2*y, 0.3 } sphere { 0, 0.1 } }\n"
      "cone { 0, 0.3, 2*y, 0.29 }\n");
  ASSERT_TRUE(geometry) << geometry.error().message;
  EXPECT_THAT(geometry->cylinders(), IsEmpty());
}

TEST(SceneGeometry, ATextureThatIsNotUnderstoodLeavesTheShape) {
  const auto geometry = geometry_of(
      "cylinder { 0, y, 1 pigment { image_map { png \"x.png\" } } }\n"
      "cylinder { 0, y, 1 texture { pigment { rgbt <1, 0, 0, 0.5> } normal { bumps 0.3 } finish { irid { 0.2 } } } }\n"
      "cylinder { 0, y, 1 pigment { rgb x } normal { bumps 0.3 } interior { ior 1.5 } hollow }\n"
      "light_source { <1, 2, 3>, rgb 1 area_light x, z, 3, 3 }\n"
      "sky_sphere { pigment { function { x } } }\n");
  ASSERT_TRUE(geometry) << geometry.error().message;
  ASSERT_EQ(geometry->cylinders().size(), 3U);
  EXPECT_FALSE(geometry->cylinders()[0].colour);
  EXPECT_FALSE(geometry->cylinders()[1].colour);
  EXPECT_EQ(geometry->cylinders()[2].colour, (Colour{1, 0, 0}));
  EXPECT_THAT(geometry->left_out(), IsEmpty());
}

TEST(SceneGeometry, UnknownShapesAreNamedOrTakenAsTheirBounds) {
  const auto geometry = geometry_of(
      "sphere { 0, 1 }\n"
      "quartic { <1, 2> sturm }\n"                                             // 2
      "superellipsoid { <0.2, 0.3> scale 2 translate 5*x }\n"                  // 3
      "blob { threshold 0.6 component 1, 2, <0, 7, 0> sphere { x, 3, 1 } }\n"  // 4
      "mesh { triangle { <1, 2, 3>, <4, 5, 6>, <-7, 8, 9> } }\n"               // 5
      "isosurface { function { x*x } contained_by { sphere { y, 4 } } max_gradient 3 }\n");
  ASSERT_TRUE(geometry) << geometry.error().message;
  ASSERT_EQ(geometry->left_out().size(), 1U);
  EXPECT_THAT(geometry->left_out()[0], HasSubstr("s.pov:2: 'quartic'"));
  EXPECT_THAT(geometry->bounded(), ElementsAre(HasSubstr("s.pov:3: superellipsoid"), HasSubstr("s.pov:4: blob"),
                                               HasSubstr("s.pov:5: mesh"), HasSubstr("s.pov:6: isosurface")));
  ASSERT_EQ(geometry->solids().size(), 6U) << "a blob counts as its parts";
  EXPECT_TRUE(geometry->contains(1, {6.9, 1.9, -1.9}));
  EXPECT_FALSE(geometry->contains(1, {7.1, 0, 0}));
  EXPECT_TRUE(geometry->contains(2, {0, 8.9, 0}));
  EXPECT_TRUE(geometry->contains(4, {-6, 3, 4}));
  EXPECT_TRUE(geometry->contains(5, {0, 4.9, 0}));
}

TEST(SceneGeometry, WhatIsCutOffByAnUnknownShapeStays) {
  const auto geometry = geometry_of("difference { box { -2, 2 } superellipsoid { <1, 1> } quartic { <1> } }");
  ASSERT_TRUE(geometry) << geometry.error().message;
  ASSERT_EQ(geometry->solids().size(), 1U);
  EXPECT_TRUE(geometry->contains(0, {0, 0, 0}));
}

TEST(SceneGeometry, AnUnknownDeclarationCountsWhereItIsUsed) {
  const std::string declared =
      "#declare A = union { sphere { 0, 1 } quartic { <1> } }\n#declare F = function(x) { x }\n";
  const auto unused = geometry_of(declared + "sphere { 0, 2 }");
  ASSERT_TRUE(unused) << unused.error().message;
  EXPECT_THAT(unused->left_out(), IsEmpty());
  const auto used = geometry_of(declared + "object { A translate x }");
  ASSERT_TRUE(used) << used.error().message;
  EXPECT_THAT(used->left_out(), ElementsAre(HasSubstr("s.pov:1: 'quartic'")));
  EXPECT_EQ(used->solids().size(), 1U);
}

TEST(SceneGeometry, GoesOnBehindDirectivesAndMacrosThatFail) {
  const auto geometry = geometry_of(
      "#declare Array[2] = 7;\n"
      "#if (Array[0] > 3) sphere { 0, 1 } #else sphere { 0, 2 } #end\n"
      "#macro Broken() union { sphere { 0, 3 } box { -1, Array[1] } torus { 2, 1 translate Array[0] } } #end\n"
      "Broken()\n"
      "box { -1, 1 }\n");
  ASSERT_TRUE(geometry) << geometry.error().message;
  std::vector<std::string> kinds;
  for (const auto& solid : geometry->solids()) kinds.push_back(solid.kind);
  EXPECT_THAT(kinds, ElementsAre("sphere", "box"));
  EXPECT_EQ(geometry->left_out().size(), 3U) << testing::PrintToString(geometry->left_out());
}

TEST(SceneGeometry, ATextWithoutStructureIsAnError) {
  EXPECT_THAT(geometry_of("sphere { 0, 1"), testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("s.pov:1")));
  EXPECT_THAT(geometry_of("#if (1) sphere { 0, 1 }"),
              testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("s.pov:1")));
  EXPECT_THAT(geometry_of("#while (1) #end"), testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("tokens")));
}

TEST(SceneGeometry, TheScenesOwnRobotIsNoPartOfIt) {
  const std::string robot = "union {\n  //*PMName robot\n  sphere { 0, 1 }\n  sphere { y, 1 }\n}\n";
  const auto geometry = geometry_of("box { -1, 1 }\n" + robot);
  ASSERT_TRUE(geometry) << geometry.error().message;
  EXPECT_EQ(geometry->solids().size(), 1U);
  const testing_support::TemporaryFolder folder;
  const auto without = text_without_robot(folder.write("s.pov", "box { -1, 1 }\n" + robot + "sphere { 0, 1 }"));
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_THAT(*without, HasSubstr("box { -1, 1 }\n"));
  EXPECT_THAT(*without, HasSubstr("sphere { 0, 1 }"));
  EXPECT_EQ(without->find("PMName"), std::string::npos);
  EXPECT_EQ(*text_without_robot(folder.write("t.pov", "box { -1, 1 }")), "");
}

}  // namespace
}  // namespace twocone::sim_povray
