// SPDX-License-Identifier: Apache-2.0
//
// corridor.pov : a corridor that leads round a block back to its start, 30 m long and 2.2 m wide. The lab's robot sees
// a part of it at a time, so that a map of it needs a closed loop. Twelve pipes have six colours: each colour occurs
// twice, far apart.
//
// SCALE  1 POV-Ray unit = 5 cm; world (x, y, z) metres is POV-Ray <x, z, y> / 0.05, as W() does.
// ROOM   x from -5 to 5 m, y from -1.1 to 7.1 m; the block is x from -2.8 to 2.8 m, y from 1.1 to 4.9 m; ceiling at
//        2.40 m.
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.
//
// As in lab.pov only the pipes are strongly coloured, the lights are white, and the pipes are matt.
// robots/corridor_sim.yaml and corridor.map.yaml contain the same numbers.

#version 3.7;
#include "parts/robot.inc"
global_settings { assumed_gamma 1.0 max_trace_level 4 }

#declare M = 20;
#macro W(X, Y, Z) <(X)*M, (Z)*M, (Y)*M> #end
#declare WZ = 2.40;

background { color rgb 0.75 }
light_source { W(-3.9, -0.2, 2.25) color rgb 0.36 }
light_source { W( 3.9,  0.2, 2.25) color rgb 0.36 }
light_source { W( 3.9,  6.2, 2.25) color rgb 0.36 }
light_source { W(-3.9,  5.8, 2.25) color rgb 0.36 }

#declare F_Matt = finish { ambient 0.30 diffuse 0.62 }
#declare F_Glow = finish { ambient 1.00 diffuse 0.00 }
#default { finish { F_Matt } }
#macro Plain(R, G, B) texture { pigment { color rgb <R, G, B> } finish { F_Matt } } #end
#declare T_Wall  = Plain(0.74, 0.735, 0.72)
#declare T_Blue  = Plain(0.52, 0.57, 0.61)
#declare T_Door  = Plain(0.30, 0.35, 0.40)
#declare T_Frame = Plain(0.62, 0.60, 0.56)
#declare T_Dark  = Plain(0.085, 0.088, 0.095)
#declare T_Rail  = Plain(0.40, 0.385, 0.355)

// ------------------------------------------------------------------ room ----
// Floor: tiles of 0.4 m
box { W(-5, -1.1, -0.05) W(5, 7.1, 0)
  pigment { checker color rgb <0.50, 0.47, 0.42> color rgb <0.30, 0.29, 0.27> scale 8 translate -100*y } no_shadow }
box { W(-5, -1.1, WZ) W(5, 7.1, WZ+0.05) pigment { color rgb 0.62 } finish { F_Glow } no_shadow }
box { W(-5.1,  7.1, 0) W( 5.1,  7.2, WZ) texture { T_Wall } no_shadow }   // north
box { W(-5.1, -1.2, 0) W( 5.1, -1.1, WZ) texture { T_Wall } no_shadow }   // south
box { W( 5.0, -1.1, 0) W( 5.1,  7.1, WZ) texture { T_Blue } no_shadow }   // east
box { W(-5.1, -1.1, 0) W(-5.0,  7.1, WZ) texture { T_Blue } no_shadow }   // west
box { W(-2.8,  1.1, 0) W( 2.8,  4.9, WZ) texture { T_Wall } no_shadow }   // the block
// A rail along the block, doors in the walls, so that each place has something to see
box { W(-2.83, 1.07, 0.95) W(2.83, 1.10, 1.05) texture { T_Rail } no_shadow }
box { W(-2.83, 4.90, 0.95) W(2.83, 4.93, 1.05) texture { T_Rail } no_shadow }
box { W(-2.83, 1.07, 0.95) W(-2.80, 4.93, 1.05) texture { T_Rail } no_shadow }
box { W( 2.80, 1.07, 0.95) W( 2.83, 4.93, 1.05) texture { T_Rail } no_shadow }
#macro Door(X0, Y0, X1, Y1) box { W(X0, Y0, 0) W(X1, Y1, 2.05) texture { T_Door } no_shadow } #end
Door(-1.2, -1.1, -0.3, -1.085) Door(2.1, -1.1, 3.0, -1.085) Door(4.985, 2.2, 5.0, 3.1)
Door(0.6, 7.085, 1.5, 7.1) Door(-3.4, 7.085, -2.5, 7.1) Door(-5.0, 3.4, -4.985, 4.3) Door(-0.4, 1.085, 0.5, 1.1)
box { W(-4.6, 7.085, 1.0) W(-3.9, 7.1, 1.7) texture { T_Frame } no_shadow }
box { W(4.985, 4.6, 1.0) W(5.0, 5.4, 1.6) texture { T_Frame } no_shadow }

// ----------------------------------------------------------------- pipes ----
#macro Pipe(X, Y, R, G, B)
  cylinder { W(X, Y, 0) W(X, Y, 1.00) 0.06*M pigment { color rgb <R, G, B> } finish { ambient 0.35 diffuse 0.62 } }
  cylinder { W(X, Y, 0) W(X, Y, 0.012) 0.10*M texture { T_Dark } no_shadow }
#end
Pipe(-2.10, -0.90,  0.80, 0.03, 0.03)   // red, south
Pipe( 1.30, -0.90,  0.03, 0.80, 0.03)   // green, south
Pipe( 0.90,  0.88,  0.80, 0.03, 0.80)   // magenta, south
Pipe(-2.50,  0.88,  0.03, 0.03, 0.80)   // blue, south
Pipe( 4.80, -0.70,  0.80, 0.80, 0.03)   // yellow, east
Pipe( 4.80,  3.60,  0.03, 0.80, 0.80)   // cyan, east
Pipe( 3.05,  2.40,  0.80, 0.03, 0.03)   // red, east
Pipe( 4.70,  6.85,  0.80, 0.03, 0.80)   // magenta, north
Pipe( 1.10,  6.88,  0.03, 0.03, 0.80)   // blue, north
Pipe(-1.60,  5.15,  0.80, 0.80, 0.03)   // yellow, north
Pipe(-4.80,  6.60,  0.03, 0.80, 0.03)   // green, west
Pipe(-4.80,  2.40,  0.03, 0.80, 0.80)   // cyan, west

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
// View along the south side. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(-4.6, -0.8, 1.9)
  right <4/3, 0, 0>
  up <0, 1, 0>
  sky <0, 1, 0>
  angle 84
  look_at W(1.0, 0.6, 0.4)
}
