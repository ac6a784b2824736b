// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <vector>

/// Small scenes in groups, one for each keyword of the scene language that drivers/sim_povray/scene/evaluator.h
/// supports. Their numbers are such that mistaken axes and signs show.
namespace twocone::sim_povray {

enum class Effect {
  kVisible,           ///< the scene differs from the group's plain scene
  kNone,              ///< it may look the same
  kVisibleOrRefused,  ///< NativeView::make() may also refuse it, so that POV-Ray renders it
};

struct KeywordCase {
  const char* keyword;
  const char* scene;
  Effect effect = Effect::kVisible;
};

/// Scenes that differ in one part only: each is `before`, then the part, then `after`.
struct KeywordGroup {
  const char* name;
  const char* before;
  const char* plain;  ///< the part in which no keyword of the group is used
  const char* after;
  std::vector<KeywordCase> cases;
};
inline void PrintTo(const KeywordGroup* group, std::ostream* out) { *out << group->name; }

inline constexpr const char* kStudio = R"(
  #version 3.7;
  global_settings { assumed_gamma 1 }
  #default { finish { ambient 0.21 diffuse 0.69 } }
  camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 41 }
  light_source { <3.1, 4.7, -3.3> rgb <0.93, 0.9, 0.85> }
  plane { y, -1.07 pigment { checker rgb <0.31, 0.4, 0.33> rgb <0.62, 0.59, 0.5> scale 0.83 } }
  #declare Paint = pigment { rgb <0.83, 0.42, 0.21> };
  #declare Other = pigment { rgb <0.2, 0.35, 0.8> };
)";

inline const KeywordGroup kShapes{
    "shapes",
    kStudio,
    "",
    "",
    {
        {"box", "box { <-0.9, -0.8, -0.7>, <0.6, 0.7, 0.9> pigment { Paint } }"},
        // POV-Ray's default bounding shows the second box, but with +BM2 and without bounding the first one of the
        // scene.
        {"two surfaces in one place",
         "box { <0, -0.9, -0.7>, <1.2, 0.7, 0.9> pigment { Paint } } box { <-1, -0.9, -0.7>, <0.6, 0.7, 0.9> pigment { "
         "rgb <0.2, 0.3, 0.8> } } sphere { <-1.6, 0.4, 0.3>, 0.2 pigment { Paint } }"},
        {"box turned", "box { <0.9, 0.8, -0.7>, <-0.6, -0.7, 0.9> pigment { Paint } rotate <23, 37, 11> }"},
        {"sphere", "sphere { <0.1, 0.05, 0.2>, 0.93 pigment { Paint } }"},
        {"sphere scaled", "sphere { <0.1, 0, 0.2>, 0.7 pigment { Paint } scale <1.7, 0.6, 1.1> rotate z*31 }"},
        {"cylinder", "cylinder { <0.1, -0.9, 0.2>, <0.1, 0.7, 0.2>, 0.73 pigment { Paint } }"},
        {"cylinder tilted", "cylinder { <-0.7, -0.6, 0.4>, <0.8, 0.5, -0.3>, 0.47 pigment { Paint } }"},
        {"cylinder open", "cylinder { <-0.5, -0.6, 0.4>, <0.4, 0.5, -0.7>, 0.67 open pigment { Paint } }"},
        {"cone", "cone { <0.1, -0.9, 0.2>, 0.9, <0.1, 0.7, 0.2>, 0.37 pigment { Paint } }"},
        {"cone pointed", "cone { <0.1, 0.8, -0.2>, 0.9 <-0.2, -0.9, 0.1>, 0 pigment { Paint } }"},
        {"cone open", "cone { <0.1, 0.6, -0.4>, 0.8, <-0.2, -0.9, 0.1>, 0.3 open pigment { Paint } }"},
        {"disc", "disc { <0.1, 0.1, 0>, <0.3, 0.5, -1>, 0.87 pigment { Paint } }"},
        {"disc with hole", "disc { <0.1, 0.1, 0>, <0.3, 0.5, -1>, 0.87, 0.41 pigment { Paint } }"},
        {"plane", "plane { <0.3, 0.2, -1>, -1.9 pigment { Paint } }"},
        {"torus", "torus { 0.71, 0.28 pigment { Paint } rotate <-33, 17, 0> }"},
        {"torus that meets itself", "torus { 0.41, 0.57 pigment { Paint } rotate <-53, 17, 0> }"},
        {"prism", R"(prism { -0.4, 0.5, 7, <-0.8, -0.7>, <0.9, -0.6>, <0.8, 0.4>, <0.1, -0.1>, <-0.1, 0.7>, <-0.9, 0.5>,
                     <-0.8, -0.7> pigment { Paint } rotate x*-21 })"},
        {"prism open", R"(prism { linear_spline linear_sweep -0.4, 0.5, 5, <-0.8, -0.7>, <0.9, -0.6>, <0.8, 0.4>,
                          <-0.9, 0.5>, <-0.8, -0.7> open pigment { Paint } rotate x*-31 })"},
        {"prism with hole", R"(prism { -0.4, 0.5, 9, <-0.8, -0.7>, <0.9, -0.6>, <0.8, 0.8>, <-0.9, 0.7>, <-0.8, -0.7>,
                               <-0.4, -0.3>, <0.5, -0.3>, <0.2, 0.4>, <-0.4, -0.3> pigment { Paint } rotate x*-41 })"},
        {"quadric ellipsoid",
         "quadric { <1.3, 2.1, 0.9>, <0.4, -0.3, 0.2>, <0.1, -0.2, 0.3>, -0.7 pigment { Paint } translate -0.1*y }"},
        {"quadric paraboloid", "quadric { <1, 0, 1>, 0, <0, -1, 0>, -0.6 pigment { Paint } }"},
        {"quadric of two sheets", "quadric { <1, -1.1, 0.9>, 0, 0, 0.2 pigment { Paint } rotate z*20 }"},
        {"polygon", R"(polygon { 6, <-0.8, -0.7>, <0.9, -0.6>, <0.8, 0.9>, <0.1, 0.1>, <-0.7, 0.8>, <-0.8, -0.7>
                       pigment { Paint } rotate <17, 29, 0> })"},
        {"polygon with hole", R"(polygon { 10, <-0.8, -0.7>, <0.9, -0.6>, <0.8, 0.9>, <-0.7, 0.8>, <-0.8, -0.7>,
                                 <-0.3, -0.3>, <0.4, -0.3>, <0.3, 0.3>, <-0.2, 0.3>, <-0.3, -0.3>
                                 pigment { Paint } rotate <17, 29, 0> })"},
    }};

inline const KeywordGroup kCombinations{
    "combinations",
    kStudio,
    "",
    "",
    {
        {"union", R"(union { box { <-0.9, -0.8, -0.7>, <0.2, 0.3, 0.4> } sphere { <0.3, 0.2, 0>, 0.7 pigment { Other } }
                     pigment { Paint } rotate y*17 })"},
        {"union without a gap",
         R"(union { box { <-0.9, -0.8, -0.7>, <0.1, 0.3, 0.4> } box { <0.1, -0.8, -0.7>, <0.8, 0.3, 0.4> }
                     pigment { Paint } rotate y*17 })"},
        {"difference", R"(difference { box { <-0.9, -0.8, -0.7>, <0.8, 0.7, 0.6> } sphere { <0.3, 0.6, -0.5>, 0.7 }
                          cylinder { <-0.5, 0, -2>, <-0.5, 0, 2>, 0.27 pigment { Other } } pigment { Paint } rotate y*17 })"},
        {"intersection",
         R"(intersection { sphere { 0, 0.97 } box { <-0.7, -0.9, -0.7>, <0.8, 0.6, 0.6> pigment { Other } }
                            pigment { Paint } rotate y*27 })"},
        {"merge", R"(merge { sphere { <-0.3, 0, 0>, 0.7 } box { <0, -0.9, -0.7>, <0.8, 0.4, 0.6> pigment { Other } }
                     pigment { Paint } rotate y*27 })"},
        {"nested", R"(difference { union { sphere { <-0.3, 0, 0>, 0.8 } box { <0, -0.9, -0.7>, <0.8, 0.4, 0.6> } }
                      merge { sphere { <0.5, 0.3, -0.5>, 0.4 } cone { <-0.4, 0, -2>, 0.5, <-0.3, 0.1, 0.5>, 0.1
                      pigment { Other } } } pigment { Paint } rotate y*27 })"},
        {"inverse",
         R"(intersection { sphere { 0, 0.97 } box { <-0.7, -2, -2>, <0.3, 0.1, 0.2> inverse pigment { Other } }
                       pigment { Paint } rotate y*27 })"},
        {"bounded_by", R"(union { sphere { <-0.3, 0, 0>, 0.6 } sphere { <0.4, 0.1, 0>, 0.4 } pigment { Paint }
                          bounded_by { box { -1, 1 } } })"},
        {"clipped_by", R"(sphere { 0, 0.97 pigment { Paint } clipped_by { plane { <0.3, 1, -0.8>, 0.2 } }
                          clipped_by { box { <-0.8, -0.8, -2>, <0.7, 2, 2> rotate z*9 } } })"},
        {"clipped_by inverse", R"(union { box { -0.6, 0.6 } sphere { <0.6, 0.4, 0>, 0.5 } pigment { Paint }
                                  clipped_by { sphere { <0.4, 0.6, -0.7>, 0.7 inverse } } rotate y*31 })"},
        {"no_shadow", "sphere { <0.1, 0.05, 0.2>, 0.8 pigment { Paint } no_shadow }"},
        {"no_image", "sphere { <0.1, 0.05, 0.2>, 0.8 pigment { Paint } no_image }"},
        {"no_reflection", R"(sphere { <0.1, 0.05, 0.2>, 0.6 pigment { Paint } no_reflection }
                             sphere { <-0.8, 0.5, 0.2>, 0.3 pigment { Other } }
                             box { <-2, -0.9, 1>, <2, 2, 1.1> pigment { rgb 0.1 } finish { reflection 0.8 } })"},
        {"no_image in a union", R"(union { sphere { <0.1, 0.05, 0.2>, 0.6 pigment { Paint } no_image }
                             sphere { <-0.8, 0.5, 0.2>, 0.3 pigment { Other } no_shadow no_reflection } }
                             box { <-2, -0.9, 1>, <2, 2, 1.1> pigment { rgb 0.1 } finish { reflection 0.8 } })"},
        {"object", R"(#declare Ball = sphere { 0, 0.6 pigment { Other } }
                      object { Ball translate <-0.5, 0, 0.2> } object { Ball pigment { Paint } scale 0.7 translate x*0.6 })"},
        {"hollow", "sphere { <0.1, 0.05, 0.2>, 0.8 pigment { Paint } hollow }"},
        {"interior", "sphere { <0.1, 0.05, 0.2>, 0.8 pigment { Paint } interior { ior 1.3 } }"},
    }};

inline const KeywordGroup kTransforms{
    "transforms",
    R"(
      #version 3.7;
      global_settings { assumed_gamma 1 }
      #default { finish { ambient 0.21 diffuse 0.69 } }
      camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 41 }
      light_source { <3.1, 4.7, -3.3> rgb 0.9 }
      #declare Shown = union {
        box { <-0.5, -0.6, -0.3>, <0.4, 0.2, 0.6> pigment { checker rgb <0.83, 0.42, 0.21> rgb <0.2, 0.35, 0.8> scale 0.27 } }
        cylinder { <-0.1, 0.1, 0>, <0.2, 0.9, 0.1>, 0.2 pigment { gradient y scale 0.31 } }
        torus { 0.5, 0.1 pigment { rgb <0.3, 0.7, 0.4> } }
      }
    )",
    "object { Shown }",
    "",
    {
        {"translate", "object { Shown translate <0.4, -0.3, 0.9> }"},
        {"rotate", "object { Shown rotate <23, -41, 67> }"},
        {"scale", "object { Shown scale <1.4, 0.7, 1.1> }"},
        {"scale mirrored", "object { Shown scale <-1.2, 1, 1> rotate y*20 }"},
        {"scale by 0", "object { Shown scale <1.2, 0, 0> }"},
        {"matrix", "object { Shown matrix <1.1, 0.2, -0.1, 0.3, 0.9, 0.1, -0.4, 0.2, 0.8, 0.1, -0.2, 0.3> }"},
        {"transform", R"(#declare T = transform { rotate y*33 translate <0.2, 0.1, 0> }
                         object { Shown transform { T } scale 0.9 transform { rotate z*11 transform { T } } })"},
        {"order", "object { Shown translate x*0.4 rotate z*47 scale <0.6, 1.1, 1> rotate y*30 }"},
        {"in a pigment",
         R"(box { -0.8, 0.8 pigment { checker rgb 0.9 rgb <0.3, 0.1, 0.5> rotate <11, 23, 41> scale <0.3, 0.5, 0.4>
                            translate 0.17 } rotate y*23 })"},
        {"in a texture", R"(box { -0.8, 0.8 texture { pigment { checker rgb 0.9 rgb <0.3, 0.1, 0.5> scale 0.41 }
                            rotate z*21 } rotate y*23 scale <1.1, 0.8, 1> })"},
        {"before the texture", R"(box { -0.8, 0.8 rotate y*23 scale <1.1, 0.8, 1>
                                  texture { pigment { checker rgb 0.9 rgb <0.3, 0.1, 0.5> scale 0.41 } } })"},
        {"texture with a pigment",
         R"(#declare T = texture { pigment { checker rgb 0.9 rgb <0.3, 0.1, 0.5> scale 0.31 } finish { phong 0.5 } }
                                      box { -0.8, 0.8 texture { T pigment { rgb <0.3, 0.6, 0.2> } } rotate y*23 })"},
        {"texture with a changed pigment",
         R"(#declare T = texture { pigment { checker rgb 0.9 rgb <0.3, 0.1, 0.5> scale 0.31 } }
                                      box { -0.8, 0.8 texture { T pigment { scale 2 } } rotate y*23 })"},
        {"texture with a changed finish",
         R"(#declare T = texture { pigment { rgb <0.3, 0.1, 0.5> } finish { phong 0.9 phong_size 5 } }
                                      sphere { 0, 0.9 texture { T finish { ambient 0.4 } } })"},
        {"object with a changed finish",
         R"(#declare Q = sphere { 0, 0.9 pigment { rgb <0.3, 0.1, 0.5> } finish { phong 0.9 phong_size 5 } }
                                      object { Q finish { ambient 0.4 } })"},
        {"second pigment",
         "box { -0.8, 0.8 pigment { gradient x scale 0.3 } pigment { color_map { [0 rgb x] [1 rgb y] } } rotate y*23 "
         "}"},
        {"layers", R"(sphere { 0, 0.9 texture { pigment { rgb <0.9, 0.2, 0.1> } finish { phong 1 } }
                      texture { pigment { gradient y scale 0.3 } finish { ambient 0.3 } } })"},
    }};

inline constexpr const char* kBoard = R"(
  #version 3.7;
  global_settings { assumed_gamma 1 }
  #default { finish { ambient 1 diffuse 0 } }
  camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, 0.01, 0.07> angle 41 }
  #declare Map = color_map { [0 rgb <0.9, 0.2, 0.1>] [0.31 rgb <0.1, 0.5, 0.3>] [0.62 rgb <0.2, 0.2, 0.8>] [1 rgb <0.9, 0.9, 0.6>] }
)";
/// Shows the pigment P on all sides of the origin.
inline constexpr const char* kShowPigment = R"(
  box { <-1.3, -0.9, 0.3>, <-0.1, 0.8, 1.5> pigment { P } rotate y*-9 }
  sphere { <0.7, -0.1, 0>, 0.73 pigment { P } }
)";

inline const KeywordGroup kPatterns{
    "patterns",
    kBoard,
    "#declare P = pigment { rgb <0.3, 0.5, 0.2> }",
    kShowPigment,
    {
        {"color", "#declare P = pigment { color rgb <0.83, 0.42, 0.21> }"},
        {"color red", "#declare P = pigment { color red 0.7 blue 0.31 }"},
        {"rgb number", "#declare P = pigment { rgb 0.37 }"},
        {"srgb", "#declare P = pigment { srgb <0.83, 0.42, 0.21> }"},
        {"colour arithmetic",
         "#declare C = rgb <0.9, 0.4, 0.3>; #declare D = rgb <0, 0.2, 0.1>; #declare P = pigment { color C*0.7 + D }"},
        {"colour above 1", "#declare P = pigment { rgb <1.9, -0.4, 0.3> }"},
        {"checker", "#declare P = pigment { checker rgb <0.9, 0.4, 0.3> rgb <0.1, 0.2, 0.6> scale 0.31 }"},
        {"checker of pigments", R"(#declare P = pigment { checker pigment { gradient x scale 0.2 }
                                   pigment { rgb <0.1, 0.2, 0.6> } scale 0.47 })"},
        {"brick", "#declare P = pigment { brick rgb 0.9 rgb <0.6, 0.2, 0.1> scale 0.13 }"},
        {"brick_size",
         "#declare P = pigment { brick rgb 0.9 rgb <0.6, 0.2, 0.1> brick_size <0.7, 0.31, 0.43> mortar 0.07 }"},
        {"mortar", "#declare P = pigment { brick rgb 0.9 rgb <0.6, 0.2, 0.1> mortar 1.3 scale <0.11, 0.13, 0.17> }"},
        {"brick of pigments",
         R"(#declare P = pigment { brick pigment { rgb 0.9 } pigment { gradient x color_map { Map } scale 3 }
                                 scale 0.13 })"},
        {"cells", "#declare P = pigment { cells scale 0.23 }"},
        {"cells with map", "#declare P = pigment { cells color_map { Map } scale <0.23, 0.31, 0.17> translate -7.3 }"},
        {"gradient", "#declare P = pigment { gradient x scale 0.43 }"},
        {"gradient oblique", "#declare P = pigment { gradient <1, 0.7, -0.4> color_map { Map } scale 0.43 }"},
        {"boxed", "#declare P = pigment { boxed color_map { Map } translate <0.1, 0.2, 0.1> }"},
        {"radial", "#declare P = pigment { radial translate <0.1, 0, 0.1> }"},
        {"radial with map",
         "#declare P = pigment { radial color_map { Map } frequency 5 rotate x*70 translate <0.1, 0, -1> }"},
        {"wood", "#declare P = pigment { wood scale 0.31 rotate <11, 7, 0> }"},
        {"wood with map", "#declare P = pigment { wood color_map { Map } scale 0.47 rotate <71, 7, 0> }"},
        {"bozo", "#declare P = pigment { bozo scale 0.23 }"},
        {"bozo with map",
         "#declare P = pigment { bozo color_map { Map } scale <0.23, 0.41, 0.17> translate <-13.1, 4, 91> }"},
        {"declared pigment",
         "#declare Q = pigment { gradient x color_map { Map } } #declare P = pigment { Q scale 0.37 }"},
    }};

inline const KeywordGroup kPigmentParts{
    "pigment_parts",
    kBoard,
    "#declare P = pigment { gradient x color_map { Map } scale 0.43 }",
    kShowPigment,
    {
        {"color_map",
         "#declare P = pigment { gradient x color_map { [0.2 rgb <0.9, 0.1, 0.3>] [0.7 rgb <0, 0.6, 0.2>] } scale 0.43 "
         "}"},
        {"color_map with steps", R"(#declare P = pigment { gradient x color_map { [0 rgb 0.1] [0.3 rgb <0.9, 0.1, 0.3>]
                                    [0.3 rgb <0, 0.6, 0.2>] [0.8 rgb <0.4, 0.4, 0.9>] [0.8 rgb 0.8] } scale 0.43 })"},
        {"color_map with comma",
         "#declare P = pigment { gradient x colour_map { [0, color rgb 0.2] [1, color rgb <0.1, 0.9, 0.2>] } }"},
        {"pigment_map",
         R"(#declare P = pigment { gradient x pigment_map { [0.2 checker rgb <0.9, 0.1, 0.3> rgb 0.8 scale 0.2]
                           [0.7 bozo color_map { Map } scale 0.13] } scale 0.83 })"},
        {"turbulence", "#declare P = pigment { gradient x color_map { Map } turbulence 0.4 scale 0.43 }"},
        {"turbulence of a vector",
         "#declare P = pigment { gradient x color_map { Map } turbulence <0.3, 0.5, 0> scale 0.43 }"},
        {"turbulence of a checker",
         "#declare P = pigment { checker rgb 0.9 rgb <0.1, 0.3, 0.5> turbulence 0.3 scale 0.33 }"},
        {"turbulence of bricks",
         "#declare P = pigment { brick rgb 0.9 rgb <0.1, 0.3, 0.5> turbulence 0.6 scale 0.13 }"},
        {"turbulence of cells", "#declare P = pigment { cells turbulence 0.3 scale 0.33 }"},
        {"turbulence of a boxed", "#declare P = pigment { boxed color_map { Map } turbulence 0.3 }"},
        {"turbulence of a radial", "#declare P = pigment { radial color_map { Map } turbulence 0.3 frequency 3 }"},
        {"turbulence of wood",
         "#declare P = pigment { wood color_map { Map } turbulence <0.1, 0.06, 0.2> scale 0.33 }"},
        {"turbulence of a bozo", "#declare P = pigment { bozo color_map { Map } turbulence 0.7 scale 0.33 }"},
        {"octaves", "#declare P = pigment { gradient x color_map { Map } turbulence 0.4 octaves 2 scale 0.43 }"},
        {"lambda", "#declare P = pigment { gradient x color_map { Map } turbulence 0.4 lambda 3.1 scale 0.43 }"},
        {"omega",
         "#declare P = pigment { gradient x color_map { Map } turbulence 0.4 omega 0.83 octaves 3 scale 0.43 }"},
        {"warp repeat",
         "#declare P = pigment { boxed color_map { Map } translate 0.9 warp { repeat x*1.7 } scale 0.31 }"},
        {"warp repeat offset",
         R"(#declare P = pigment { boxed color_map { Map } scale 1.4 warp { repeat y*1.3 offset <0.4, 0, 0.2> }
                                  scale 0.31 })"},
        {"warp repeat flip",
         R"(#declare P = pigment { gradient <1, 0.7, 0.3> color_map { Map } warp { repeat x*0.7 flip <1, 0, 0> }
                                warp { repeat z*0.6 flip <1, 1, 1> offset <0.1, 0, 0> } scale 0.83 })"},
        {"warp turbulence", R"(#declare P = pigment { gradient x color_map { Map } scale 0.43
                               warp { turbulence <0.3, 0.4, 0.1> octaves 3 lambda 2.3 omega 0.4 } rotate z*20 })"},
        {"warps in order",
         R"(#declare P = pigment { gradient x color_map { Map } scale 0.3 warp { turbulence 0.3 } rotate z*40
                              warp { repeat x*0.5 } scale 0.9 turbulence 0.1 })"},
        {"frequency", "#declare P = pigment { gradient x color_map { Map } frequency 3.3 }"},
        {"frequency below 0", "#declare P = pigment { gradient x color_map { Map } frequency -1.7 }"},
        {"phase", "#declare P = pigment { gradient x color_map { Map } phase 0.37 scale 0.43 }"},
        {"phase below 0", "#declare P = pigment { gradient x color_map { Map } phase -2.6 frequency 2 }"},
        {"wave just below -1",
         R"(#declare P = pigment { gradient z color_map { [0 rgb <0.9, 0.1, 0.3>] [1 rgb <0, 0.6, 0.2>] }
                                  translate z*1.300005 })"},
        {"frequency of 0", "#declare P = pigment { gradient x color_map { Map } frequency 0 phase 0.3 scale 0.83 }"},
        {"ramp_wave", "#declare P = pigment { wood color_map { Map } ramp_wave scale 0.43 }"},
        {"triangle_wave", "#declare P = pigment { gradient x color_map { Map } triangle_wave scale 0.43 }"},
        {"sine_wave", "#declare P = pigment { gradient x color_map { Map } sine_wave scale 0.43 }"},
        {"scallop_wave", "#declare P = pigment { gradient x color_map { Map } scallop_wave scale 0.43 }"},
        {"cubic_wave", "#declare P = pigment { gradient x color_map { Map } cubic_wave scale 0.43 }"},
        {"poly_wave", "#declare P = pigment { gradient x color_map { Map } poly_wave 2.7 scale 0.43 }"},
        {"poly_wave alone", "#declare P = pigment { wood color_map { Map } poly_wave scale 0.43 }"},
        {"frequency of a checker",
         "#declare P = pigment { checker rgb 0.9 rgb <0.1, 0.3, 0.5> frequency 0.37 scale 0.43 }",
         Effect::kVisibleOrRefused},
        {"phase of a checker", "#declare P = pigment { checker rgb 0.9 rgb <0.1, 0.3, 0.5> phase 0.3 scale 0.43 }",
         Effect::kVisibleOrRefused},
        {"wave of a checker",
         R"(#declare P = pigment { checker rgb 0.9 rgb <0.1, 0.3, 0.5> triangle_wave frequency 0.7 phase 0.2
                                 scale 0.43 })",
         Effect::kVisibleOrRefused},
        {"wave of bricks",
         "#declare P = pigment { brick pigment { rgb x } pigment { gradient y scale 3 } sine_wave frequency 0.3 scale "
         "0.13 }",
         Effect::kVisibleOrRefused},
        {"pattern after a pigment",
         "#declare Q = pigment { gradient x color_map { Map } frequency 2 } #declare P = pigment { Q boxed }"},
        {"pigment that is changed", R"(#declare Q = pigment { gradient x color_map { Map } scale 0.43 }
                                       #declare P = pigment { Q color_map { [0 rgb 0.2] [1 rgb <0.9, 0.7, 0>] } rotate z*40 })"},
        {"quick_color", "#declare P = pigment { gradient y color_map { Map } quick_color rgb <1, 0, 0> scale 0.43 }"},
    }};

inline const KeywordGroup kFinishes{
    "finishes",
    R"(
      #version 3.7;
      global_settings { assumed_gamma 1 }
      camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 41 }
      light_source { <3.1, 4.7, -3.3> rgb <0.73, 0.7, 0.65> }
      light_source { <-4.1, 2.7, -2.3> rgb <0.2, 0.3, 0.4> }
      sky_sphere { pigment { gradient y color_map { [0 rgb 0.7] [1 rgb <0.2, 0.3, 0.7>] } } }
    )",
    "#declare F = finish { }",
    R"(
      sphere { <-0.5, 0, 0>, 0.73 pigment { rgb <0.83, 0.42, 0.21> } finish { F } }
      box { <0.3, -0.7, -0.4>, <1.1, 0.5, 0.6> pigment { rgb <0.2, 0.35, 0.8> } finish { F } rotate y*-24 }
      plane { y, -1.07 pigment { checker rgb <0.31, 0.4, 0.33> rgb <0.62, 0.59, 0.5> scale 0.83 } finish { F } }
    )",
    {
        {"ambient", "#declare F = finish { ambient 0.37 }"},
        {"ambient of a colour", "#declare F = finish { ambient rgb <0.1, 0.4, 0.3> }"},
        {"emission", "#declare F = finish { emission 0.37 }"},
        {"emission of a colour", "#declare F = finish { emission rgb <0.1, 0.4, 0.3> }"},
        {"diffuse", "#declare F = finish { diffuse 0.93 }"},
        {"brilliance", "#declare F = finish { brilliance 2.7 }"},
        {"specular", "#declare F = finish { specular 0.67 }"},
        {"roughness", "#declare F = finish { specular 0.67 roughness 0.13 }"},
        {"phong", "#declare F = finish { phong 0.67 }"},
        {"phong_size", "#declare F = finish { phong 0.67 phong_size 7 }"},
        {"metallic", "#declare F = finish { specular 0.67 roughness 0.13 metallic }", Effect::kVisibleOrRefused},
        {"metallic with phong", "#declare F = finish { phong 0.67 phong_size 7 metallic 0.6 }",
         Effect::kVisibleOrRefused},
        {"reflection", "#declare F = finish { reflection 0.37 }"},
        {"reflection of a colour", "#declare F = finish { reflection rgb <0.6, 0.4, 0.2> }"},
        {"reflection in braces", "#declare F = finish { reflection { 0.37 } }"},
        {"reflection in braces of a colour", "#declare F = finish { reflection { rgb <0.6, 0.4, 0.2> } diffuse 0.2 }"},
        {"finish on a finish", "#declare G = finish { ambient 0.4 phong 0.5 } #declare F = finish { G phong_size 9 }"},
        {"default", "#default { finish { ambient 0.4 diffuse 0.3 } } #declare F = finish { phong 0.5 }"},
    }};

inline constexpr const char* kRoom = R"(
  #version 3.7;
  global_settings { assumed_gamma 1 }
  #default { finish { ambient 0.11 diffuse 0.79 } }
  camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 47 }
)";
inline constexpr const char* kFurniture = R"(
  sphere { <-0.5, 0, 0>, 0.73 pigment { rgb <0.83, 0.42, 0.21> } finish { specular 0.4 } }
  box { <0.3, -0.7, -0.4>, <1.1, 0.5, 0.6> pigment { rgb <0.2, 0.35, 0.8> } rotate y*-24 }
  plane { y, -1.07 pigment { checker rgb <0.51, 0.6, 0.53> rgb <0.82, 0.79, 0.7> scale 0.83 } }
  plane { z, 2.3 pigment { rgb 0.7 } }
)";

inline const KeywordGroup kLights{
    "lights",
    kRoom,
    "",
    kFurniture,
    {
        {"light_source", "light_source { <2.1, 3.7, -3.3> rgb <0.93, 0.9, 0.85> }"},
        {"light_source of color", "light_source { <2.1, 3.7, -3.3>, color rgb <0.93, 0.6, 0.35>*1.2 }"},
        {"several", "light_source { <2.1, 3.7, -3.3> rgb 0.4 } light_source { <-3, 2, 0> rgb <0.1, 0.4, 0.6> }"},
        {"above 1", "light_source { <2.1, 3.7, -3.3> rgb 2.3 }"},
        {"shadowless", "light_source { <2.1, 3.7, -3.3> rgb 0.9 shadowless }"},
        {"fade_distance", "light_source { <2.1, 3.7, -3.3> rgb 0.9 fade_distance 3.1 fade_power 2 }"},
        {"fade_power", "light_source { <1.1, 1.7, -1.3> rgb 0.9 fade_distance 1.3 fade_power 1.4 }"},
        {"fade_power alone", "light_source { <1.1, 1.7, -1.3> rgb 0.9 fade_power 2 }"},
        {"fade_distance alone", "light_source { <1.1, 1.7, -1.3> rgb 0.9 fade_distance 1.3 }"},
        {"spotlight",
         "light_source { <1.1, 2.7, -2.3> rgb 0.9 spotlight point_at <0.1, -1, 0.3> radius 9 falloff 19 }"},
        {"spotlight by default", "light_source { <0.4, 0.7, -1.9> rgb 0.9 spotlight }"},
        {"radius", "light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight radius 5 }"},
        {"radius above falloff", "light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight radius 20 falloff 10 }"},
        {"falloff", "light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight radius 10 falloff 23 }"},
        {"tightness", "light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight tightness 13 }"},
        {"point_at",
         "light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight radius 12 falloff 20 point_at <0.5, -0.3, 0> }"},
        {"spotlight that fades", R"(light_source { <0.4, 1.7, -1.9> rgb 0.9 spotlight radius 20 falloff 30 tightness 2
                                    point_at <0.5, -0.3, 0> fade_distance 2 fade_power 1 shadowless })"},
        {"light transformed", R"(light_source { 0 rgb 0.9 spotlight point_at z radius 12 falloff 20 rotate <31, -7, 0>
                                 translate <0.4, 1.7, -1.9> })"},
        {"light declared",
         "#declare L = light_source { <2.1, 3.7, -3.3> rgb 0.6 } light_source { L } light_source { L translate x*-3 }"},
        {"spotlight without point_at", "light_source { <0.4, 0.3, -2.9> rgb 0.9 spotlight radius 10 falloff 15 }"},
        {"shadowless with highlights", "light_source { <-2.1, 3.7, -3.3> rgb <0.9, 0.5, 0.3> shadowless }"},
        {"shadowless spotlight", R"(light_source { <0.4, 1.7, -1.9> rgb 0.9 shadowless spotlight point_at <0.5, -0.3, 0>
                                    radius 12 falloff 20 })"},
    }};

inline const KeywordGroup kSkies{
    "skies",
    R"(
      #version 3.7;
      global_settings { assumed_gamma 1 }
      camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, 0.41, 0.07> angle 61 }
      light_source { <3.1, 4.7, -3.3> rgb 0.9 }
      sphere { <0.2, 0, 0>, 0.93 pigment { rgb <0.83, 0.42, 0.21> } finish { reflection 0.5 } }
    )",
    "",
    "",
    {
        {"background", "background { color rgb <0.31, 0.42, 0.73> }"},
        {"background without color", "background { rgb <0.31, 0.42, 0.73> }"},
        {"sky_sphere",
         "sky_sphere { pigment { gradient y color_map { [0 rgb <0.7, 0.6, 0.5>] [0.4 rgb <0.2, 0.3, 0.7>] } } }"},
        {"sky_sphere transformed",
         R"(sky_sphere { pigment { bozo color_map { [0.3 rgb <0.7, 0.6, 0.5>] [0.7 rgb <0.2, 0.3, 0.7>] }
                                      scale 0.3 } rotate <20, 30, 0> scale <1, 0.4, 1> })"},
        {"sky_sphere of two", R"(sky_sphere { pigment { rgb 0.3 } pigment { radial frequency 8 rotate x*50 } }
                                 background { rgb <1, 0, 0> })"},
        {"sky_sphere of wood", "sky_sphere { pigment { wood turbulence 0.1 scale 0.1 } }"},
    }};

inline const KeywordGroup kCameras{
    "cameras",
    R"(
      #version 3.7;
      global_settings { assumed_gamma 1 }
      #default { finish { ambient 0.21 diffuse 0.69 } }
      light_source { <3.1, 4.7, -3.3> rgb 0.9 }
    )",
    "camera { location <0, 0.3, -5> }",
    kFurniture,
    {
        {"location", "camera { location <0.4, 0.9, -3.7> }"},
        {"direction", "camera { location <0.4, 0.3, -3.7> direction <0.3, -0.1, 1.2> }"},
        {"right", "camera { location <0.4, 0.3, -3.7> right x*1.9 }"},
        {"right mirrored", "camera { location <0.4, 0.3, -3.7> right -x*4/3 }"},
        {"up", "camera { location <0.4, 0.3, -3.7> up <0.2, 0.7, 0> }"},
        {"look_at", "camera { location <1.4, 1.3, -3.7> look_at <0.1, -0.2, 0> }"},
        {"look_at upwards", "camera { location <0.1, -0.9, -0.2> look_at <0.1, 3, -0.2> }"},
        {"look_at mirrored", "camera { location <1.4, 1.3, -3.7> right -x*1.2 look_at <0.1, -0.2, 0> }"},
        {"sky", "camera { location <1.4, 1.3, -3.7> sky <0.4, 1, 0.1> look_at <0.1, -0.2, 0> }"},
        {"angle", "camera { location <0.4, 0.3, -3.7> angle 37 }"},
        {"angle with look_at",
         "camera { location <1.4, 1.3, -3.7> look_at <0.1, -0.2, 0> right x*1.2 up y*0.8 direction z*2 angle 53 }"},
        {"angle before",
         "camera { angle 53 location <1.4, 1.3, -3.7> right x*1.2 direction z*2 look_at <0.1, -0.2, 0> }"},
        {"camera transformed", "camera { location -z*4 look_at 0 angle 43 rotate <17, 29, 5> translate y*0.2 }"},
        {"camera declared",
         "#declare C = camera { location <1.4, 1.3, -3.7> angle 37 look_at 0 } camera { C translate x*0.1 }"},
        {"last camera", "camera { orthographic location -z } camera { location <1.4, 1.3, -3.7> look_at 0 }"},
        {"image_width", "camera { location <1.4, 1.3, -3.7> right x*image_width/image_height*0.8 look_at 0 }"},
    }};

inline const KeywordGroup kSettings{
    "settings",
    "#version 3.7;",
    "global_settings { assumed_gamma 1 }",
    R"(
      #default { finish { ambient 0.21 diffuse 0.49 } }
      camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 41 }
      light_source { <3.1, 4.7, -3.3> rgb <0.73, 0.7, 0.65> }
      background { rgb <0.2, 0.3, 0.7> }
      sphere { <-0.6, 0, 0>, 0.73 pigment { rgb <0.83, 0.42, 0.21> } finish { reflection 0.6 } }
      sphere { <0.8, 0, 0>, 0.63 pigment { rgb <0.2, 0.35, 0.8> } finish { reflection rgb <0.7, 0.3, 0.2> } }
      plane { y, -1.07 pigment { checker rgb <0.31, 0.4, 0.33> rgb <0.62, 0.59, 0.5> scale 0.83 } finish { reflection 0.3 } }
    )",
    {
        {"assumed_gamma 1", "global_settings { assumed_gamma 1.0 }", Effect::kNone},
        {"assumed_gamma 2.2", "global_settings { assumed_gamma 2.2 }", Effect::kVisibleOrRefused},
        {"max_trace_level 1", "global_settings { assumed_gamma 1 max_trace_level 1 }"},
        {"max_trace_level 2", "global_settings { assumed_gamma 1 max_trace_level 2 }"},
        {"max_trace_level 9", "global_settings { assumed_gamma 1 max_trace_level 9 }", Effect::kNone},
        {"adc_bailout", "global_settings { assumed_gamma 1 adc_bailout 0.31 }"},
        {"adc_bailout 0", "global_settings { assumed_gamma 1 adc_bailout 0 max_trace_level 12 }", Effect::kNone},
        {"ambient_light", "global_settings { assumed_gamma 1 ambient_light rgb <0.3, 2, 0.8> }"},
        {"ambient_light of a number", "global_settings { assumed_gamma 1 ambient_light 0.3 }"},
        {"number_of_waves", "global_settings { assumed_gamma 1 number_of_waves 5 max_intersections 80 }",
         Effect::kNone},
        {"version 3.6", "#version 3.6; global_settings { assumed_gamma 1 }", Effect::kNone},
        {"version 3.6 alone", "#version 3.6;", Effect::kVisibleOrRefused},
        {"none", "", Effect::kNone},
    }};

inline const KeywordGroup kLanguage{
    "language",
    R"(
      #version 3.7;
      global_settings { assumed_gamma 1 }
      #default { finish { ambient 0.21 diffuse 0.69 } }
      camera { location <0.37, 1.73, -4.13> right x*4/3 look_at <0.03, -0.11, 0.07> angle 41 }
      light_source { <3.1, 4.7, -3.3> rgb 0.9 }
      // A row of balls whose radii are the numbers.
      #macro Ball(I, R) sphere { <(I - 3)*0.37, 0, 0>, R pigment { rgb <0.83, 0.42, 0.21> } } #end
    )",
    "",
    "",
    {
        {"macro", "#macro Twice(X) (X)*2 #end Ball(1, Twice(0.04 + 0.05)) Ball(4, Twice(0.1) + 0.07)"},
        {"macro without parameters", "#macro Half() 0.5 #end Ball(1, Half()*0.4) Ball(4, Half())"},
        {"macro that calls itself", "#macro Row(N) #if (N > 0) Ball(N, 0.05*N) Row(N - 1) #end #end Row(5)"},
        {"macro of an object",
         "#macro Both(O) object { O translate x*0.4 } object { O scale 0.5 translate x*-0.6 } #end Both(Ball(3, 0.3))"},
        {"while", "#declare I = 0; #while (I < 6) Ball(I, 0.07 + 0.03*I) #declare I = I + 1; #end"},
        {"for", "#for (I, 0, 5, 2) Ball(I, 0.07 + 0.03*I) #end"},
        {"for downwards", "#for (I, 5, 0.5, -1.5) Ball(I, 0.07 + 0.03*I) #end"},
        {"for with a changed counter", "#for (I, 0, 5) Ball(I, 0.1 + 0.04*I) #declare I = I + 1; #end"},
        {"counter after its loop", "#for (I, 0, 3, 0.7) #end Ball(2, I*0.1)"},
        {"if", "#if (2 > 1) Ball(1, 0.2) #else Ball(4, 0.3) #end #if (1 = 2) Ball(5, 0.2) #else Ball(0, 0.1) #end"},
        {"elseif", "#declare A = 3; #if (A < 2) Ball(1, 0.2) #elseif (A < 4) Ball(3, 0.3) #else Ball(5, 0.2) #end"},
        {"ifdef",
         "#declare A = 3; #ifdef (A) Ball(1, 0.2) #end #ifndef (A) Ball(3, 0.3) #end #undef A #ifndef (A) Ball(5, 0.1) "
         "#end"},
        {"switch", R"(#for (I, 0, 5) #switch (I) #case (1) Ball(I, 0.1) #break #case (2) Ball(I, 0.2) #range (3, 4)
                      Ball(I, 0.15 + I*0.02) #break #else Ball(I, 0.07) #end #end)"},
        {"switch into else", "#switch (1) #case (1) Ball(1, 0.1) #case (7) Ball(3, 0.2) #else Ball(5, 0.3) #end"},
        {"break in a loop", "#for (I, 0, 5) #if (I > 2) #break #end Ball(I, 0.1 + 0.04*I) #end"},
        {"declare", "#declare R = 0.2; #declare R = R + 0.13; #declare V = <0.1, 0.2, R>; Ball(2, V.z) Ball(4, V.x)"},
        {"local", "#macro M(R) #local I = R*2; Ball(1, I) #end #declare I = 0.3; M(0.07) Ball(4, I)"},
        {"declare in a macro", "#macro M(R) #declare K = R*2; #end M(0.11) Ball(1, K)"},
        {"parameter by reference", "#macro Grow(V) #declare V = V + 0.2; #end #declare R = 0.17; Grow(R) Ball(2, R)"},
        {"parameter by value",
         "#macro Grow(V) #declare V = V + 0.2; Ball(4, V) #end #declare R = 0.1; Grow(R + 0.05) Ball(2, R)"},
        {"local parameter by reference", R"(#macro Grow(V) #local V = V + 0.2; #end
                                            #macro Rows() #local L = 0.17; Grow(L) Ball(2, L) #end Rows())"},
        {"declare of a caller's local", R"(#declare L = 0.1; #macro In() #declare L = 0.4; #end
                                           #macro Out() #local L = 0.3; In() Ball(1, L) #end Out() Ball(4, L))"},
        {"rand",
         "#declare S = seed(7); #declare T = seed(-12345); #for (I, 0, 5) Ball(I, 0.05 + 0.3*rand(S)*rand(T)) #end"},
        {"seed of a fraction", "#declare S = seed(17.6); #for (I, 0, 5) Ball(I, 0.05 + 0.3*rand(S)) #end"},
        {"rand of a large seed", "#declare S = seed(1234567890); #for (I, 0, 5) Ball(I, 0.05 + 0.3*rand(S)) #end"},
        {"abs, sqrt", "Ball(1, abs(-0.2)) Ball(3, sqrt(0.1)) Ball(5, pow(0.4, 1.7))"},
        {"sin, cos, tan", "Ball(1, sin(0.2)) Ball(3, cos(1.3)) Ball(5, tan(0.23))"},
        {"asin, acos, atan2", "Ball(1, asin(0.2)) Ball(3, acos(0.9)) Ball(5, atan2(0.2, 0.9)) Ball(0, atan(0.1))"},
        {"exp, ln, log", "Ball(1, exp(-1.7)) Ball(3, ln(1.3)) Ball(5, log(1.7))"},
        {"int, floor, ceil", "Ball(1, int(-1.5)*-0.2) Ball(3, floor(-1.5)*-0.1) Ball(5, ceil(0.2)*0.2)"},
        {"mod, div", "Ball(1, mod(-7.3, 2)*-0.2) Ball(3, div(7, 2)*0.07) Ball(5, mod(5.2, 3)*0.1)"},
        {"min, max, select",
         "Ball(1, min(0.3, 0.2, 0.4)) Ball(3, max(0.1, 0.3)) Ball(5, select(-1, 0.1, 0.2, 0.3)) Ball(0, select(0, 0.3, "
         "0.17))"},
        {"degrees, radians, pi", "Ball(1, radians(13)) Ball(3, degrees(0.005)) Ball(5, pi/20)"},
        {"vlength, vdot",
         "Ball(1, vlength(<0.1, 0.2, 0.1>)) Ball(3, vdot(<1, 2, 3>, <0.1, 0.05, 0.03>)) Ball(5, vnormalize(<1, 3, "
         "0>).x)"},
        {"vcross, vrotate",
         "Ball(1, vcross(<0.3, 0.4, 0>, <0, 0.1, 0.7>).x) Ball(4, vrotate(<0.3, 0, 0>, <10, 20, 40>).y)"},
        {"vector arithmetic",
         "#declare V = <0.1, 0.2, 0.3>*2 - y*0.1 + 0.03; Ball(1, V.x) Ball(3, V.y) Ball(5, (V*<0, 0, 0.4>).z)"},
        {"vector of two",
         "#declare V = <0.1, 0.2>; #declare W = V + <0.05, 0, 0.17>; Ball(1, V.u) Ball(3, V.v) Ball(5, W.x) Ball(0, "
         "W.z)"},
        {"colour parts",
         "#declare C = rgbft <0.1, 0.2, 0.3, 0.15, 0.25>; Ball(0, C.red) Ball(1, C.green) Ball(3, C.blue) Ball(4, "
         "C.filter) Ball(5, C.transmit)"},
        {"conditional",
         "Ball(1, (2 > 1 ? 0.2 : 0.3)) Ball(3, (1 >= 1 & 2 != 2 ? 0.1 : 0.25)) Ball(5, (0 | 3 <= 2 ? 0.3 : 0.15))"},
        {"nearly equal",
         R"(Ball(0, 0.1 + 0.1*(0.1 + 0.2 = 0.3)) Ball(2, 0.1 + 0.1*(1e-11 < 2e-11)) Ball(4, 0.1 + 0.1*(1e-11 != 0))
                            Ball(5, (1e-11 ? 0.1 : 0.2)))"},
        {"precedence",
         "Ball(1, 0.1 + 0.2*0.5) Ball(3, 1/2/2) Ball(5, -0.1*-2) Ball(0, 0.5 - 0.2 - 0.1) Ball(4, (1 + 1 = 2)*0.2)"},
        {"string",
         R"(#declare T = concat("a", str(12.345, 0, 2)); Ball(1, strlen(T)*0.03) Ball(4, (strcmp(T, "a12.35") = 0)*0.1 + 0.1))"},
        {"str", R"scene(#declare A = str(-1.55, -7, 1); #declare B = str(3.14159, 8, 3); #declare C = str(2.1, 0, -1);
                   Ball(0, strlen(A)*0.03) Ball(2, strlen(B)*0.03) Ball(4, strlen(C)*0.03)
                   Ball(5, 0.1 + 0.1*(strcmp(A, "-0001.6") = 0)))scene"},
        {"escapes", R"scene(Ball(1, strlen("a\"b")*0.06) Ball(4, strlen("\\n")*0.07))scene"},
        {"numbers", "Ball(1, .2) Ball(3, 2.5e-1) Ball(5, 1E-1)"},
        {"comment", "/* Ball(0, 0.3) /* nested */ Ball(1, 0.3) */ Ball(4, 0.2) // Ball(5, 0.3)"},
        {"default pigment", "#default { pigment { rgb <0.2, 0.6, 0.3> } } sphere { 0, 0.5 }"},
        {"default texture",
         "#default { texture { pigment { checker rgb 1 rgb 0.3 scale 0.3 } finish { phong 0.4 } } } sphere { 0, 0.5 }"},
        {"no texture", "sphere { 0, 0.5 }", Effect::kNone},
        {"version", "#if (version >= 3.7) Ball(3, 0.4) #end"},
    }};

}  // namespace twocone::sim_povray
