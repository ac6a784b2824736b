// SPDX-License-Identifier: Apache-2.0
//
// workshop.pov : a small workshop with a small robot among five posts of different widths and heights. It is a third
// room to measure accuracy: small mirrors, thin landmarks, one mirrored image, both images rotated and not centred.
//
// SCALE  1 POV-Ray unit = 5 cm; world (x, y, z) metres is POV-Ray <x, z, y> / 0.05, as W() does.
// ROOM   x from -2.25 to 2.25 m, y from -1.75 to 1.75 m, ceiling at 2.30 m.
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.
//
// RULES, as in lab.pov: only the posts are strongly coloured (all else (max-min)/max <= 0.40 in linear rgb), lights are
// pure white, posts are matt and end at exactly the height in the map. The mirrors see objects above 0.27 m. Objects
// higher than 0.22 m stand outside the convex hull of the posts, hence never between robot and post.
// robots/workshop_sim.yaml and workshop.map.yaml contain the same numbers.

#version 3.7;
#include "parts/robot.inc"
global_settings { assumed_gamma 1.0 max_trace_level 4 }

#declare M = 20;
#macro W(X, Y, Z) <(X)*M, (Z)*M, (Y)*M> #end
#declare WX = 2.25;
#declare WY = 1.75;
#declare WZ = 2.30;

background { color rgb 0.75 }
light_source { W(-0.8,  0.4, 2.12) color rgb 0.56 }
light_source { W( 0.9, -0.5, 2.12) color rgb 0.56 }

#declare F_Matt = finish { ambient 0.30 diffuse 0.62 }
#declare F_Glow = finish { ambient 1.00 diffuse 0.00 }
#default { finish { F_Matt } }
#macro Plain(R, G, B) texture { pigment { color rgb <R, G, B> } finish { F_Matt } } #end

#declare T_White   = Plain(0.80, 0.80, 0.79)
#declare T_Pale    = Plain(0.58, 0.58, 0.57)
#declare T_Grey    = Plain(0.34, 0.34, 0.35)
#declare T_Dark    = Plain(0.085, 0.088, 0.095)
#declare T_Steel   = Plain(0.29, 0.335, 0.38)
#declare T_SteelDk = Plain(0.150, 0.175, 0.205)
#declare T_Card    = Plain(0.45, 0.375, 0.29)
#declare T_Sand    = Plain(0.55, 0.49, 0.40)
#declare T_Moss    = Plain(0.200, 0.230, 0.150)
#declare T_Alu     = Plain(0.56, 0.57, 0.59)
#declare T_Pine    = texture {
  pigment {
    wood turbulence 0.05
    color_map { [0 rgb <0.60, 0.51, 0.395>] [1 rgb <0.51, 0.425, 0.325>] }
    rotate y*87 rotate x*2 scale 0.5
  }
  finish { F_Matt }
}

// ------------------------------------------------------------------ room ----
// Floor: boards 0.15 m wide
box { W(-WX, -WY, -0.05) W(WX, WY, 0)
  texture {
    pigment {
      brick
      pigment { color rgb <0.20, 0.175, 0.145> }
      pigment {
        cells
        color_map { [0 rgb <0.34, 0.295, 0.235>] [1 rgb <0.46, 0.405, 0.33>] }
        scale <13, 3, 300> translate -90*z
      }
      brick_size <26, 3, 300> mortar 0.06
      rotate x*90 translate <0, 90, 0>
    }
    finish { F_Matt }
  }
  no_shadow
}
box { W(-WX, -WY, WZ) W(WX, WY, WZ+0.05)
  pigment { gradient z color_map { [0.04 rgb 0.45] [0.04 rgb 0.64] } scale 9 } finish { F_Glow } no_shadow }
// Walls: tongue and groove to 1.1 m, plaster above
#declare Boards = pigment { gradient x color_map { [0.05 rgb <0.36, 0.35, 0.33>] [0.05 rgb <0.62, 0.60, 0.565>] } scale 2.2 }
#declare T_WallX = texture {
  pigment {
    gradient y
    pigment_map { [0.4783 Boards scale 1/46] [0.4783 color rgb <0.76, 0.755, 0.74>] }
    scale 46
  }
  finish { F_Matt }
}
#declare T_WallY = texture {
  pigment {
    gradient y
    pigment_map { [0.4783 Boards rotate y*90 scale 1/46] [0.4783 color rgb <0.67, 0.69, 0.70>] }
    scale 46
  }
  finish { F_Matt }
}
box { W(-WX-0.1,  WY,     0) W( WX+0.1,  WY+0.1, WZ) texture { T_WallX } no_shadow }   // north
box { W(-WX-0.1, -WY-0.1, 0) W( WX+0.1, -WY,     WZ) texture { T_WallX } no_shadow }   // south
box { W( WX,     -WY,     0) W( WX+0.1,  WY,     WZ) texture { T_WallY } no_shadow }   // east
box { W(-WX-0.1, -WY,     0) W(-WX,      WY,     WZ) texture { T_WallY } no_shadow }   // west
#macro Lamp(X, Y)
  box { W(X-0.50, Y-0.08, WZ-0.05) W(X+0.50, Y+0.08, WZ) texture { T_Pale } no_shadow }
  box { W(X-0.48, Y-0.06, WZ-0.055) W(X+0.48, Y+0.06, WZ-0.05) pigment { color rgb 0.95 } finish { F_Glow } no_shadow }
#end
Lamp(-0.8, 0.4) Lamp(0.9, -0.5)

// ----------------------------------------------------------------- posts ----
#ifndef (Landmarks_Elsewhere)   // Hues are 72 degrees apart. Radius and height in metres.
#macro Post(X, Y, Radius, Top, R, G, B)
  cylinder { W(X, Y, 0) W(X, Y, Top) (Radius)*M pigment { color rgb <R, G, B> } finish { ambient 0.35 diffuse 0.62 } }
  cylinder { W(X, Y, 0) W(X, Y, 0.012) (Radius+0.03)*M texture { T_Dark } no_shadow }
#end
Post( 1.70,  0.35, 0.045, 0.66,  0.80,   0.158,  0.03)     // red
Post( 0.75,  1.22, 0.080, 0.60,  0.5177, 0.80,   0.03)     // lime
Post(-1.10,  1.18, 0.055, 0.64,  0.03,   0.80,   0.4663)   // jade
Post(-1.68, -0.50, 0.030, 0.72,  0.03,   0.2097, 0.80)     // blue
Post( 0.30, -1.25, 0.070, 0.58,  0.7743, 0.03,   0.80)     // magenta
#end
// ------------------------------------------------------------- furniture ----
// Workbench along the north wall, drawers under it, a board of tools above
box { W(-0.85, 1.37, 0.84) W(1.75, 1.75, 0.90) texture { T_Pine } }
box { W(-0.82, 1.40, 0.05) W(-0.30, 1.73, 0.84) texture { T_Steel } }
box { W(1.20, 1.40, 0.05) W(1.72, 1.73, 0.84) texture { T_Steel } }
#declare I = 0;
#while (I < 4)
  box { W(-0.80, 1.39, 0.08+0.19*I) W(-0.32, 1.40, 0.25+0.19*I) texture { T_Pale } no_shadow }
  box { W(-0.62, 1.38, 0.18+0.19*I) W(-0.50, 1.39, 0.20+0.19*I) texture { T_Dark } no_shadow }
  box { W(1.22, 1.39, 0.08+0.19*I) W(1.70, 1.40, 0.25+0.19*I) texture { T_Pale } no_shadow }
  box { W(1.40, 1.38, 0.18+0.19*I) W(1.52, 1.39, 0.20+0.19*I) texture { T_Dark } no_shadow }
  #declare I = I + 1;
#end
box { W(-0.25, 1.70, 0.10) W(1.15, 1.73, 0.80) texture { T_Sand } no_shadow }
box { W(0.05, 1.45, 0.05) W(0.50, 1.70, 0.40) texture { T_Card } }
box { W(0.60, 1.46, 0.05) W(0.95, 1.70, 0.55) texture { T_Grey } }
box { W(-0.30, 1.735, 1.10) W(1.50, 1.75, 1.75)
  pigment { boxed color_map { [0.10 rgb 0.20] [0.10 rgb <0.56, 0.50, 0.42>] } scale 0.5 warp { repeat x*1 } warp { repeat y*1 } }
  no_shadow }
#declare Rnd = seed(7);
#declare I = 0;
#while (I < 11)
  box { W(-0.20+0.15*I, 1.715, 1.20+0.10*rand(Rnd)) W(-0.15+0.15*I+0.03*rand(Rnd), 1.735, 1.55+0.12*rand(Rnd))
    pigment { color rgb (0.10 + 0.35*rand(Rnd))*<1, 1, 1.05> } no_shadow }
  #declare I = I + 1;
#end
union {                                                                      // vice
  box { W(-0.62, 1.40, 0.90) W(-0.46, 1.56, 0.97) texture { T_SteelDk } }
  box { W(-0.62, 1.36, 0.97) W(-0.46, 1.42, 1.05) texture { T_SteelDk } }
  box { W(-0.62, 1.47, 0.97) W(-0.46, 1.53, 1.05) texture { T_SteelDk } }
  cylinder { W(-0.54, 1.30, 1.00) W(-0.54, 1.42, 1.00) 0.015*M texture { T_Alu } }
}
// Pillar drill on it
cylinder { W(1.45, 1.60, 0.90) W(1.45, 1.60, 1.65) 0.03*M texture { T_Alu } }
box { W(1.33, 1.46, 0.90) W(1.57, 1.70, 0.94) texture { T_SteelDk } }
box { W(1.35, 1.42, 1.42) W(1.55, 1.70, 1.68) texture { T_Moss } }
cylinder { W(1.45, 1.48, 1.20) W(1.45, 1.48, 1.42) 0.025*M texture { T_Grey } }

// Timber store on the west wall: boards standing and lying
#declare I = 0;
#while (I < 7)
  box { W(-2.24, 0.30+0.11*I, 0) W(-2.12-0.02*mod(I, 3), 0.39+0.11*I, 1.25+0.35*rand(Rnd)) texture { T_Pine translate I*9*z } }
  #declare I = I + 1;
#end
box { W(-2.25, -1.39, 0.50) W(-1.90, 0.04, 0.53) texture { T_Pine } }
box { W(-2.25, -1.39, 0.90) W(-1.90, 0.04, 0.93) texture { T_Pine } }
box { W(-2.25, -1.39, 1.30) W(-1.90, 0.04, 1.33) texture { T_Pine } }
box { W(-2.22, -1.40, 0) W(-1.93, -1.37, 1.33) texture { T_White } }
box { W(-2.22, 0.02, 0) W(-1.93, 0.05, 1.33) texture { T_White } }
#declare I = 0;
#while (I < 3)
  #declare Along = 0.05;
  #while (Along < 1.15)
    #declare Wide = 0.10 + 0.13*rand(Rnd);
    #declare Tone = 0.14 + 0.45*rand(Rnd);
    #declare Warm = 0.30*(rand(Rnd) - 0.3);
    box { W(-2.22, -1.37+Along, 0.13+0.40*I) W(-1.93, -1.37+Along+Wide, 0.13+0.40*I+0.14+0.16*rand(Rnd))
      pigment { color rgb Tone*<1, 1-0.5*Warm, 1-Warm> } no_shadow }
    #declare Along = Along + Wide + 0.02 + 0.05*rand(Rnd);
  #end
  #declare I = I + 1;
#end
box { W(-2.25, -1.39, 0.10) W(-1.90, 0.04, 0.13) texture { T_Pine } }

// South wall: a bandsaw, a window, a low chest and a stove
box { W(-1.35, -1.72, 0) W(-0.90, -1.42, 0.62) texture { T_Moss } }
box { W(-1.40, -1.74, 0.62) W(-0.85, -1.38, 0.66) texture { T_Alu } }
box { W(-1.35, -1.72, 0.66) W(-1.22, -1.46, 1.15) texture { T_Moss } }
box { W(-1.35, -1.72, 1.05) W(-0.88, -1.46, 1.48) texture { T_Moss } }
cylinder { W(-1.05, -1.46, 1.26) W(-1.05, -1.445, 1.26) 0.16*M texture { T_Grey } no_shadow }
#declare Sky = pigment {
  gradient y
  color_map {
    [0.00 rgb <0.24, 0.27, 0.21>] [0.30 rgb <0.33, 0.36, 0.29>]
    [0.30 rgb <0.72, 0.78, 0.84>] [1.00 rgb <0.60, 0.71, 0.82>]
  }
  scale <1, 20, 1> translate 19*y
}
box { W(-0.60, -WY, 0.89) W(1.00, -WY+0.02, 1.96) texture { T_White } no_shadow }
box { W(-0.54, -WY, 0.95) W(0.94, -WY+0.022, 1.90) pigment { Sky } finish { F_Glow } no_shadow }
box { W(0.18, -WY, 0.95) W(0.22, -WY+0.04, 1.90) texture { T_White } no_shadow }
box { W(-0.64, -WY, 0.86) W(1.04, -WY+0.10, 0.89) texture { T_White } }
box { W(0.55, -1.72, 0.04) W(1.05, -1.40, 0.50) texture { T_Sand } }
box { W(0.53, -1.73, 0.50) W(1.07, -1.38, 0.53) texture { T_Pine } }
cylinder { W(1.45, -1.52, 0.10) W(1.45, -1.52, 0.80) 0.17*M texture { T_SteelDk } }
cylinder { W(1.45, -1.52, 0.80) W(1.45, -1.52, WZ) 0.06*M texture { T_Grey } no_shadow }
box { W(1.36, -1.355, 0.30) W(1.54, -1.345, 0.50) texture { T_Dark } no_shadow }

// East wall: door, a coat on its hook, shelves with tins
box { W(WX-0.03, -1.35, 0) W(WX, -0.45, 2.05) texture { T_White } no_shadow }
box { W(WX-0.035, -1.29, 0) W(WX, -0.51, 1.99) texture { T_Steel } no_shadow }
box { W(WX-0.04, -1.10, 1.10) W(WX, -0.70, 1.80) pigment { color rgb <0.40, 0.44, 0.47> } finish { F_Glow } no_shadow }
cylinder { W(WX-0.08, -1.24, 1.02) W(WX-0.08, -1.12, 1.02) 0.011*M texture { T_Alu } no_shadow }
cone { W(WX-0.06, -0.22, 0.75) 0.13*M W(WX-0.04, -0.22, 1.55) 0.05*M texture { T_SteelDk } }
box { W(1.99, 0.56, 0.42) W(2.25, 1.59, 0.445) texture { T_Pine } }
box { W(1.99, 0.56, 0.82) W(2.25, 1.59, 0.845) texture { T_Pine } }
box { W(1.99, 0.56, 1.22) W(2.25, 1.59, 1.245) texture { T_Pine } }
box { W(1.98, 0.55, 0) W(2.25, 0.575, 1.245) texture { T_White } }
box { W(1.98, 1.575, 0) W(2.25, 1.60, 1.245) texture { T_White } }
#declare I = 0;
#while (I < 3)
  #declare J = 0;
  #while (J < 6)
    #declare Tone = 0.15 + 0.45*rand(Rnd);
    #declare Warm = 0.30*(rand(Rnd) - 0.4);
    cylinder { W(2.10, 0.68+0.155*J, 0.445+0.40*I) W(2.10, 0.68+0.155*J, 0.445+0.40*I+0.10+0.15*rand(Rnd)) (0.045+0.02*rand(Rnd))*M
      pigment { color rgb Tone*<1-0.3*Warm, 1, 1-Warm> } no_shadow }
    #declare J = J + 1;
  #end
  #declare I = I + 1;
#end

// In the arena, low: a toolbox and a coil of hose
box { W(-0.62, 0.28, 0.00) W(-0.30, 0.46, 0.15) texture { T_Steel } }
box { W(-0.63, 0.27, 0.15) W(-0.29, 0.47, 0.17) texture { T_SteelDk } }
cylinder { W(-0.55, 0.37, 0.20) W(-0.37, 0.37, 0.20) 0.012*M texture { T_Dark } }
torus { 0.11*M, 0.03*M translate W(0.62, -0.45, 0.03) texture { T_Moss } }
torus { 0.105*M, 0.03*M translate W(0.62, -0.45, 0.08) texture { T_Moss } }

// ------------------------------------------------------------------ robot ----
// Heights of the head, in metres above the floor, all on the robot's axis:
//   0.20 lower lens    0.27 lower tip    0.31 lower rim, 0.04 in radius
//   0.42 upper lens    0.49 upper tip    0.53 upper rim, 0.04 in radius
// A mirror sees elevations from level up to 20.0 degrees. Of the robot it sees only the mast, 0.10 m from the axis at a
// bearing of 2.5 rad, not its arms.
union {
  //*PMName robot
  object { Robot_Body scale 0.7 }                        // 0.14 m in radius, wheels 0.035 m, 0.21 m apart
  object { Robot_Camera scale <0.8, 0.9, 0.8> translate Robot_Up(0.199) }
  object { Robot_Cone(0.04, 90) translate Robot_Up(0.27) }
  object { Robot_Camera scale <0.8, 0.9, 0.8> translate Robot_Up(0.419) }
  object { Robot_Cone(0.04, 90) translate Robot_Up(0.49) }
  cylinder { Robot_Up(0.54) Robot_Up(0.585) 0.10 texture { Robot_Alu } }
  union {
    cylinder { <2, 2.5, 0> <2, 11.8, 0> 0.06 texture { Robot_Alu } }                  // mast
    cylinder { <2, 7.3, 0> <0, 7.3, 0> 0.07 texture { Robot_Alu } }                   // its arms
    cylinder { <2, 11.6, 0> <0, 11.6, 0> 0.07 texture { Robot_Alu } }
    rotate -y*degrees(2.5)
  }
  bounded_by { box { <-2.85, -0.01, -2.85> <2.85, 11.9, 2.85> } }
}

// ---------------------------------------------------------------- cameras ----
// The focal length is 480 times the vertical part of `direction`: 633.6 and 607.2 pixels. Times 0.04/0.11 this is the
// rim's radius, 230.4 and 220.8. The horizontal part moves the axis from the image's middle (319.5, 239.5).
// The image of this camera is mirrored, against the bearing. Its x axis points along -0.8 rad; axis at (316.5, 242.9).
camera {
  //*PMName lower
  perspective
  direction <0.00625, 1.32, 0.0070833333333333333>  up <0, 0, 1>  right <4/3, 0, 0>
  rotate y*degrees(0.8)
  translate Robot_Up(0.20)
}
// This camera is rotated by 2.1 rad, counter-clockwise seen from above; axis at (325.74, 238.3)
camera {
  //*PMName upper
  perspective
  direction <-0.013, 1.265, 0.0025>  up <0, 0, -1>  right <4/3, 0, 0>
  rotate -y*degrees(2.1)
  translate Robot_Up(0.42)
}
// View from the door. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(1.95, -1.10, 1.55)
  right <4/3, 0, 0>
  up <0, 1, 0>
  sky <0, 1, 0>
  angle 84
  look_at W(-0.50, 0.30, 0.50)
}
