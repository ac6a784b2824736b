// SPDX-License-Identifier: Apache-2.0
//
// furnished.pov : a living room full of vivid colours, in which no coloured landmark could be told from the furniture.
// Twelve pipes carry bands with a number instead. Blinds, shelves, striped vases and a chequered rug have edges that look
// like bands and are none.
//
// SCALE  1 POV-Ray unit = 5 cm; world (x, y, z) metres is POV-Ray <x, z, y> / 0.05, as W() does.
// ROOM   x from -3.05 to 3.05 m, y from -2.55 to 2.55 m, ceiling at 2.40 m.
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.
//
// robots/furnished_sim.yaml and furnished.map.yaml contain the same numbers.

#version 3.7;
#include "parts/robot.inc"
global_settings { assumed_gamma 1.0 max_trace_level 4 }

#declare M = 20;
#macro W(X, Y, Z) <(X)*M, (Z)*M, (Y)*M> #end
#include "parts/bands.inc"

background { color rgb 0.75 }
light_source { W(-1.2,  0.7, 2.25) color rgb 0.57 }
light_source { W( 1.3, -0.7, 2.25) color rgb 0.57 }

#declare F_Matt = finish { ambient 0.30 diffuse 0.62 }
#default { finish { F_Matt } }
#macro Block(X0, Y0, Z0, X1, Y1, Z1, R, G, B) box { W(X0, Y0, Z0) W(X1, Y1, Z1) pigment { color rgb <R, G, B> } } #end

// ------------------------------------------------------------------ room ----
box { W(-3.05, -2.55, -0.05) W(3.05, 2.55, 0)
  pigment { checker color rgb <0.50, 0.47, 0.42> color rgb <0.30, 0.29, 0.27> scale 8 translate -100*y } no_shadow }
box { W(-3.05, -2.55, 2.40) W(3.05, 2.55, 2.45) pigment { color rgb 0.62 } finish { ambient 1 diffuse 0 } no_shadow }
box { W(-3.15,  2.55, 0) W( 3.15,  2.65, 2.4) pigment { color rgb <0.85, 0.55, 0.20> } no_shadow }   // north, orange
box { W(-3.15, -2.65, 0) W( 3.15, -2.55, 2.4) pigment { color rgb <0.74, 0.735, 0.72> } no_shadow }  // south
box { W( 3.05, -2.65, 0) W( 3.15,  2.65, 2.4) pigment { color rgb <0.20, 0.45, 0.62> } no_shadow }   // east, blue
box { W(-3.15, -2.65, 0) W(-3.05,  2.65, 2.4) pigment { color rgb <0.74, 0.735, 0.72> } no_shadow }  // west

// ------------------------------------------------------------- furniture ----
Block(-3.05, 0.45, 0.00, -2.35, 1.75, 0.42,  0.75, 0.06, 0.05)    // a red sofa
Block(-3.05, 0.45, 0.42, -2.80, 1.75, 0.85,  0.75, 0.06, 0.05)
Block(-2.75, 0.60, 0.42, -2.45, 0.95, 0.56,  0.10, 0.60, 0.15)    // a green cushion
Block( 2.45, -2.15, 0.00, 3.05, -1.35, 1.80,  0.05, 0.10, 0.65)   // a blue cupboard
Block( 1.55, -2.55, 0.00, 2.25, -2.15, 0.75,  0.75, 0.70, 0.05)   // a yellow desk
Block(-3.05, -1.40, 0.00, -2.70, -0.40, 0.90,  0.05, 0.55, 0.55)  // a cyan chest
cylinder { W(-1.10, -2.20, 0) W(-1.10, -2.20, 0.40) 0.18*M pigment { color rgb <0.70, 0.05, 0.60> } }   // a magenta bin
cylinder { W( 2.20,  1.60, 0) W( 2.20,  1.60, 0.45) 0.22*M pigment { color rgb <0.05, 0.60, 0.10> } }   // a green pouf
// A rug with black and white squares
box { W(-1.5, -1.2, 0) W(0.9, 0.6, 0.0002) pigment { checker color rgb 0.75 color rgb 0.05 scale 3 } no_shadow }
// Blinds before the windows: slats of 40 mm and of 20 mm, light and dark
#macro Blind(X0, Y0, X1, Y1, SLAT)
  box { W(X0, Y0, 0.50) W(X1, Y1, 2.00)
    pigment { gradient y color_map { [0.5 rgb 0.78] [0.5 rgb 0.06] } scale 2*(SLAT)*M } no_shadow }
#end
Blind(1.40, 2.53, 2.60, 2.55, 0.040)
Blind(-2.40, 2.53, -1.20, 2.55, 0.020)
Blind(3.03, 0.70, 3.05, 1.40, 0.017)
// Shelves with books: backs of any height and grey, as tall as bands are
#declare Seed = seed(7);
#macro Books(X0, X1, Y, Z)
  #local X = X0;
  #while (X < X1)
    #local Wide = 0.02 + 0.03 * rand(Seed);
    #local High = 0.17 + 0.09 * rand(Seed);
    #local Grey = rand(Seed);
    box { W(X, Y, Z) W(X + Wide - 0.002, Y + 0.16, Z + High)
      pigment { gradient y color_map { [0.2 rgb 0.05 + 0.7 * Grey] [0.2 rgb 0.75 - 0.7 * Grey] [0.3 rgb 0.75 - 0.7 * Grey]
                                       [0.3 rgb 0.05 + 0.7 * Grey] } scale High * M translate Z * M * y } no_shadow }
    #local X = X + Wide;
  #end
#end
Block(-0.20, 2.33, 0.00, 0.85, 2.55, 0.55,  0.40, 0.25, 0.12)
Block(-0.20, 2.37, 0.83, 0.85, 2.55, 0.86,  0.40, 0.25, 0.12)
Block(-0.20, 2.37, 1.14, 0.85, 2.55, 1.17,  0.40, 0.25, 0.12)
Books(-0.18, 0.80, 2.38, 0.55)
Books(-0.18, 0.80, 2.38, 0.86)
Books(-0.18, 0.80, 2.38, 1.17)
// Vases and a barber's pole, striped round as bands are, at the bands' heights and sizes
#macro Striped(X, Y, RADIUS, Z0, Z1, STRIPE, SHARE)
  cylinder { W(X, Y, Z0) W(X, Y, Z1) (RADIUS)*M
    pigment { gradient y color_map { [SHARE rgb 0.78] [SHARE rgb 0.05] } scale (STRIPE)*M translate (Z1)*M*y } }
#end
Striped( 1.75, -2.35, 0.05, 0.75, 1.10, 0.034, 0.5)    // on the desk
Striped( 2.05, -2.35, 0.05, 0.75, 1.00, 0.051, 0.34)
Striped(-2.88, -0.60, 0.06, 0.90, 1.20, 0.068, 0.5)    // on the chest
Striped(-2.88, -1.10, 0.04, 0.90, 1.15, 0.034, 0.7)
Striped(-1.90,  1.20, 0.055, 0.00, 1.00, 0.034, 0.5)   // the pole

// ---------------------------------------------------------------- pipes -----
#ifndef (Landmarks_Elsewhere)
Banded(-2.75, -1.70, 0.055, 1.00, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0)   // 1
Banded(-2.70,  1.95, 0.055, 1.00, 0, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0)   // 2
Banded(-0.60,  2.30, 0.055, 1.00, 0, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0)   // 3
Banded( 1.10,  2.25, 0.055, 1.00, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 1, 0)   // 4
Banded( 2.80,  2.25, 0.055, 1.00, 0, 0, 1, 0, 1, 0, 0, 1, 0, 1, 0, 1)   // 5
Banded( 2.75,  0.45, 0.055, 1.00, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1, 0)   // 6
Banded( 2.70, -1.15, 0.055, 1.00, 0, 1, 0, 0, 1, 0, 1, 0, 1, 1, 0, 1)   // 7
Banded( 1.30, -2.20, 0.055, 1.00, 0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0)   // 8
Banded(-0.20, -2.25, 0.055, 1.00, 0, 1, 0, 1, 0, 0, 1, 1, 0, 1, 0, 1)   // 9
Banded(-1.60, -2.30, 0.055, 1.00, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 1)   // 10
Banded(-2.80,  0.15, 0.055, 1.00, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1)   // 11
Banded( 1.45,  0.80, 0.055, 1.00, 0, 1, 1, 0, 0, 1, 1, 0, 1, 0, 1, 0)   // 12
#end

// ----------------------------------------------------------------- robot ----
// Heights above the floor, in metres: 0.25 lower lens, 0.37 lower tip, 0.55 upper lens, 0.67 upper tip.
union {
  //*PMName robot
  object { Robot_Body }
  object { Robot_Camera translate Robot_Up(0.249) }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.37) }
  object { Robot_Camera translate Robot_Up(0.549) }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.67) }
  object { Robot_Mast(0.78) }
}

// ---------------------------------------------------------------- cameras ----
// As in lab.pov
camera {
  //*PMName lower
  perspective
  location <0, 5, 0>  direction <0, 1.475, 0>  up <0, 0, -1>  right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective
  location <0, 11, 0>  direction <0, 1.475, 0>  up <0, 0, -1>  right <4/3, 0, 0>
}
// View from a corner. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(-2.9, -2.4, 2.1)
  right <4/3, 0, 0>
  up <0, 1, 0>
  sky <0, 1, 0>
  angle 84
  look_at W(0.6, 0.5, 0.5)
}
