// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene_geometry.h"

#include <algorithm>
#include <cmath>
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

/// A scene that is evaluated leniently.
struct Lenient {
  explicit Lenient(const std::string& text)
      : geometry(SceneGeometry::read({.scene = folder.write("s.pov", text), .unit_m = 0.5}, &leniency)) {}
  const SceneGeometry* operator->() const { return &*geometry; }
  explicit operator bool() const { return bool(geometry); }

  testing_support::TemporaryFolder folder;
  Leniency leniency;
  Result<SceneGeometry> geometry;
};

/// Positions are sums and products of a few numbers below 100.
constexpr double kRounding = 1e-12;

TEST(SceneGeometry, AMovedCylinderIsFoundWhereItStands) {
  const Lenient scene(
      "#declare Post = cylinder { 0, 2*y, 0.3 pigment { rgb <0.1, 0.7, 0.2> } }\n"
      "union { object { Post scale <1.5, 2.3, 1.5> rotate 37*y translate <3, 0.25, -7> } sphere { 0, 1 } }\n"
      "object { Post rotate 180*x }\n"
      "union { cylinder { 0, <2, 0, 0>, 1 rotate z*90 scale 2 translate <3, 1, 20> } pigment { rgb <0, 0, 1> } }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  const auto cylinders = scene->upright_cylinders();
  ASSERT_EQ(cylinders.size(), 3U);
  EXPECT_NEAR(cylinders[0].x_m, 1.5, kRounding);
  EXPECT_NEAR(cylinders[0].y_m, -3.5, kRounding);
  EXPECT_NEAR(cylinders[0].bottom_m, 0.125, kRounding);
  EXPECT_NEAR(cylinders[0].radius_m, 0.225, kRounding);
  EXPECT_NEAR(cylinders[0].top_m, 2.425, kRounding);
  EXPECT_THAT(cylinders[0].colour.value(), ElementsAre(0.1, 0.7, 0.2));
  EXPECT_THAT(scene->objects()[std::size_t(cylinders[0].object)].describe(), HasSubstr("cylinder of "));
  EXPECT_EQ(scene->objects()[std::size_t(cylinders[0].object)].line, 2);
  EXPECT_NEAR(cylinders[1].bottom_m, -1, kRounding) << "turned upside down";
  EXPECT_NEAR(cylinders[2].top_m, 2.5, kRounding) << "laid and put up again";
  EXPECT_NEAR(cylinders[2].radius_m, 1, kRounding);
  EXPECT_THAT(cylinders[2].colour.value(), ElementsAre(0, 0, 1));
}

TEST(SceneGeometry, OnlyWholeUprightRoundCylindersCount) {
  const Lenient scene(
      "cylinder { 0, 2*y, 0.3 rotate 1*x }\n"
      "cylinder { 0, 2*y, 0.3 scale <1, 1, 1.01> }\n"
      "cylinder { 0, 2*y, 0.3 open }\n"
      "cylinder { 0, 2*y, 0.3 no_reflection }\n"
      "cylinder { 0, 2*y, 0.3 clipped_by { box { -1, 1 } } }\n"
      "difference { cylinder { 0, 2*y, 0.3 } sphere { 0, 0.1 } }\n"
      "cone { 0, 0.3, 2*y, 0.29 }\n"
      "lathe { linear_spline 4, <0, 0>, <0.3, 0>, <0.1, 0.5>, <0, 0.5> }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  EXPECT_THAT(scene->upright_cylinders(), IsEmpty());
}

TEST(SceneGeometry, AnotherFrameMovesEverything) {
  const Lenient scene(
      "camera { location <0, 3, -8> look_at <0, 3, 0> }\n"
      "box { <-1, 2, 5>, <1, 4, 7> }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  const SceneGeometry moved = scene->in_frame(0.1, 2);
  const auto box = moved.bounds(0).value();
  constexpr double kSlack_m = 1e-8;  // a box around an object is larger by 1e-9 of its place
  EXPECT_NEAR(box.low.x, -0.1, kSlack_m);
  EXPECT_NEAR(box.low.y, 0.5, kSlack_m);
  EXPECT_NEAR(box.high.z, 0.2, kSlack_m);
  EXPECT_NEAR(moved.camera().value().location.y, -0.8, kRounding);
  EXPECT_NEAR(moved.camera().value().location.z, 0.1, kRounding);
  const auto met = moved.cast({0.05, -0.8, 0.1}, {0, 1, 0}).value();
  EXPECT_NEAR(met.distance_m, 1.3, kRounding);
  EXPECT_NEAR(met.point.y, 0.5, kRounding);
  EXPECT_NEAR(std::abs(met.normal.y), 1, kRounding);
  EXPECT_TRUE(moved.contains(0, {0, 0.6, 0.1}));
  EXPECT_FALSE(moved.contains(0, {0, 0.6, 0.3}));
}

TEST(SceneGeometry, CellsHoldWhatStandsInThemBetweenTwoHeights) {
  const FloorGrid grid{{-1, -1}, 0.1, 20, 20};
  const Vec3 air{0.05, 0.05, 0.5};
  const Lenient scene(
      "box { <0.62, 0, 0.22>, <1.18, 1, 0.58> }\n"               // 0.31 to 0.59 m, 0.11 to 0.29 m
      "box { <-2.5, -1, -2.5>, <2.5, 4, 2.5> }\n"                // around all
      "box { <-1.7, 0, -0.01>, <-0.3, 4, 0.01> rotate 30*y }\n"  // a thin wall
      "cylinder { <-1.3, 0, 1.7>, <-1.3, 4, 1.7>, 0.003 }\n"     // a stick
      "box { <-1, 1.7, 0.5>, <1, 1.8, 1> }\n"                    // too high
      "plane { y, 0 }\n"
      "cylinder { 0, 0.04*y, 0.5 }\n");  // a plate that ends at the lower height
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  const auto count = [&](int object) {
    const auto cells = scene->cells_of(object, grid, 0.02, 0.8, air);
    return std::ranges::count(cells, 255);
  };
  EXPECT_EQ(count(0), 3 * 2);
  EXPECT_EQ(count(1), 0) << "its walls are beyond the grid, and its inside is air";
  EXPECT_GE(count(2), 7) << "0.7 m long";
  EXPECT_GE(count(3), 1);
  EXPECT_EQ(count(4), 0);
  EXPECT_EQ(count(5), 0);
  EXPECT_EQ(count(6), 0);
  const auto cells = scene->cells_of(0, grid, 0.02, 0.8, air);
  EXPECT_EQ(cells[11 * 20 + 13], 255) << "x 0.3 to 0.4 m, y 0.1 to 0.2 m";
  EXPECT_EQ(cells[10 * 20 + 13], 0);
}

TEST(SceneGeometry, ATextureThatIsNotUnderstoodLeavesTheShape) {
  const Lenient scene(
      "cylinder { 0, y, 1 pigment { image_map { png \"x.png\" } } }\n"
      "cylinder { 0, y, 1 texture { pigment { rgbt <1, 0, 0, 0.5> } normal { bumps 0.3 } finish { irid { 0.2 } } } }\n"
      "cylinder { 0, y, 1 pigment { rgb x } normal { bumps 0.3 } interior { ior 1.5 } hollow }\n"
      "light_source { <1, 2, 3>, rgb 1 area_light x, z, 3, 3 }\n"
      "sky_sphere { pigment { function { x } } }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  const auto cylinders = scene->upright_cylinders();
  ASSERT_EQ(cylinders.size(), 3U);
  EXPECT_FALSE(cylinders[0].colour);
  EXPECT_FALSE(cylinders[1].colour);
  EXPECT_THAT(cylinders[2].colour.value(), ElementsAre(1, 0, 0));
  EXPECT_THAT(scene.leniency.left_out, IsEmpty());
}

TEST(SceneGeometry, UnknownShapesAreNamedOrTakenAsTheirBounds) {
  const Lenient scene(
      "sphere { 0, 1 }\n"
      "quartic { <1, 2> sturm }\n"                                             // 2
      "superellipsoid { <0.2, 0.3> scale 2 translate 5*x }\n"                  // 3
      "blob { threshold 0.6 component 1, 2, <0, 7, 0> sphere { x, 3, 1 } }\n"  // 4
      "mesh { triangle { <1, 2, 3>, <4, 5, 6>, <-7, 8, 9> } }\n"               // 5
      "isosurface { function { x*x } contained_by { sphere { y, 4 } } max_gradient 3 }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  ASSERT_EQ(scene.leniency.left_out.size(), 1U);
  EXPECT_THAT(scene.leniency.left_out[0], HasSubstr("s.pov:2: 'quartic'"));
  EXPECT_THAT(scene.leniency.bounded, ElementsAre(HasSubstr("s.pov:3: superellipsoid"), HasSubstr("s.pov:4: blob"),
                                                  HasSubstr("s.pov:5: mesh"), HasSubstr("s.pov:6: isosurface")));
  ASSERT_EQ(scene->objects().size(), 6U) << "a blob counts as its parts";
  EXPECT_TRUE(scene->contains(1, {3.45, -0.95, 0.95}));
  EXPECT_FALSE(scene->contains(1, {3.55, 0, 0}));
  EXPECT_TRUE(scene->contains(2, {0, 0, 4.45}));
  EXPECT_TRUE(scene->contains(4, {-3, 2, 1.5}));
  EXPECT_TRUE(scene->contains(5, {0, 0, 2.45}));
}

TEST(SceneGeometry, WhatIsCutOffByAnUnknownShapeStays) {
  const Lenient scene("difference { box { -2, 2 } superellipsoid { <1, 1> } quartic { <1> } }");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  ASSERT_EQ(scene->objects().size(), 1U);
  EXPECT_TRUE(scene->contains(0, {0, 0, 0}));
}

TEST(SceneGeometry, AnUnknownDeclarationCountsWhereItIsUsed) {
  const std::string declared =
      "#declare A = union { sphere { 0, 1 } quartic { <1> } }\n#declare F = function(x) { x }\n";
  const Lenient unused(declared + "sphere { 0, 2 }");
  ASSERT_TRUE(unused) << unused.geometry.error().message;
  EXPECT_THAT(unused.leniency.left_out, IsEmpty());
  const Lenient used(declared + "object { A translate x }");
  ASSERT_TRUE(used) << used.geometry.error().message;
  EXPECT_THAT(used.leniency.left_out, ElementsAre(HasSubstr("s.pov:1: 'quartic'")));
  EXPECT_EQ(used->objects().size(), 1U);
}

TEST(SceneGeometry, GoesOnBehindDirectivesAndMacrosThatFail) {
  const Lenient scene(
      "#declare Array[2] = 7;\n"
      "#if (Array[0] > 3) sphere { 0, 1 } #else sphere { 0, 2 } #end\n"
      "#macro Broken() union { sphere { 0, 3 } box { -1, Array[1] } torus { 2, 1 translate Array[0] } } #end\n"
      "Broken()\n"
      "box { -1, 1 }\n");
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  std::vector<std::string> kinds;
  for (const auto& object : scene->objects()) kinds.push_back(object.kind);
  EXPECT_THAT(kinds, ElementsAre("sphere", "box"));
  EXPECT_EQ(scene.leniency.left_out.size(), 3U) << testing::PrintToString(scene.leniency.left_out);
}

TEST(SceneGeometry, ATextWithoutStructureIsAnError) {
  EXPECT_THAT(Lenient("sphere { 0, 1").geometry, testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("s.pov:1")));
  EXPECT_THAT(Lenient("#if (1) sphere { 0, 1 }").geometry,
              testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("s.pov:1")));
  EXPECT_THAT(Lenient("#while (1) #end").geometry,
              testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("tokens")));
}

TEST(SceneGeometry, TheScenesOwnRobotIsNoPartOfIt) {
  const std::string robot = "union {\n  //*PMName robot\n  sphere { 0, 1 }\n  sphere { y, 1 }\n}\n";
  const Lenient scene("box { -1, 1 }\n" + robot);
  ASSERT_TRUE(scene) << scene.geometry.error().message;
  EXPECT_EQ(std::ranges::count_if(scene->objects(), &SceneObject::is_still), 1);
  const testing_support::TemporaryFolder folder;
  const auto without = text_without_robot(folder.write("s.pov", "box { -1, 1 }\n" + robot + "sphere { 0, 1 }"));
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_THAT(*without, HasSubstr("box { -1, 1 }\n"));
  EXPECT_THAT(*without, HasSubstr("sphere { 0, 1 }"));
  EXPECT_EQ(without->find("PMName"), std::string::npos);
  EXPECT_EQ(*text_without_robot(folder.write("t.pov", "box { -1, 1 }")), "");
}

TEST(SceneGeometry, ARobotThatIsAPartOfAnotherStatementIsNotLeftOut) {
  const testing_support::TemporaryFolder folder;
  const std::string robot = "union {\n  //*PMName robot\n  sphere { 0, 1 }\n}\n";
  for (const std::string& text :
       {"#declare R = " + robot,
        std::string("#declare A = 0;\n#if (A)\nunion {\n#else\nunion { //*PMName robot\n#end\nsphere { 0, 1 } }"),
        std::string("#declare A = 0;\nunion { //*PMName robot\nsphere { 0, 1 }\n#if (A) } #else } #end")}) {
    EXPECT_THAT(text_without_robot(folder.write("s.pov", text)),
                testing_support::FailsWith(ErrorCode::kRefused, HasSubstr("top level")))
        << text;
  }
}

}  // namespace
}  // namespace twocone::sim_povray
