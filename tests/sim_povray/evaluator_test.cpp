// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/scene/evaluator.h"

#include <cctype>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/sim_povray/scene/random_stream.h"
#include "tests/support/repeated.h"

namespace twocone::sim_povray {
namespace {

namespace fs = std::filesystem;
using testing_support::repeated;

const fs::path kScenes = fs::path(TWOCONE_SOURCE_DIR) / "scenes";
const IncludeReader kNoFiles = [](const std::string&) { return std::nullopt; };

Result<EvaluatedScene> read(const std::string& text, const EvaluatorSettings& settings = {}) {
  return evaluate("#version 3.7; " + text, "t.pov", kNoFiles, settings);
}

/// Returns the radius of the only sphere of the scene, or its position's x.
double radius(const std::string& text) {
  const auto scene = read(text);
  if (!scene || scene->objects.size() != 1) return -1;
  return std::get<Sphere>(scene->objects[0].shape).radius;
}

std::string complaint(const std::string& text) {
  const auto scene = read(text);
  return scene ? "" : scene.error().message;
}

TEST(Evaluator, ExpressionsHavePovraysPrecedence) {
  EXPECT_EQ(radius("sphere { 0, 1 + 2*3 - 8/4 }"), 5);
  EXPECT_EQ(radius("sphere { 0, (2 > 1 ? 3 : 4) + (1 = 2) + !0 }"), 4);
  EXPECT_EQ(radius("sphere { 0, <1, 2, 3>.z*max(1, 2, 0.5) }"), 6);
  EXPECT_EQ(radius("sphere { 0, vlength(<3, 4, 0>) + mod(7, 4) + int(-1.5) }"), 7);
  EXPECT_EQ(radius("#declare A = 3; sphere { 0, -A*-2 }"), 6);
}

TEST(Evaluator, MacrosLoopsAndConditions) {
  EXPECT_EQ(radius("#macro Twice(X) (X)*2 #end sphere { 0, Twice(1 + 2) + 1 }"), 7);
  EXPECT_EQ(radius("#declare R = 0; #while (R < 5) #declare R = R + 2; #end sphere { 0, R }"), 6);
  EXPECT_EQ(radius("#declare R = 0; #for (I, 1, 4) #declare R = R + I; #end sphere { 0, R }"), 10);
  EXPECT_EQ(radius("#if (0) #elseif (1) #declare R = 2; #else #declare R = 3; #end sphere { 0, R }"), 2);
  EXPECT_EQ(radius("#switch (4) #case (1) #declare R = 1; #break #range (3, 5) #declare R = 2; #break #end"
                   " sphere { 0, R }"),
            2);
  EXPECT_EQ(radius("#ifdef (A) #else #declare R = 9; #end sphere { 0, R }"), 9);
  // A local name of a macro ends with it.
  EXPECT_EQ(radius("#declare I = 1; #macro M() #local I = 5; #end M() sphere { 0, I }"), 1);
}

TEST(Evaluator, RandomNumbersAreThoseThatPovrayPrints) {
  RandomStream eleven(11);
  EXPECT_DOUBLE_EQ(eleven.next(), 0.64189288407608236);
  EXPECT_DOUBLE_EQ(eleven.next(), 0.69269633518827534);
  EXPECT_DOUBLE_EQ(RandomStream(-3).next(), 0.73403287183820110);
  EXPECT_DOUBLE_EQ(radius("#declare S = seed(11); #declare A = rand(S); sphere { 0, rand(S) }"), 0.69269633518827534);
}

TEST(Evaluator, TransformationsMoveShapesAndPigments) {
  const auto scene =
      read("union { box { 0, 1 pigment { checker rgb 0 rgb 1 scale 2 } } translate x rotate 90*y scale <1, 2, 1> }");
  ASSERT_TRUE(scene.has_value());
  const Object& box = std::get<Csg>(scene->objects.at(0).shape).parts.at(0);
  const Vec3 corner = box.placed.point({0, 1, 0});
  // POV-Ray is left-handed: 90 degrees about y take x to -z.
  EXPECT_NEAR(corner.x, 0, 1e-15);
  EXPECT_EQ(corner.y, 2);
  EXPECT_NEAR(corner.z, -1, 1e-15);
  ASSERT_EQ(box.texture->pigment.steps.size(), 1U);
  const Vec3 pattern = std::get<Transform>(box.texture->pigment.steps[0]).inverse_point(corner);
  EXPECT_NEAR(pattern.x, 0, 1e-15);
  EXPECT_NEAR(pattern.y, 0.5, 1e-15);
}

TEST(Evaluator, NamedPosesMarkWhatAProgramMoves) {
  const auto scene = read(
      "union { sphere { 0, 1 } transform { P_X1 } } camera { location y direction y up -z right x transform { P_V } }",
      {.pose_prefix = "P_"});
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(scene->objects.at(0).mover, 1);
  EXPECT_EQ(scene->camera->mover, kViewMover);
}

TEST(Evaluator, WhatIsNotSupportedIsNamedWithItsLine) {
  EXPECT_EQ(complaint("\n\nblob { threshold 1 }"), "t.pov:3: 'blob' is not supported");
  EXPECT_EQ(complaint("sphere { 0, 1\n pigment { rgbt <1, 1, 1, 0.5> } }"),
            "t.pov:2: 'rgbt' begins a transparent colour, which is not supported");
  EXPECT_EQ(complaint("global_settings {\n radiosity { } }"),
            "t.pov:2: 'radiosity' is not supported in global_settings");
  EXPECT_NE(complaint("sphere { 0, 1 ").find("t.pov:1: "), std::string::npos);
  EXPECT_NE(complaint("#macro M() M() #end M()").find("more than 100 macros"), std::string::npos);
  EXPECT_NE(complaint("#while (1) #end").find("tokens"), std::string::npos);
}

/// POV-Ray allows it for objects and textures.
TEST(Evaluator, AMacroMayGiveItsValueInABranch) {
  const std::string pick = "#macro Pick(C) #if (C) sphere { 0, 2 } #else sphere { 0, 1 } #end #end ";
  EXPECT_EQ(radius(pick + "#local H = Pick(1) object { H }"), 2);
  EXPECT_EQ(radius(pick + "#declare H = sphere { 0, 9 } #macro M() #local H = Pick(0) object { H } #end M()"), 1);
  EXPECT_EQ(radius(pick + "#declare C = Pick(1) object { C }"), 2) << "a name of the macro's parameter";
}

/// What POV-Ray prints for these texts: an argument that is a name alone is passed by reference.
TEST(Evaluator, AMacroChangesTheNamesThatItIsGiven) {
  const std::string grow = "#macro Grow(X) #declare X = X + 10; #end #declare A = 1; ";
  EXPECT_EQ(radius(grow + "Grow(A) sphere { 0, A }"), 11);
  EXPECT_EQ(radius(grow + "Grow(A + 0) Grow((A)) Grow(-A) sphere { 0, A }"), 1) << "an expression is a value";
  EXPECT_EQ(radius(grow + "#macro Twice(Y) Grow(Y) Grow(Y) #end Twice(A) sphere { 0, A }"), 21) << "through two macros";
  EXPECT_EQ(radius(grow + "#macro M() #local B = 5; Grow(B) sphere { 0, B } #end M()"), 15) << "a local name";
  EXPECT_EQ(radius("#macro M(X) #local X = 7; #end #declare A = 1; M(A) sphere { 0, A }"), 7) << "also by #local";
  EXPECT_EQ(radius("#macro M(X, Y) #declare X = 5; sphere { 0, Y } #end #declare A = 1; M(A, A)"), 5);
  EXPECT_EQ(radius("#macro M(X) #declare A = 5; sphere { 0, X } #end #declare A = 1; M(A)"), 5);
  EXPECT_EQ(radius("#macro M(X) #local A = 50; #declare X = X + 1; #end #declare A = 1; M(A) sphere { 0, A }"), 2);
  EXPECT_EQ(radius("#macro M(X) #undef X #end #declare A = 3; M(A) sphere { 0, A }"), 3);
  EXPECT_EQ(radius("#macro M(X) #declare X = sphere { 0, 9 } #end #declare A = 1; M(A) object { A }"), 9);
  EXPECT_EQ(radius("#macro M(X) #declare X = X + x; #end #declare V = <1, 2, 3>; M(V.y) sphere { 0, V.x }"), 1);
  EXPECT_EQ(radius("#macro M(X) #for (X, 1, 3) #end #end M(2) sphere { 0, 4 }"), 4);
  EXPECT_EQ(complaint("#macro M(X) #for (X, 1, 3) #end #end #declare A = 1; M(A)"),
            "t.pov:1: 'X' counts a #for and is a name of the macro's caller, which POV-Ray refuses");
}

/// No text runs or grows without end: each limit is reported with its place.
TEST(Evaluator, WhatDoesNotEndOrGrowsIsRefused) {
  const EvaluatorSettings small{.most_tokens = 1'000'000, .most_objects = 10'000};
  struct Case {
    std::string text;
    const char* limit;
  };
  for (
      const Case& c : {
          Case{"#macro M()\nM() #end M()", "t.pov:2: more than 100 macros and files are open"},
          Case{"#macro A() B() #end #macro B()\nA() #end A()", "more than 100 macros and files are open"},
          Case{"#macro M(X) M(X + 1) #end M(0)", "t.pov:1: more than 100 macros and files are open"},
          Case{"#while (1\n#end", "t.pov:2: #end stands inside of a condition"},
          Case{"#while (1 + #end", "#end stands inside of a condition"},
          Case{"#while (1) #while (#break 1) #end #end", "#break stands inside of a condition"},
          Case{"#switch (1) #case (#end", "#end stands inside of a condition"},
          Case{"#macro M() #if (0) #elseif (1 #end #end M()", "#end stands inside of a condition"},
          Case{"#macro m() #end " + repeated("m ", 50'000), "this is nested too deeply"},
          Case{"#macro m(X) X #end sphere { 0, " + repeated("m(", 50'000), "this is nested too deeply"},
          Case{"#debug " + repeated("concat(", 50'000), "this is nested too deeply"},
          Case{"sphere { 0, 1 " + repeated("transform { ", 50'000), "this is nested too deeply"},
          Case{"\n#while (1)\n#end", "t.pov:2: the scene has more than 1000000 tokens to evaluate"},
          Case{"#for (I, 0, 1e300)\n#end", "t.pov:2: the scene has more than 1000000 tokens to evaluate"},
          Case{"#for (I, 0, 1, 1e-300)\n#end", "t.pov:2: the scene has more than 1000000 tokens to evaluate"},
          Case{"#for (I, 0, 1, 0) #end", "t.pov:1: the step of this #for is 0"},
          Case{"#declare S = \"ab\"; #while (1) #declare S = concat(S, S); #end",
               "t.pov:1: this string has more than 10000 bytes"},
          Case{"sphere { <1, 2, 3, 4, 5, 6>, 1 }", "t.pov:1: this vector has more than five components"},
          Case{"#declare U = sphere { 0, 1 } #while (1) #declare U = union { object { U } object { U } } #end",
               "t.pov:1: the scene makes more than 10000 objects"},
          Case{"#declare U = sphere { 0, 1 } #while (1) #declare U = sphere { 0, 1 clipped_by { U U } } #end",
               "t.pov:1: the scene makes more than 10000 objects"},
          Case{"#macro M(O) union { object { O } object { O } } #end #declare U = box { 0, 1 }\n"
               "#while (1) #declare U = M(U) #end",
               "the scene makes more than 10000 objects"},
          Case{"#while (1) sphere { 0, 1 } #end", "t.pov:1: the scene makes more than 10000 objects"},
          Case{"#while (1) light_source { 0, rgb 1 } #end", "t.pov:1: the scene makes more than 10000 objects"},
          Case{"polygon { 20000 #for (I, 1, 20000) <1, I> #end }", "t.pov:1: the scene makes more than 10000 objects"},
          Case{
              "#declare U = union { #for (I, 0, 1999) sphere { 0, I } #end }\nobject { U #while (1) translate x #end }",
              "t.pov:2: the scene has more than 1000000 tokens to evaluate"},
          Case{"#declare P = pigment { gradient x } #while (1)\n"
               "#declare P = pigment { gradient x pigment_map { [0 P] [1 P] } } #end",
               "t.pov:2: pigments are nested more than 10 deep"},
          Case{
              "#declare P = pigment { bozo } #while (1)\n#declare P = pigment { P warp { turbulence 1 } scale 2 } #end",
              "t.pov:2: a pigment has more than 1000 transformations and warps"},
          Case{"#declare I = 0; sphere { 0, 1 pigment { gradient x color_map { #while (1) [0 rgb 1] #end } } }",
               "t.pov:1: a map has more than 256 entries"},
      }) {
    const auto scene = read(c.text, small);
    ASSERT_FALSE(scene) << c.text;
    EXPECT_NE(scene.error().message.find(c.limit), std::string::npos) << c.text << "\n" << scene.error().message;
  }
}

TEST(Evaluator, FilesWithoutATokenCountToo) {
  int opened = 0;
  const auto empty = [&](const std::string& name) {
    ++opened;
    return std::optional(IncludedFile{.path = name, .text = ""});
  };
  const auto scene = evaluate("#while (1) #include \"empty.inc\" #end", "t.pov", empty, {.most_tokens = 1'000'000});
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("more than 1000000 tokens"), std::string::npos) << scene.error().message;
  EXPECT_LE(opened, 1000);
}

TEST(Evaluator, ADeclarationThatNothingUsesMayHoldAnything) {
  const std::string declared = "#declare Strange = blob { threshold 1 }\n#declare F = function(x) { x*x }\n";
  EXPECT_EQ(radius(declared + "sphere { 0, 2 }"), 2);
  EXPECT_EQ(complaint(declared + "object { Strange }"), "t.pov:1: 'blob' is neither declared nor supported here");
}

TEST(Evaluator, TheLastCameraCounts) {
  const auto scene = read("camera { fisheye angle 20 } camera { location 2*x }");
  ASSERT_TRUE(scene.has_value());
  EXPECT_EQ(scene->camera->location, (Vec3{2, 0, 0}));
  EXPECT_EQ(complaint("camera { location 0 } camera { fisheye }"), "t.pov:1: 'fisheye' is not supported in a camera");
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A shipped scene, and the objects at its top level.
struct Shipped {
  const char* scene;
  std::size_t objects;
};

class ShippedScenes : public testing::TestWithParam<Shipped> {};

TEST_P(ShippedScenes, AreEvaluated) {
  const fs::path path = kScenes / GetParam().scene;
  const std::vector<fs::path> folders{path.parent_path(), kScenes};
  const IncludeReader read_file = [&](const std::string& name) -> std::optional<IncludedFile> {
    for (const fs::path& folder : folders) {
      if (fs::is_regular_file(folder / name)) return IncludedFile{(folder / name).string(), text_of(folder / name)};
    }
    return std::nullopt;
  };
  const auto scene = evaluate(text_of(path), path.string(), read_file, {});
  ASSERT_TRUE(scene.has_value()) << scene.error().message;
  EXPECT_EQ(scene->objects.size(), GetParam().objects);
  EXPECT_EQ(scene->lights.size(), 2U);
}

// The numbers are those of the evaluation itself: they show a loop, macro or include that is read differently.
INSTANTIATE_TEST_SUITE_P(All, ShippedScenes,
                         testing::Values(Shipped{"lab.pov", 275}, Shipped{"hall.pov", 158},
                                         Shipped{"workshop.pov", 137}, Shipped{"pair/pair.pov", 20},
                                         Shipped{"my_room/create2.pov", 82}, Shipped{"mirrors/hyperboloid.pov", 18},
                                         Shipped{"effects/plain.pov", 4}),
                         [](const auto& tested) {
                           std::string name = tested.param.scene;
                           std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                           return name;
                         });

}  // namespace
}  // namespace twocone::sim_povray
