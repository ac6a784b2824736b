// SPDX-License-Identifier: Apache-2.0
//
// hall.pov : an assembly hall with a tall robot among eight high pillars. It is a second room to measure accuracy,
// and differs from lab.pov in all relevant properties: size; number, width and height of the landmarks; mirrors,
// images, image centres, focal lengths and the azimuth of a camera.
//
// SCALE  1 POV-Ray unit = 5 cm; world (x, y, z) metres is POV-Ray <x, z, y> / 0.05, as W() does.
// ROOM   x from -4.0 to 4.0 m, y from -3.5 to 3.5 m, ceiling at 3.40 m.
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.
//
// RULES, as in lab.pov: only the pillars are strongly coloured (all else (max-min)/max <= 0.40 in linear rgb), lights
// are pure white, pillars are matt and end at exactly 1.60 m. The mirrors see objects above 0.86 m. Objects higher than
// 0.80 m stand outside the convex hull of the pillars, hence never between robot and pillar. robots/hall_sim.yaml and
// hall.map.yaml contain the same numbers.

#version 3.7;
#include "parts/robot.inc"
global_settings { assumed_gamma 1.0 max_trace_level 4 }

#declare M = 20;
#macro W(X, Y, Z) <(X)*M, (Z)*M, (Y)*M> #end
#declare HX = 4.0;
#declare HY = 3.5;
#declare HZ = 3.4;

background { color rgb 0.75 }
light_source { W(-1.9,  1.1, 3.20) color rgb 0.58 }
light_source { W( 1.7, -1.3, 3.20) color rgb 0.58 }

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
#declare T_Wood    = Plain(0.52, 0.44, 0.335)
#declare T_Sand    = Plain(0.55, 0.49, 0.40)
#declare T_Moss    = Plain(0.200, 0.230, 0.150)
#declare T_Alu     = Plain(0.56, 0.57, 0.59)

// ------------------------------------------------------------------ hall ----
// Floor: sealed concrete with joints every 2 m, and a taped walkway
box { W(-HX, -HY, -0.05) W(HX, HY, 0)
  texture {
    pigment {
      gradient x
      pigment_map {
        [0.01 color rgb 0.20]
        [0.01 gradient z pigment_map {
          [0.01 color rgb 0.20]
          [0.01 bozo color_map { [0.2 rgb <0.36, 0.355, 0.34>] [0.8 rgb <0.44, 0.435, 0.42>] } scale 0.3] }]
      }
      scale 40 translate <20, 0, 10>
    }
    finish { F_Matt }
  }
  no_shadow
}
#macro Tape(X1, Y1, X2, Y2) box { W(X1, Y1, 0) W(X2, Y2, 0.0012) texture { T_White } no_shadow } #end
Tape(-2.45,  1.92,  2.45,  1.97) Tape(-2.45, -1.97,  2.45, -1.92)
Tape(-2.45, -1.97, -2.40,  1.97) Tape( 2.40, -1.97,  2.45,  1.97)

// Ceiling: trapezoidal sheet, lit by the hall as a whole
box { W(-HX, -HY, HZ) W(HX, HY, HZ+0.05)
  pigment { gradient x color_map { [0.5 rgb 0.62] [0.5 rgb 0.52] } scale 5 } finish { F_Glow } no_shadow }
// Walls: brick to 1.15 m, painted, with a band above
#declare Brick = pigment {
  brick color rgb <0.50, 0.485, 0.46>, color rgb <0.63, 0.615, 0.585> brick_size <5, 1.5, 2.4> mortar 0.14 }
#declare T_Wall = texture {
  pigment {
    gradient y
    pigment_map { [0.338 Brick scale 1/68] [0.338 color rgb <0.74, 0.735, 0.715>] }
    scale 68
  }
  finish { F_Matt }
}
#declare T_WallE = texture {
  pigment {
    gradient y
    pigment_map { [0.338 Brick rotate y*90 scale 1/68] [0.338 color rgb <0.60, 0.635, 0.66>] }
    scale 68
  }
  finish { F_Matt }
}
box { W(-HX-0.1,  HY,     0) W( HX+0.1,  HY+0.1, HZ) texture { T_Wall }  no_shadow }   // north
box { W(-HX-0.1, -HY-0.1, 0) W( HX+0.1, -HY,     HZ) texture { T_Wall }  no_shadow }   // south
box { W( HX,     -HY,     0) W( HX+0.1,  HY,     HZ) texture { T_WallE } no_shadow }   // east
box { W(-HX-0.1, -HY,     0) W(-HX,      HY,     HZ) texture { T_WallE } no_shadow }   // west
// A rail of timber round the walls against trolleys, and a cable tray high up on two of them
box { W(-HX, HY-0.03, 0.30) W(HX, HY, 0.42)   texture { T_Wood } no_shadow }
box { W(-HX, -HY, 0.30) W(HX, -HY+0.03, 0.42) texture { T_Wood } no_shadow }
box { W(-HX, HY-0.12, 2.62) W(HX, HY, 2.70)   texture { T_SteelDk } no_shadow }
box { W(-HX, -HY, 2.62) W(-HX+0.12, HY, 2.70) texture { T_SteelDk } no_shadow }

// Strip lamps under the ceiling
#macro Lamp(X, Y)
  box { W(X-0.85, Y-0.12, HZ-0.06) W(X+0.85, Y+0.12, HZ) texture { T_Pale } no_shadow }
  box { W(X-0.82, Y-0.09, HZ-0.065) W(X+0.82, Y+0.09, HZ-0.06) pigment { color rgb 0.95 } finish { F_Glow } no_shadow }
#end
Lamp(-1.9, 1.1) Lamp(1.7, -1.3) Lamp(1.9, 1.2) Lamp(-1.8, -1.3)

// --------------------------------------------------------------- pillars ----
#ifndef (Landmarks_Elsewhere)   // Hues are 45 degrees apart.
#macro Pillar(X, Y, R, G, B)
  cylinder { W(X, Y, 0) W(X, Y, 1.60) 0.20*M
    pigment { color rgb <R, G, B> } finish { ambient 0.35 diffuse 0.62 } }
  cylinder { W(X, Y, 0) W(X, Y, 0.02) 0.27*M texture { T_Dark } no_shadow }
#end
Pillar( 3.30,  0.45,  0.80,  0.03,   0.03)     // red
Pillar( 2.75,  2.60,  0.80,  0.6075, 0.03)     // amber
Pillar( 0.20,  2.82,  0.415, 0.80,   0.03)     // lime
Pillar(-2.55,  2.70,  0.03,  0.80,   0.2225)   // green
Pillar(-3.35,  0.15,  0.03,  0.80,   0.80)     // cyan
Pillar(-2.85, -2.45,  0.03,  0.2225, 0.80)     // blue
Pillar(-0.35, -2.85,  0.415, 0.03,   0.80)     // violet
Pillar( 2.40, -2.65,  0.80,  0.03,   0.6075)   // rose
#end
// ------------------------------------------------------------- furniture ----
// A pallet rack along a wall: posts, three levels, goods on them; from (X1, Y1) to (X2, Y2), 2.2 m high
#declare Rnd = seed(23);
#macro Rack(X1, Y1, X2, Y2)
  box { W(X1, Y1, 0) W(X1+0.05, Y1+0.05, 2.2) texture { T_Steel } }
  box { W(X2-0.05, Y1, 0) W(X2, Y1+0.05, 2.2) texture { T_Steel } }
  box { W(X1, Y2-0.05, 0) W(X1+0.05, Y2, 2.2) texture { T_Steel } }
  box { W(X2-0.05, Y2-0.05, 0) W(X2, Y2, 2.2) texture { T_Steel } }
  #local I = 0;
  #while (I < 3)
    box { W(X1, Y1, 0.30+0.66*I) W(X2, Y2, 0.36+0.66*I) texture { T_SteelDk } }
    #local Along = 0.07;
    #while (Along < (X2-X1 > Y2-Y1 ? X2-X1 : Y2-Y1) - 0.40)
      #local Wide = 0.20 + 0.14*rand(Rnd);
      #local High = 0.22 + 0.28*rand(Rnd);
      #local Tone = 0.16 + 0.46*rand(Rnd);
      #local Warm = 0.30*(rand(Rnd) - 0.3);
      #if (X2-X1 > Y2-Y1)
        box { W(X1+Along, Y1+0.04, 0.36+0.66*I) W(X1+Along+Wide, Y2-0.04, 0.36+0.66*I+High)
          pigment { color rgb Tone*<1, 1-0.5*Warm, 1-Warm> } no_shadow }
      #else
        box { W(X1+0.04, Y1+Along, 0.36+0.66*I) W(X2-0.04, Y1+Along+Wide, 0.36+0.66*I+High)
          pigment { color rgb Tone*<1, 1-0.5*Warm, 1-Warm> } no_shadow }
      #end
      #local Along = Along + Wide + 0.03 + 0.12*rand(Rnd);
    #end
    #local I = I + 1;
  #end
#end
Rack(-1.95, 3.06, -0.35, 3.48)         // north
Rack( 3.57, -2.40, 3.98, -0.55)        // east

// Roller shutter in the north wall, with its box and a yard lamp's switch
box { W(0.75, 3.46, 0) W(2.35, 3.5, 2.30)
  pigment { gradient y color_map { [0.12 rgb 0.22] [0.12 rgb <0.42, 0.44, 0.46>] [1 rgb <0.50, 0.52, 0.54>] } scale 1.7 }
  no_shadow }
box { W(0.65, 3.30, 2.30) W(2.45, 3.5, 2.58) texture { T_Steel } no_shadow }
box { W(2.55, 3.47, 1.15) W(2.67, 3.5, 1.35) texture { T_Grey } no_shadow }

// A band of windows in the south wall and one in the west: sky over roofs, frames
#declare Sky = pigment {
  gradient y
  color_map {
    [0.00 rgb <0.30, 0.32, 0.31>] [0.22 rgb <0.36, 0.38, 0.37>]
    [0.22 rgb <0.72, 0.78, 0.84>] [1.00 rgb <0.60, 0.71, 0.82>]
  }
  scale <1, 22, 1> translate 28*y
}
#macro WindowS(X1, X2)
  box { W(X1-0.06, -HY, 1.34) W(X2+0.06, -HY+0.02, 2.56) texture { T_White } no_shadow }
  box { W(X1, -HY, 1.40) W(X2, -HY+0.022, 2.50) pigment { Sky } finish { F_Glow } no_shadow }
  box { W((X1+X2)/2-0.02, -HY, 1.40) W((X1+X2)/2+0.02, -HY+0.04, 2.50) texture { T_White } no_shadow }
  box { W(X1, -HY, 1.93) W(X2, -HY+0.04, 1.97) texture { T_White } no_shadow }
#end
WindowS(-3.65, -2.45) WindowS(-1.55, -0.35) WindowS(0.55, 1.75)
#macro WindowW(Y1, Y2)
  box { W(-HX, Y1-0.06, 1.34) W(-HX+0.02, Y2+0.06, 2.56) texture { T_White } no_shadow }
  box { W(-HX, Y1, 1.40) W(-HX+0.022, Y2, 2.50) pigment { Sky } finish { F_Glow } no_shadow }
  box { W(-HX, (Y1+Y2)/2-0.02, 1.40) W(-HX+0.04, (Y1+Y2)/2+0.02, 2.50) texture { T_White } no_shadow }
#end
WindowW(0.75, 1.95) WindowW(-1.95, -0.75)

// Double door in the south-east, and a sign beside it
box { W(2.75, -HY, 0) W(3.95, -HY+0.03, 2.20) texture { T_White } no_shadow }
box { W(2.82, -HY, 0) W(3.34, -HY+0.035, 2.13) texture { T_Steel } no_shadow }
box { W(3.36, -HY, 0) W(3.88, -HY+0.035, 2.13) texture { T_Steel } no_shadow }
box { W(2.95, -HY, 1.20) W(3.21, -HY+0.038, 1.90) pigment { color rgb <0.38, 0.42, 0.45> } finish { F_Glow } no_shadow }
box { W(3.49, -HY, 1.20) W(3.75, -HY+0.038, 1.90) pigment { color rgb <0.38, 0.42, 0.45> } finish { F_Glow } no_shadow }
box { W(2.05, -HY, 1.45) W(2.50, -HY+0.01, 2.05)
  pigment { bozo color_map { [0.35 rgb <0.26, 0.28, 0.30>] [0.65 rgb <0.66, 0.64, 0.60>] } scale 2.5 } no_shadow }

// Workbench along the south wall: timber top, vice, grinder, drawers
box { W(-2.30, -3.48, 0.86) W(-0.75, -3.08, 0.92) texture { T_Wood } }
box { W(-2.27, -3.46, 0.10) W(-1.75, -3.10, 0.86) texture { T_Steel } }
box { W(-1.30, -3.46, 0.10) W(-0.78, -3.10, 0.86) texture { T_Steel } }
box { W(-2.10, -3.30, 0.92) W(-1.95, -3.12, 1.08) texture { T_SteelDk } }
cylinder { W(-1.10, -3.42, 1.05) W(-1.10, -3.16, 1.05) 0.10*M texture { T_Dark } }
cylinder { W(-1.36, -3.29, 1.05) W(-0.84, -3.29, 1.05) 0.05*M texture { T_Grey } }

// Lathe along the west wall
box { W(-3.98, -1.80, 0.00) W(-3.62, -0.60, 0.70) texture { T_Moss } }
box { W(-3.98, -1.80, 0.70) W(-3.60, -1.35, 1.32) texture { T_Moss } }
cylinder { W(-3.80, -1.35, 1.08) W(-3.80, -1.22, 1.08) 0.11*M texture { T_Alu } }
box { W(-3.94, -1.35, 0.86) W(-3.66, -0.60, 0.94) texture { T_Alu } }
box { W(-3.92, -0.82, 0.94) W(-3.70, -0.62, 1.18) texture { T_Moss } }
// Lockers beyond it
#declare I = 0;
#while (I < 4)
  box { W(-3.98, 0.78+0.34*I, 0.08) W(-3.60, 1.11+0.34*I, 1.28) texture { T_Steel } }
  box { W(-3.60, 0.81+0.34*I, 0.12) W(-3.592, 1.08+0.34*I, 1.24) texture { T_Pale } no_shadow }
  box { W(-3.592, 1.03+0.34*I, 0.62) W(-3.58, 1.06+0.34*I, 0.76) texture { T_Dark } no_shadow }
  #declare I = I + 1;
#end

// East wall: switch cabinet, a clock, pipes
box { W(3.70, 1.10, 0.10) W(3.98, 1.90, 2.00) texture { T_Pale } }
box { W(3.69, 1.13, 0.14) W(3.70, 1.49, 1.96) texture { T_Alu } no_shadow }
box { W(3.69, 1.51, 0.14) W(3.70, 1.87, 1.96) texture { T_Alu } no_shadow }
box { W(3.68, 1.20, 1.40) W(3.69, 1.42, 1.62) texture { T_Dark } no_shadow }
union {
  cylinder { W(3.99, 0.55, 2.20) W(3.95, 0.55, 2.20) 0.19*M texture { T_Dark } }
  cylinder { W(3.99, 0.55, 2.20) W(3.945, 0.55, 2.20) 0.17*M texture { T_White } }
  box { <0, -0.3, -0.12> <0.05, 2.0, 0.12> rotate x*50 translate W(3.943, 0.55, 2.20) texture { T_Dark } }
  box { <0, -0.3, -0.09> <0.05, 2.9, 0.09> rotate -x*75 translate W(3.943, 0.55, 2.20) texture { T_Dark } }
  no_shadow
}
cylinder { W(3.93, 2.30, 0) W(3.93, 2.30, HZ) 0.04*M texture { T_Alu } no_shadow }
cylinder { W(3.93, 2.45, 0) W(3.93, 2.45, HZ) 0.04*M texture { T_Grey } no_shadow }

// A ladder against the north wall, crates in the corners
#macro LadderPost(X) cylinder { W(X, 3.12, 0) W(X, 3.46, 2.45) 0.018*M texture { T_Alu } } #end
LadderPost(-3.60) LadderPost(-3.20)
#declare I = 1;
#while (I < 9)
  cylinder { W(-3.60, 3.12+0.34*I/9, 2.45*I/9) W(-3.20, 3.12+0.34*I/9, 2.45*I/9) 0.014*M texture { T_Alu } no_shadow }
  #declare I = I + 1;
#end
box { W(3.30, 3.04, 0) W(3.95, 3.46, 0.55) texture { T_Card } }
box { W(3.36, 3.08, 0.55) W(3.86, 3.46, 1.05) texture { T_Sand } }
box { W(-3.95, -3.45, 0) W(-3.35, -3.02, 0.62) texture { T_Card } }
box { W(-3.90, -3.42, 0.62) W(-3.50, -3.05, 1.02) texture { T_Wood } }

// In the arena, low: a pallet and a cable drum
#declare I = 0;
#while (I < 5)
  box { W(-1.75+0.26*I, 0.55, 0.12) W(-1.59+0.26*I, 1.35, 0.145) texture { T_Wood } }
  #declare I = I + 1;
#end
box { W(-1.75, 0.57, 0) W(-0.55, 0.67, 0.12) texture { T_Sand } }
box { W(-1.75, 0.90, 0) W(-0.55, 1.00, 0.12) texture { T_Sand } }
box { W(-1.75, 1.23, 0) W(-0.55, 1.33, 0.12) texture { T_Sand } }
cylinder { W(1.25, -0.85, 0.00) W(1.25, -0.85, 0.05) 0.36*M texture { T_Wood } }
cylinder { W(1.25, -0.85, 0.05) W(1.25, -0.85, 0.45) 0.22*M texture { T_Dark } }
cylinder { W(1.25, -0.85, 0.45) W(1.25, -0.85, 0.50) 0.36*M texture { T_Wood } }

// ------------------------------------------------------------------ robot ----
// Heights of the head, in metres above the floor, all on the robot's axis:
//   0.70 lower lens    0.86 lower tip    0.95 lower rim, 0.09 in radius
//   1.15 upper lens    1.31 upper tip    1.40 upper rim, 0.09 in radius
// A mirror sees elevations from level up to 19.8 degrees. Of the robot it sees only the mast, 0.20 m behind, no arms.
union {
  //*PMName robot
  object { Robot_Body scale 1.35 }                       // 0.27 m in radius, wheels 0.0675 m, 0.405 m apart
  box { Robot_Up(0.24)-<0.4, 0, 0.4> Robot_Up(0.605)+<0.4, 0, 0.4> texture { Robot_Alu } }
  box { <-1.8, 6.0, -1.5> <1.8, 6.2, 1.5> texture { Robot_Deck } }
  box { <-1.4, 6.2, -1.1> <-0.5, 7.6, 1.1> texture { Robot_Dark } }
  object { Robot_Camera translate Robot_Up(0.699) }
  object { Robot_Cone(0.09, 90) translate Robot_Up(0.86) }
  cylinder { Robot_Up(0.9515) Robot_Up(0.96) 1.88 texture { Robot_Dark } }           // a dark edge round the mirror, just
  cylinder { Robot_Up(1.4015) Robot_Up(1.41) 1.88 texture { Robot_Dark } }           // above what its rim sees
  cylinder { Robot_Up(0.96) Robot_Up(1.055) 0.18 texture { Robot_Alu } }
  object { Robot_Camera translate Robot_Up(1.149) }
  object { Robot_Cone(0.09, 90) translate Robot_Up(1.31) }
  cylinder { Robot_Up(1.41) Robot_Up(1.48) 0.16 texture { Robot_Alu } }
  cylinder { <-4, 4.8, 0> <-4, 29.8, 0> 0.10 texture { Robot_Alu } }                  // mast
  cylinder { <-4, 20.6, 0> <0, 20.6, 0> 0.12 texture { Robot_Alu } }                  // its arms
  cylinder { <-4, 29.5, 0> <0, 29.5, 0> 0.12 texture { Robot_Alu } }
  cylinder { <-4, 20.4, 0> <-4, 20.8, 0> 0.20 texture { Robot_Dark } }
  bounded_by { box { <-5.45, -0.01, -5.45> <5.45, 29.9, 5.45> } }
}

// ---------------------------------------------------------------- cameras ----
// An image 600 pixels high has a focal length of 600 times the vertical part of `direction`: 804 and 792 pixels. Times
// 0.09/0.25 this is the rim's radius, 289.44 and 285.12. The horizontal part of `direction` moves the axis from the
// image's middle (399.5, 299.5) by -600 times its length: to (402.8, 297.4) and (396.8, 303.4).
camera {
  //*PMName lower
  perspective
  direction <-0.0055, 1.34, 0.0035>  up <0, 0, -1>  right <4/3, 0, 0>
  translate Robot_Up(0.70)
}
// This camera is rotated by 1.2 rad, counter-clockwise seen from above
camera {
  //*PMName upper
  perspective
  direction <0.0045, 1.32, -0.0065>  up <0, 0, -1>  right <4/3, 0, 0>
  rotate -y*degrees(1.2)
  translate Robot_Up(1.15)
}
// View from the north-east of the walkway. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(2.35, 1.75, 1.75)
  right <4/3, 0, 0>
  up <0, 1, 0>
  sky <0, 1, 0>
  angle 84
  look_at W(-0.65, -0.55, 0.62)
}
