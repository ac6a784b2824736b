// SPDX-License-Identifier: Apache-2.0
//
// lab.pov : a robotics laboratory, after Burbridge & Spacek (2006).
//
// A round robot stands among six coloured pillars. It sees all round itself
// with two upright 90-degree cone mirrors, tips down, one above the other,
// each above a camera that looks straight up.
//
// SCALE  1 POV-Ray unit = 5 cm.
// AXES   POV-Ray is left-handed with y up. The world of the robot is
//        right-handed: x forward, y left, z up, in metres. World (x, y, z)
//        is POV-Ray <x, z, y> / 0.05; the macro W() below converts it.
// ROOM   x from -3.05 to 3.05 m, y from -2.55 to 2.55 m, ceiling at 2.60 m.
// NAMES  A program moves the robot and takes the images. It finds these
//        top-level blocks by the comment on the first line inside the braces:
//          robot    the robot, standing at the world's origin, heading along x
//          lower    camera under the lower mirror, lens at 0.25 m
//          upper    camera under the upper mirror, lens at 0.55 m
//          outside  a view of the whole lab; as the last one, it is the default
//        Keep them at top level, and keep braces out of comments.
//
// RULES that the robot's vision depends on; please keep them when editing:
//  1. Only the six pillars are strongly coloured. Every other pigment has
//     (max-min)/max <= 0.40 in linear rgb, and the lights are pure white, so
//     hue and saturation alone distinguish a pillar from its surroundings.
//  2. Pillars are matt and end at exactly 0.90 m: that edge is measured.
//  3. Furniture over 0.60 m stands against a wall and beside, never between,
//     the lines of sight from the arena (|x| <= 2.2, |y| <= 1.7) to a pillar.
//  4. Rendering is cheap: thousands of frames are made. Two point lights; no
//     transparency, area lights or radiosity; only the mirrors reflect. The
//     furniture is made of many separate objects rather than of large unions,
//     because POV-Ray bounds those better (the robot has to be one union, so its
//     base has a bound of its own). Flat things on a wall cast no shadow.
// After moving furniture, correct lab.map.yaml as well.

#version 3.7;
global_settings {
  assumed_gamma 1.0      // all colours below are linear light
  max_trace_level 4      // a ray meets a mirror once, hardly ever twice
}

#declare M = 20;         // POV-Ray units per metre
#macro W(X, Y, Z) <(X)*M, (Z)*M, (Y)*M> #end   // world metres to POV-Ray

// The room as inner faces, in metres
#declare RX = 3.05;
#declare RY = 2.55;
#declare RZ = 2.60;

background { color rgb 0.75 }

// ---------------------------------------------------------------- lights ----
// They are just under their fittings, which cast no shadow, and exactly white (rule 1).
light_source { W(-1.2,  0.6, 2.45) color rgb 0.57 }
light_source { W( 1.4, -0.7, 2.45) color rgb 0.57 }

// -------------------------------------------------------------- finishes ----
// The ambient part represents light scattered in the room.
#declare F_Matt  = finish { ambient 0.30 diffuse 0.62 }
#declare F_Glow  = finish { ambient 1.00 diffuse 0.00 }   // screens, lamps, sky
#declare F_Metal = finish { ambient 0.25 diffuse 0.50 specular 0.45 roughness 0.03 }
#declare F_Gloss = finish { ambient 0.28 diffuse 0.60 specular 0.25 roughness 0.02 }
#default { finish { F_Matt } }

// -------------------------------------------------------------- textures ----
#macro Plain(R, G, B) texture { pigment { color rgb <R, G, B> } finish { F_Matt } } #end

#declare T_White    = Plain(0.78, 0.78, 0.77)
#declare T_Wall     = Plain(0.74, 0.735, 0.72)
#declare T_Accent   = Plain(0.52, 0.57, 0.61)     // the west wall, grey-blue
#declare T_Pale     = Plain(0.58, 0.58, 0.57)
#declare T_Grey     = Plain(0.33, 0.335, 0.34)
#declare T_Dark     = Plain(0.085, 0.088, 0.095)
#declare T_Black    = Plain(0.030, 0.030, 0.032)
#declare T_Steel    = Plain(0.29, 0.335, 0.38)
#declare T_SteelDk  = Plain(0.150, 0.175, 0.205)
#declare T_Olive    = Plain(0.185, 0.215, 0.135)
#declare T_OliveDk  = Plain(0.110, 0.130, 0.082)
#declare T_Clay     = Plain(0.40, 0.31, 0.26)
#declare T_Card     = Plain(0.45, 0.375, 0.29)
#declare T_Sand     = Plain(0.55, 0.49, 0.40)
#declare T_Birch    = texture {
  pigment {
    wood turbulence 0.06
    color_map { [0.0 rgb <0.62, 0.525, 0.405>] [1.0 rgb <0.53, 0.44, 0.335>] }
    rotate y*88 rotate x*3 scale 0.55
  }
  finish { F_Matt }
}
#declare T_Alu      = texture { pigment { color rgb <0.60, 0.61, 0.63> } finish { F_Metal } }
#declare T_AluDk    = texture { pigment { color rgb <0.20, 0.205, 0.215> } finish { F_Metal } }
#declare T_Plastic  = texture { pigment { color rgb <0.045, 0.046, 0.050> } finish { F_Gloss } }

// ------------------------------------------------------------------ room ----
// The shell casts no shadow, because every shadow ray would test it in vain.
// Floor: oak planks 0.12 m wide, each with its own tone.
box { W(-RX, -RY, -0.05) W(RX, RY, 0)
  texture {
    pigment {
      brick
      pigment { color rgb <0.24, 0.205, 0.165> }
      pigment {
        cells
        color_map { [0 rgb <0.40, 0.345, 0.270>] [1 rgb <0.53, 0.465, 0.375>] }
        scale <9, 2.4, 300> translate -90*z
      }
      brick_size <18, 2.4, 300> mortar 0.05
      rotate x*90 translate <0, 90, 0>
    }
    finish { F_Matt }
  }
  no_shadow
}
// Ceiling: tiles of 0.6 m. The room as a whole lights it, because lamps that
// hang just under it would leave two overexposed spots.
box { W(-RX, -RY, RZ) W(RX, RY, RZ+0.05)
  pigment {
    gradient x
    pigment_map {
      [0.02 color rgb 0.52]
      [0.02 gradient z color_map { [0.02 rgb 0.52] [0.02 rgb 0.68] }]
    }
    scale 12 translate <6, 0, 6>
  }
  finish { F_Glow } no_shadow
}
box { W(-RX-0.1,  RY,     -0.05) W( RX+0.1,  RY+0.1, RZ) texture { T_Wall }   no_shadow }  // north
box { W(-RX-0.1, -RY-0.1, -0.05) W( RX+0.1, -RY,     RZ) texture { T_Wall }   no_shadow }  // south
box { W( RX,     -RY,     -0.05) W( RX+0.1,  RY,     RZ) texture { T_Wall }   no_shadow }  // east
box { W(-RX-0.1, -RY,     -0.05) W(-RX,      RY,     RZ) texture { T_Accent } no_shadow }  // west

// Skirting boards; the southern one leaves room for the door
#declare SK = 0.09;
box { W(-RX, RY-0.015, 0) W(RX, RY, SK)           texture { T_SteelDk } no_shadow }
box { W(-RX, -RY, 0) W(1.97, -RY+0.015, SK)       texture { T_SteelDk } no_shadow }
box { W(2.93, -RY, 0) W(RX, -RY+0.015, SK)        texture { T_SteelDk } no_shadow }
box { W(-RX, -RY, 0) W(-RX+0.015, RY, SK)         texture { T_SteelDk } no_shadow }
box { W(RX-0.015, -RY, 0) W(RX, RY, SK)           texture { T_SteelDk } no_shadow }

// Cable trunking round the room at desk height, on two walls
box { W(-1.1, RY-0.03, 0.92) W(1.25, RY, 1.00)    texture { T_Pale } no_shadow }
box { W(RX-0.03, -1.9, 0.92) W(RX, 0.0, 1.00)     texture { T_Pale } no_shadow }

// Lamp fittings: a shallow tray with a glowing panel, above the light itself
#macro Lamp(X, Y)
  box { W(X-0.62, Y-0.17, RZ-0.030) W(X+0.62, Y+0.17, RZ) texture { T_Pale } no_shadow }
  box { W(X-0.59, Y-0.14, RZ-0.034) W(X+0.59, Y+0.14, RZ-0.03)
    pigment { color rgb 0.95 } finish { F_Glow } no_shadow }
#end
Lamp(-1.2,  0.6)
Lamp( 1.4, -0.7)

// Tape on the floor marks the arena
#declare TP = 0.0012;
box { W(-2.20,  1.675, 0) W( 2.20,  1.70, TP)     texture { T_White } no_shadow }
box { W(-2.20, -1.70,  0) W( 2.20, -1.675, TP)    texture { T_White } no_shadow }
box { W(-2.20, -1.70,  0) W(-2.175, 1.70, TP)     texture { T_White } no_shadow }
box { W( 2.175,-1.70,  0) W( 2.20,  1.70, TP)     texture { T_White } no_shadow }

// --------------------------------------------------------------- pillars ----
#ifndef (Landmarks_Elsewhere)   // One texture for side and top, matt, so hue is the same wherever it is lit.
#macro Pillar(X, Y, R, G, B)
  cylinder { W(X, Y, 0) W(X, Y, 0.90) 0.15*M
    pigment { color rgb <R, G, B> } finish { ambient 0.35 diffuse 0.62 } }
  cylinder { W(X, Y, 0) W(X, Y, 0.015) 0.21*M texture { T_Dark } no_shadow }
#end
Pillar(-2.45, -0.35,  0.80, 0.03, 0.03)   // red
Pillar(-1.40,  1.95,  0.03, 0.80, 0.03)   // green
Pillar( 1.50,  1.95,  0.03, 0.03, 0.80)   // blue
Pillar( 2.45,  0.30,  0.03, 0.80, 0.80)   // cyan
Pillar( 1.30, -1.95,  0.80, 0.03, 0.80)   // magenta
Pillar(-1.50, -1.95,  0.80, 0.80, 0.03)   // yellow
#end
// ----------------------------------------- furniture: pieces used often ----
// A bench: birch top 0.74 m high, white panel legs, with an apron behind.
// The rectangle is its outline on the floor.
#macro Bench(X1, Y1, X2, Y2)
  box { W(X1, Y1, 0.705) W(X2, Y2, 0.740) texture { T_Birch translate <X1*7, 0, Y1*9> } }
  #if (X2-X1 > Y2-Y1)
    box { W(X1+0.03, Y1+0.02, 0) W(X1+0.06, Y2-0.02, 0.705) texture { T_White } }
    box { W(X2-0.06, Y1+0.02, 0) W(X2-0.03, Y2-0.02, 0.705) texture { T_White } }
  #else
    box { W(X1+0.02, Y1+0.03, 0) W(X2-0.02, Y1+0.06, 0.705) texture { T_White } }
    box { W(X1+0.02, Y2-0.06, 0) W(X2-0.02, Y2-0.03, 0.705) texture { T_White } }
  #end
#end

// A screen 0.52 m wide on its foot; faces -z (world -y) before it is turned.
#declare Screen_Pigment = pigment {     // a terminal: pale lines on slate
  gradient y
  pigment_map {
    [0.45 color rgb <0.060, 0.072, 0.085>]
    [0.45 cells color_map { [0.4 rgb <0.36, 0.42, 0.45>] [0.4 rgb <0.060, 0.072, 0.085>] } scale <0.9, 1, 9>]
  }
  scale <1, 0.5, 1>
}
#macro Screen(X, Y, Z, Turn)
  union {
    box { <-5.2, 2.2, 0.0> <5.2, 8.6, 0.5> texture { T_Plastic } }
    box { <-4.95, 2.5, -0.03> <4.95, 8.35, 0> pigment { Screen_Pigment } finish { F_Glow } }
    box { <-0.6, 0, 0.3> <0.6, 4.5, 0.8> texture { T_Dark } }
    box { <-2.2, 0, -0.9> <2.2, 0.2, 1.6> texture { T_Dark } }
    rotate y*Turn translate W(X, Y, Z)
  }
#end

// Keyboard and mouse, same orientation
#macro Keyboard(X, Y, Z, Turn)
  union {
    box { <-4.2, 0, -1.3> <4.2, 0.3, 1.3>
      pigment { checker color rgb 0.06 color rgb 0.10 scale <0.42, 2, 0.52> translate 0.5*y } }
    sphere { 0, 1 scale <0.6, 0.35, 1> translate <5.6, 0.1, -0.2> texture { T_Dark } }
    rotate y*Turn translate W(X, Y, Z)
  }
#end

// A laboratory stool 0.46 m high, so it never hides a pillar
#macro Stool(X, Y)
  cylinder { W(X, Y, 0.41) W(X, Y, 0.46) 0.16*M texture { T_SteelDk } }
  cylinder { W(X, Y, 0.03) W(X, Y, 0.41) 0.025*M texture { T_Alu } }
  cone { W(X, Y, 0.0) 0.16*M W(X, Y, 0.04) 0.05*M texture { T_Dark } }
#end

// A desktop computer under a bench
#macro Tower(X1, Y1, X2, Y2)
  box { W(X1, Y1, 0.02) W(X2, Y2, 0.42) texture { T_Plastic } no_shadow }
#end

// ------------------------------------------------ furniture: north wall ----
// Electronics bench with two screens
Bench(-0.53, 2.21, 0.68, 2.55)
Screen(-0.22, 2.46, 0.74, 8)
Screen( 0.34, 2.46, 0.74, -8)
Keyboard(0.02, 2.29, 0.74, 0)
Tower(0.42, 2.25, 0.60, 2.53)
Stool(0.05, 2.14)
cylinder { W(-0.46, 2.30, 0.74) W(-0.46, 2.30, 0.835) 0.037*M texture { T_White } }   // mug
box { W(-0.52, 2.38, 0.74) W(-0.49, 2.53, 0.98) texture { T_Steel } }                 // files
box { W(0.61, 2.30, 0.74) W(0.67, 2.53, 0.90) texture { T_Grey } }                    // power supply

// Wall shelf over the bench, with books and boxes
box { W(-0.55, 2.33, 1.42) W(0.70, 2.55, 1.445) texture { T_Birch } }
#declare Rnd = seed(11);
#declare BX = -0.52;
#while (BX < 0.12)
  #declare BT = 0.025 + 0.030*rand(Rnd);
  #declare BH = 0.19 + 0.09*rand(Rnd);
  #declare BG = 0.12 + 0.50*rand(Rnd);
  #declare BW = rand(Rnd) - 0.5;
  box { W(BX, 2.36, 1.445) W(BX+BT, 2.53, 1.445+BH)
    pigment { color rgb BG*<1+0.18*BW, 1, 1-0.18*BW> } }
  #declare BX = BX + BT + 0.002;
#end
box { W(0.20, 2.35, 1.445) W(0.42, 2.53, 1.60) texture { T_Card } }
box { W(0.45, 2.36, 1.445) W(0.66, 2.53, 1.56) texture { T_Steel } }

// Tall cupboard in the north-west corner
box { W(-3.05, 2.13, 0.06) W(-2.27, 2.55, 1.90) texture { T_Pale } }
box { W(-3.03, 2.15, 0.00) W(-2.29, 2.55, 0.06) texture { T_Dark } no_shadow }
box { W(-3.03, 2.12, 0.09) W(-2.665, 2.13, 1.87) texture { T_Steel } no_shadow }
box { W(-2.655, 2.12, 0.09) W(-2.29, 2.13, 1.87) texture { T_Steel } no_shadow }
box { W(-2.72, 2.10, 0.95) W(-2.70, 2.12, 1.15) texture { T_Alu } no_shadow }
box { W(-2.62, 2.10, 0.95) W(-2.60, 2.12, 1.15) texture { T_Alu } no_shadow }
box { W(-3.00, 2.20, 1.90) W(-2.62, 2.50, 2.12) texture { T_Card } }

// Bookcase in the north-east corner: four shelves
box { W(2.22, 2.24, 0) W(2.245, 2.55, 1.60) texture { T_Birch } }
box { W(3.005, 2.24, 0) W(3.03, 2.55, 1.60) texture { T_Birch } }
box { W(2.245, 2.535, 0) W(3.005, 2.55, 1.60) texture { T_White } }
#declare I = 0;
#while (I < 5)
  box { W(2.245, 2.24, 0.05+0.3825*I) W(3.005, 2.535, 0.07+0.3825*I) texture { T_Birch } }
  #if (I < 4)
    #declare BX = 2.26;
    #while (BX < 2.74 + 0.16*mod(I, 2))
      #declare BT = 0.030 + 0.040*rand(Rnd);
      #declare BH = 0.20 + 0.10*rand(Rnd);
      #declare BG = 0.10 + 0.50*rand(Rnd);
      #declare BW = rand(Rnd) - 0.5;
      box { W(BX, 2.28, 0.07+0.3825*I) W(BX+BT, 2.52, 0.07+0.3825*I+BH)
        pigment { color rgb BG*<1+0.18*BW, 1, 1-0.18*BW> } no_shadow }
      #declare BX = BX + BT + 0.002;
    #end
  #end
  #declare I = I + 1;
#end

// Clock
union {
  cylinder { W(1.02, 2.55, 2.02) W(1.02, 2.52, 2.02) 0.15*M texture { T_Dark } }
  cylinder { W(1.02, 2.55, 2.02) W(1.02, 2.518, 2.02) 0.135*M texture { T_White } }
  box { <-0.12, -0.3, 0> <0.12, 1.6, 0.02> rotate z*-55 translate W(1.02, 2.516, 2.02) texture { T_Black } }
  box { <-0.08, -0.4, 0> <0.08, 2.3, 0.02> rotate z*62 translate W(1.02, 2.516, 2.02) texture { T_Black } }
  no_shadow
}

// ------------------------------------------------- furniture: west wall ----
// Desk under the window
Bench(-3.05, 0.42, -2.66, 1.62)
Screen(-2.93, 1.02, 0.74, -90)
Keyboard(-2.75, 1.02, 0.74, -90)
Tower(-3.02, 0.50, -2.72, 0.68)
Stool(-2.65, 1.02)
box { W(-2.98, 1.36, 0.74) W(-2.74, 1.54, 0.78) texture { T_White } }        // papers
box { W(-2.97, 1.38, 0.78) W(-2.76, 1.53, 0.80) texture { T_Sand } }
union {                                                                      // desk lamp
  cylinder { W(-2.95, 0.56, 0.74) W(-2.95, 0.56, 0.76) 0.08*M }
  cylinder { W(-2.95, 0.56, 0.76) W(-2.99, 0.56, 1.05) 0.010*M }
  cylinder { W(-2.99, 0.56, 1.05) W(-2.82, 0.62, 1.20) 0.010*M }
  cone { W(-2.84, 0.615, 1.22) 0.03*M W(-2.78, 0.635, 1.12) 0.075*M }
  texture { T_AluDk }
}

// A window: pale sky over distant roofs, all in grey; then frame and sill.
// South to north on the wall plane X, Side is +1 on the west wall, -1 on the east.
#declare Sky = pigment {
  gradient y
  color_map {
    [0.00 rgb <0.30, 0.32, 0.31>] [0.24 rgb <0.36, 0.38, 0.37>]
    [0.25 rgb <0.72, 0.78, 0.84>] [1.00 rgb <0.60, 0.71, 0.82>]
  }
  scale <1, 24, 1> translate 19.5*y
}
#macro Window(X, Side, Y1, Y2)
  box { W(X, Y1-0.06, 0.98) W(X+0.020*Side, Y2+0.06, 2.16) texture { T_White } no_shadow }
  box { W(X, Y1, 1.04) W(X+0.022*Side, Y2, 2.10) pigment { Sky } finish { F_Glow } no_shadow }
  box { W(X, (Y1+Y2)/2-0.025, 1.04) W(X+0.04*Side, (Y1+Y2)/2+0.025, 2.10) texture { T_White } no_shadow }
  box { W(X, Y1, 1.74) W(X+0.04*Side, Y2, 1.78) texture { T_White } no_shadow }
  box { W(X, Y1-0.10, 0.95) W(X+0.12*Side, Y2+0.10, 0.98) texture { T_White } }
#end
Window(-RX, 1, 0.45, 1.60)

// Steel shelving with boxes and instruments
#macro Post(X, Y) box { W(X-0.015, Y-0.015, 0) W(X+0.015, Y+0.015, 1.70) texture { T_SteelDk } } #end
Post(-3.03, -1.82) Post(-2.715, -1.82) Post(-3.03, -0.95) Post(-2.715, -0.95)
#declare I = 0;
#while (I < 4)
  box { W(-3.04, -1.83, 0.12+0.50*I) W(-2.70, -0.94, 0.145+0.50*I) texture { T_Steel } }
  #declare I = I + 1;
#end
box { W(-3.00, -1.78, 0.145) W(-2.74, -1.42, 0.43) texture { T_Card } }
box { W(-3.00, -1.36, 0.145) W(-2.76, -1.00, 0.37) texture { T_Grey } }
box { W(-3.00, -1.76, 0.645) W(-2.74, -1.36, 0.90) texture { T_Dark } }      // oscilloscope
box { W(-2.74, -1.72, 0.70) W(-2.738, -1.52, 0.86)
  pigment { gradient y color_map { [0.08 rgb <0.40, 0.45, 0.42>] [0.08 rgb <0.10, 0.115, 0.11>] } scale 0.8 }
  finish { F_Glow } no_shadow }
box { W(-3.00, -1.30, 0.645) W(-2.76, -1.02, 0.86) texture { T_Sand } }
box { W(-3.00, -1.75, 1.145) W(-2.75, -1.50, 1.38) texture { T_Pale } }
box { W(-3.00, -1.46, 1.145) W(-2.78, -1.26, 1.33) texture { T_Steel } }
box { W(-3.00, -1.22, 1.145) W(-2.75, -0.98, 1.42) texture { T_Card } }
box { W(-3.00, -1.70, 1.645) W(-2.76, -1.28, 1.86) texture { T_Card } }

// Potted plant in the south-west corner: leaves are flattened spheres
cone { W(-2.80, -2.30, 0) 0.13*M W(-2.80, -2.30, 0.32) 0.18*M texture { T_Clay } }
cylinder { W(-2.80, -2.30, 0.32) W(-2.80, -2.30, 0.325) 0.165*M texture { T_Black } no_shadow }
cylinder { W(-2.80, -2.30, 0.32) W(-2.81, -2.31, 0.95) 0.014*M texture { T_Card } }
#declare I = 0;
#while (I < 22)
  #declare LH = 0.50 + 0.026*I;
  sphere { 0, 1 scale <2.3, 0.22, 0.95>
    translate 2.1*x rotate z*(18 + 30*rand(Rnd) + I) rotate y*(137.5*I)
    scale 1 - 0.012*I
    translate W(-2.805, -2.305, LH)
    #if (mod(I, 3) = 0) texture { T_OliveDk } #else texture { T_Olive } #end
  }
  #declare I = I + 1;
#end

// ------------------------------------------------ furniture: south wall ----
// Whiteboard with a sketch of a cone mirror and some writing
box { W(-0.98, -2.55, 1.02) W(0.72, -2.530, 1.98) texture { T_Alu } no_shadow }
box { W(-0.955, -2.55, 1.045) W(0.695, -2.528, 1.955)
  pigment { color rgb 0.86 } no_shadow }
box { W(-0.60, -2.55, 1.00) W(0.34, -2.46, 1.02) texture { T_Alu } }
#macro Stroke(X1, Z1, X2, Z2)
  cylinder { W(X1, -2.528, Z1) W(X2, -2.528, Z2) 0.007*M texture { T_SteelDk } no_shadow }
#end
Stroke(0.24, 1.78, 0.56, 1.78)  Stroke(0.24, 1.78, 0.40, 1.60)  Stroke(0.56, 1.78, 0.40, 1.60)
Stroke(0.40, 1.30, 0.47, 1.68)  Stroke(0.47, 1.68, 0.10, 1.58)
Stroke(0.36, 1.22, 0.44, 1.22)  Stroke(0.36, 1.22, 0.40, 1.30)  Stroke(0.44, 1.22, 0.40, 1.30)
box { W(-0.82, -2.55, 1.32) W(-0.10, -2.5275, 1.82)
  pigment {
    gradient y
    pigment_map {
      [0.70 color rgb 0.86]
      [0.70 cells color_map { [0.72 rgb <0.20, 0.22, 0.25>] [0.72 rgb 0.86] } scale <0.55, 10, 100> ]
    }
    scale <1, 1.25, 1>
  }
  no_shadow }

// Low cupboard with a robot arm and a 3D printer on it
box { W(-0.68, -2.55, 0.05) W(0.48, -2.235, 0.70) texture { T_White } }
box { W(-0.66, -2.55, 0.00) W(0.46, -2.255, 0.05) texture { T_Dark } no_shadow }
box { W(-0.70, -2.55, 0.70) W(0.50, -2.22, 0.73) texture { T_Birch } }
#declare I = 0;
#while (I < 3)
  box { W(-0.67+0.387*I, -2.235, 0.08) W(-0.304+0.387*I, -2.227, 0.68) texture { T_Pale } no_shadow }
  box { W(-0.37+0.387*I, -2.227, 0.50) W(-0.35+0.387*I, -2.216, 0.62) texture { T_AluDk } no_shadow }
  #declare I = I + 1;
#end
union {                                                                      // robot arm
  cylinder { W(-0.40, -2.39, 0.73) W(-0.40, -2.39, 0.80) 0.09*M texture { T_Dark } }
  cylinder { W(-0.40, -2.39, 0.80) W(-0.40, -2.39, 0.90) 0.06*M texture { T_Pale } }
  cylinder { W(-0.40, -2.45, 0.93) W(-0.40, -2.33, 0.93) 0.055*M texture { T_Steel } }
  cylinder { W(-0.40, -2.39, 0.93) W(-0.52, -2.39, 1.18) 0.035*M texture { T_Pale } }
  cylinder { W(-0.52, -2.44, 1.18) W(-0.52, -2.34, 1.18) 0.048*M texture { T_Steel } }
  cylinder { W(-0.52, -2.39, 1.18) W(-0.30, -2.39, 1.26) 0.028*M texture { T_Pale } }
  sphere   { W(-0.30, -2.39, 1.26) 0.040*M texture { T_Steel } }
  cylinder { W(-0.30, -2.39, 1.26) W(-0.25, -2.39, 1.15) 0.020*M texture { T_Dark } }
  box { W(-0.275, -2.41, 1.09) W(-0.265, -2.37, 1.15) texture { T_Dark } }
  box { W(-0.230, -2.41, 1.09) W(-0.220, -2.37, 1.15) texture { T_Dark } }
}
union {                                                                      // 3D printer
  box { W(0.06, -2.54, 0.73) W(0.42, -2.22, 0.78) texture { T_Dark } }
  box { W(0.06, -2.42, 0.78) W(0.09, -2.38, 1.16) texture { T_AluDk } }
  box { W(0.39, -2.42, 0.78) W(0.42, -2.38, 1.16) texture { T_AluDk } }
  box { W(0.06, -2.42, 1.13) W(0.42, -2.38, 1.16) texture { T_AluDk } }
  box { W(0.09, -2.41, 0.95) W(0.39, -2.39, 0.97) texture { T_Alu } }
  box { W(0.20, -2.39, 0.90) W(0.27, -2.35, 1.00) texture { T_Black } }
  box { W(0.12, -2.50, 0.79) W(0.36, -2.26, 0.80) texture { T_Grey } }
  cylinder { W(0.235, -2.37, 0.80) W(0.235, -2.37, 0.87) 0.04*M texture { T_Sand } }
}

// Door in the south-east, with frame, glazing and handle
box { W(1.97, -2.55, 0) W(2.93, -2.52, 2.10) texture { T_White } no_shadow }
box { W(2.03, -2.55, 0) W(2.87, -2.515, 2.04) texture { T_Steel } no_shadow }
box { W(2.33, -2.55, 1.15) W(2.57, -2.512, 1.85)
  pigment { color rgb <0.36, 0.40, 0.43> } finish { F_Glow } no_shadow }
box { W(2.08, -2.55, 0.98) W(2.12, -2.505, 1.16) texture { T_Alu } no_shadow }
cylinder { W(2.10, -2.47, 1.06) W(2.23, -2.47, 1.06) 0.011*M texture { T_Alu } no_shadow }
cylinder { W(2.10, -2.52, 1.06) W(2.10, -2.47, 1.06) 0.011*M texture { T_Alu } no_shadow }
box { W(1.80, -2.55, 1.12) W(1.88, -2.54, 1.20) texture { T_White } no_shadow }   // light switch

// Waste bin by the door
cone { W(1.78, -2.37, 0) 0.10*M W(1.78, -2.37, 0.32) 0.13*M open texture { T_Grey } }
cylinder { W(1.78, -2.37, 0.01) W(1.78, -2.37, 0.02) 0.10*M texture { T_Black } no_shadow }

// ------------------------------------------------- furniture: east wall ----
// Desk with a laptop and a screen
Bench(2.68, -1.62, 3.05, -0.18)
Screen(2.93, -0.62, 0.74, 90)
Keyboard(2.77, -0.62, 0.74, 90)
Tower(2.74, -0.40, 3.02, -0.24)
Stool(2.64, -0.85)
union {                                                                      // laptop
  box { <-3.4, 0, -2.4> <3.4, 0.3, 2.2> texture { T_AluDk } }
  box { <-3.4, 0, 0> <3.4, 4.4, 0.2> rotate x*18 translate <0, 0.3, 2.2> texture { T_AluDk } }
  box { <-3.15, 0.3, -0.03> <3.15, 4.1, 0> rotate x*18 translate <0, 0.3, 2.2>
    pigment { color rgb <0.42, 0.46, 0.50> } finish { F_Glow } }
  rotate y*90 translate W(2.84, -1.22, 0.74)
}
cylinder { W(2.95, -0.92, 0.74) W(2.95, -0.92, 0.835) 0.037*M texture { T_Dark } }   // mug

// Window with a radiator under it
Window(RX, -1, 0.78, 1.62)
box { W(3.01, 0.80, 0.15) W(3.03, 1.50, 0.68) texture { T_White } }
box { W(2.95, 0.80, 0.15) W(3.01, 1.50, 0.68)
  pigment { gradient z color_map { [0.22 rgb 0.40] [0.22 rgb 0.74] } scale 1 } }

// Visitor's chair, its back to the wall
box { W(2.63, 1.62, 0.42) W(3.00, 2.02, 0.47) texture { T_SteelDk } }
box { W(2.97, 1.63, 0.50) W(3.01, 2.01, 0.86) texture { T_SteelDk } }
cylinder { W(2.65, 1.64, 0) W(2.65, 1.64, 0.42) 0.011*M texture { T_AluDk } }
cylinder { W(2.65, 2.00, 0) W(2.65, 2.00, 0.42) 0.011*M texture { T_AluDk } }
cylinder { W(2.98, 1.66, 0) W(2.99, 1.66, 0.80) 0.011*M texture { T_AluDk } }
cylinder { W(2.98, 1.98, 0) W(2.99, 1.98, 0.80) 0.011*M texture { T_AluDk } }

// --------------------------------------------------------------- posters ----
// A sheet with a title bar, a figure and a text block. Along is the direction
// on the wall in which x of the poster runs; In points into the room.
#macro Sheet(P, Along, In, U1, V1, U2, V2, D)
  P + Along*U1*M + y*V1*M, P + Along*U2*M + y*V2*M + In*D*M
#end
#macro Poster(P, Along, In, Wd, Ht, Shade)
  box { Sheet(P, Along, In, 0, 0, Wd, Ht, 0.003) pigment { color rgb <0.70, 0.70, 0.68> } no_shadow }
  box { Sheet(P, Along, In, 0.03, Ht-0.13, Wd-0.03, Ht-0.03, 0.005)
    pigment { color rgb Shade*<0.22, 0.26, 0.31> } no_shadow }
  box { Sheet(P, Along, In, 0.03, Ht*0.40, Wd-0.03, Ht-0.16, 0.005)
    pigment { bozo color_map { [0.3 rgb Shade*<0.30, 0.31, 0.33>] [0.7 rgb Shade*<0.58, 0.56, 0.52>] } scale 2.2 } no_shadow }
  box { Sheet(P, Along, In, 0.05, 0.05, Wd-0.05, Ht*0.40-0.04, 0.005)
    pigment { gradient y color_map { [0.45 rgb 0.30] [0.45 rgb 0.70] } scale 0.7 } no_shadow }
#end
Poster(W(-2.12, 2.55, 1.25),  x, -z, 0.55, 0.78, 1.0)     // north
Poster(W( 1.32, 2.55, 1.22),  x, -z, 0.62, 0.88, 0.8)     // north
Poster(W(-3.05, -0.70, 1.15), z,  x, 0.60, 0.85, 1.0)     // west, behind red
Poster(W( 3.05, -1.20, 1.22), z, -x, 0.55, 0.78, 0.9)     // east
Poster(W( 3.05, -0.45, 1.22), z, -x, 0.55, 0.78, 1.1)     // east
Poster(W(-1.88, -2.55, 1.25), x,  z, 0.60, 0.85, 0.7)     // south
Poster(W( 1.00, -2.55, 1.25), x,  z, 0.55, 0.78, 1.0)     // south

// ------------------------------------------- obstacles inside the arena ----
// A low crate of slats
box { W(-1.00, 0.85, 0.05) W(-0.40, 1.25, 0.25) texture { T_Card } }
box { W(-1.00, 0.85, 0.25) W(-0.40, 1.25, 0.28) texture { T_Birch } }
box { W(-0.98, 0.87, 0.00) W(-0.42, 1.23, 0.05) texture { T_Dark } no_shadow }
#declare I = 0;
#while (I < 2)
  box { W(-1.004, 0.846, 0.075+0.085*I) W(-0.396, 1.254, 0.140+0.085*I) texture { T_Sand } }
  #declare I = I + 1;
#end
// A round pouf
cylinder { W(1.20, -0.80, 0.02) W(1.20, -0.80, 0.26) 0.192*M texture { T_SteelDk } }
torus { 0.17*M, 0.03*M translate W(1.20, -0.80, 0.25) texture { T_Steel } }
torus { 0.17*M, 0.03*M translate W(1.20, -0.80, 0.04) texture { T_Steel } }
cylinder { W(1.20, -0.80, 0.20) W(1.20, -0.80, 0.28) 0.17*M texture { T_Steel } }

// ---------------------------------------------------------- robot's parts ----
// In POV-Ray units, relative to the robot: x forward, y up, z left.
#declare F_Mirror = finish { ambient 0 diffuse 0 reflection 0.9 }
#declare T_Mirror = texture { pigment { color rgb 0 } finish { F_Mirror } }
#declare T_Deck   = texture { pigment { color rgb <0.10, 0.105, 0.115> } finish { F_Gloss } }
#declare T_Tyre   = Plain(0.028, 0.028, 0.030)
#declare T_Bumper = texture { pigment { color rgb <0.13, 0.22, 0.27> } finish { F_Gloss } }
#declare T_Board  = Plain(0.10, 0.17, 0.115)
#declare T_Cell   = texture { pigment { color rgb <0.20, 0.25, 0.33> } finish { F_Gloss } }
#declare T_Label  = Plain(0.62, 0.58, 0.48)
#declare T_Brass  = texture { pigment { color rgb <0.42, 0.35, 0.22> } finish { F_Metal } }

// A drive wheel on the z axis, tyre 0.05 m in radius
#declare Wheel = union {
  cylinder { <0, 0, -0.25> <0, 0, 0.25> 0.90 texture { T_Tyre } }
  torus { 0.85, 0.15 rotate x*90 translate -0.14*z texture { T_Tyre } }
  torus { 0.85, 0.15 rotate x*90 translate  0.14*z texture { T_Tyre } }
  cylinder { <0, 0, -0.28> <0, 0, 0.28> 0.62 texture { T_Alu } }
  cylinder { <0, 0, -0.31> <0, 0, 0.31> 0.20 texture { T_Dark } }
  #local I = 0;
  #while (I < 5)
    cylinder { <0, 0.41, -0.285> <0, 0.41, 0.285> 0.12 rotate z*72*I texture { T_Dark } }
    #local I = I + 1;
  #end
}

// Ball caster under the lower deck
#declare Caster = union {
  sphere { 0.40*y, 0.40 texture { T_Alu } }
  cylinder { 0.45*y, 1.05*y, 0.50 texture { T_AluDk } }
  cylinder { 1.05*y, 1.50*y, 0.20 texture { T_Alu } }
}

// Range finder: a small board with two eyes, facing +x
#declare Sonar = union {
  box { <-0.05, -0.40, -0.95> <0.03, 0.40, 0.95> texture { T_Board } }
  cylinder { <0, 0, -0.52> <0.30, 0, -0.52> 0.32 texture { T_Alu } }
  cylinder { <0, 0,  0.52> <0.30, 0,  0.52> 0.32 texture { T_Alu } }
  cylinder { <0, 0, -0.52> <0.31, 0, -0.52> 0.24 texture { T_Dark } }
  cylinder { <0, 0,  0.52> <0.31, 0,  0.52> 0.24 texture { T_Dark } }
}

// The drive: everything between the floor and the lower deck
#declare Chassis = union {
  difference {                                        // lower deck, 3.75 in radius
    cylinder { 1.50*y, 1.66*y, 3.75 }
    box { <-1.2, 1.4,  2.62> <1.2, 1.8,  3.42> }      // slots for the wheels
    box { <-1.2, 1.4, -2.62> <1.2, 1.8, -3.42> }
    texture { T_Deck }
  }
  object { Wheel translate <0, 1,  3> }
  object { Wheel translate <0, 1, -3> }
  cylinder { <0, 1, -2.7> <0, 1, -0.9> 0.46 texture { T_AluDk } }     // motors
  cylinder { <0, 1,  0.9> <0, 1,  2.7> 0.46 texture { T_AluDk } }
  cylinder { <0, 1, -0.9> <0, 1, -0.5> 0.40 texture { T_Brass } }     // encoders
  cylinder { <0, 1,  0.5> <0, 1,  0.9> 0.40 texture { T_Brass } }
  object { Caster translate  2.9*x }
  object { Caster translate -2.9*x }
  difference {                                        // bumpers, fore and aft
    cylinder { 0.95*y, 1.85*y, 4.00 }
    cylinder { 0.90*y, 1.90*y, 3.80 }
    box { <-1.5, 0.9, -4.1> <1.5, 2.0, 4.1> }
    texture { T_Bumper }
  }
  difference {                                        // a rubber strip along them
    cylinder { 1.28*y, 1.50*y, 4.03 }
    cylinder { 1.20*y, 1.60*y, 3.90 }
    box { <-1.5, 0.9, -4.1> <1.5, 2.0, 4.1> }
    texture { T_Tyre }
  }
}

// Battery, computer and motor drivers between the decks
#declare Standoff = cylinder { 1.66*y, 3.40*y, 0.11 texture { T_Alu } }
#declare Bay = union {
  #local I = 0;
  #while (I < 6)
    object { Standoff translate 3.35*x rotate y*(30 + 60*I) }
    #local I = I + 1;
  #end
  box { <-2.7, 1.66, -1.15> <-0.5, 2.85, 1.15> texture { T_Cell } }          // battery
  box { <-2.72, 1.95, -0.75> <-0.48, 2.55, 0.75> texture { T_Label } }
  box { <-2.2, 1.66, -1.17> <-1.95, 2.87, 1.17> texture { T_Black } }        // straps
  box { <-1.25, 1.66, -1.17> <-1.0, 2.87, 1.17> texture { T_Black } }
  box { <0.3, 1.66, -1.5> <2.5, 2.30, 1.5> texture { T_AluDk } }             // computer
  #local I = 0;
  #while (I < 9)                                                             // its fins
    box { <0.4, 2.30, -1.4 + 0.33*I> <2.4, 2.62, -1.27 + 0.33*I> texture { T_AluDk } }
    #local I = I + 1;
  #end
  object { Sonar translate <3.35, 2.55, 0> }
  object { Sonar translate <3.35, 2.55, 0> rotate  y*60 }
  object { Sonar translate <3.35, 2.55, 0> rotate -y*60 }
  cylinder { <-0.5, 2.5,  0.6> <0.4, 2.0,  0.9> 0.07 texture { T_Black } }   // power leads
  cylinder { <-0.5, 2.5, -0.6> <0.4, 2.0, -0.9> 0.07 texture { T_Clay } }
}

// Upper deck and what stands on it; all of it below 0.30 m, that is 6 units
#declare Top = union {
  cylinder { 3.40*y, 3.58*y, 3.70 texture { T_Deck } }
  torus { 3.70, 0.09 translate 3.49*y texture { T_Bumper } }
  #local I = 0;
  #while (I < 6)
    cylinder { 3.58*y, 3.66*y, 0.17 translate 3.35*x rotate y*(30 + 60*I) texture { T_Alu } }
    #local I = I + 1;
  #end
  // Lower camera: body, then a lens barrel with an open mouth, top at 0.245 m
  box { <-0.72, 3.58, -0.72> <0.72, 4.45, 0.72> texture { T_AluDk } }
  box { <-0.95, 3.58, -0.95> <0.95, 3.70, 0.95> texture { T_Alu } }
  difference {
    cylinder { 4.45*y, 4.90*y, 0.50 }
    cylinder { 4.60*y, 5.00*y, 0.36 }
    texture { T_Plastic }
  }
  torus { 0.50, 0.05 translate 4.60*y texture { T_Alu } }
  // Controller board behind it, left; a USB hub, right
  box { <-2.1, 3.66, 0.9> <0.5, 3.74, 2.7> texture { T_Board } }
  box { <-1.6, 3.74, 1.4> <-0.9, 3.86, 2.1> texture { T_Black } }
  box { <-0.5, 3.74, 1.1> <-0.1, 4.00, 1.7> texture { T_Alu } }
  box { <-0.5, 3.74, 1.9> <-0.1, 4.00, 2.5> texture { T_Alu } }
  box { <-2.0, 3.74, 1.0> <-1.8, 3.94, 2.6> texture { T_Black } }
  box { <-1.7, 3.58, -2.5> <0.0, 4.05, -1.4> texture { T_Plastic } }
  box { <-1.5, 4.05, -2.3> <-1.3, 4.07, -2.1> texture { T_White } }
  // Stop button and a nose mark that shows which way is forward
  cylinder { <2.3, 3.58, -1.7> <2.3, 3.80, -1.7> 0.50 texture { T_Label } }
  cylinder { <2.3, 3.80, -1.7> <2.3, 4.10, -1.7> 0.36 texture { T_Clay } }
  prism { 3.575, 3.595, 4, <3.4, 0> <2.5, 0.5> <2.5, -0.5> <3.4, 0> texture { T_Label } }
  // Camera lead, and the foot of the mast
  cylinder { <-0.72, 3.9, 0> <-2.2, 3.75, 0> 0.08 texture { T_Black } }
  cylinder { <-2.6, 3.58, 0> <-2.6, 3.76, 0> 0.42 texture { T_Alu } }
  cylinder { <-2.6, 3.76, 0> <-2.6, 4.40, 0> 0.20 texture { T_AluDk } }
}

// All parts below 0.30 m have one bound: most rays start at the mirrors above
// and miss it with a single test. Without bounds a frame takes a tenth longer.
#declare Base = union {
  object { Chassis }
  object { Bay }
  object { Top }
  bounded_by { box { <-4.05, -0.01, -4.05>, <4.05, 4.91, 4.05> } }
}

// Housing of the upper camera, on the back of the lower mirror: 0.44 to 0.545 m,
// within 0.03 m of the axis.
#declare Upper_Camera = union {
  box { <-0.42, 8.80, -0.42> <0.42, 10.35, 0.42> texture { T_AluDk } }
  difference {
    cylinder { 10.35*y, 10.90*y, 0.46 }
    cylinder { 10.55*y, 11.00*y, 0.34 }
    texture { T_Plastic }
  }
  torus { 0.46, 0.04 translate 10.45*y texture { T_Alu } }
  bounded_by { box { <-0.55, 8.79, -0.55>, <0.55, 10.91, 0.55> } }
}

// ------------------------------------------------------------------ robot ----
// Heights of the head, in metres above the floor, all on the robot's axis:
//   0.25 lower lens    0.37 lower tip    0.43 lower rim, 0.06 in radius
//   0.55 upper lens    0.67 upper tip    0.73 upper rim, 0.06 in radius
// A mirror sees elevations from level up to 18.4 degrees. Above 0.30 m there
// is therefore only the thin mast behind, which both mirrors do see, and its
// arms, kept at heights which neither sees.
union {
  //*PMName robot
  object { Base }

  // Lower mirror and its back plate
  cone { <0, 7.4, 0>, 0 <0, 8.6, 0>, 1.2 open texture { T_Mirror } }
  cylinder { <0, 8.6, 0> <0, 8.8, 0> 1.2 texture { T_Dark } }

  object { Upper_Camera }

  // Upper mirror and its back plate
  cone { <0, 13.4, 0>, 0 <0, 14.6, 0>, 1.2 open texture { T_Mirror } }
  cylinder { <0, 14.6, 0> <0, 14.8, 0> 1.2 texture { T_Dark } }

  // Mast 0.13 m behind the axis, with two arms
  cylinder { <-2.6, 3.58, 0> <-2.6, 15.6, 0> 0.08 texture { T_Alu } }
  cylinder { <-2.6, 9.62, 0> <-0.40, 9.62, 0> 0.10 texture { T_Alu } }
  cylinder { <-2.6, 9.40, 0> <-2.6, 9.84, 0> 0.17 texture { T_AluDk } }
  cylinder { <-2.6, 15.42, 0> <0, 15.42, 0> 0.10 texture { T_Alu } }
  cylinder { <-2.6, 15.26, 0> <-2.6, 15.58, 0> 0.17 texture { T_AluDk } }
  cylinder { <0, 14.8, 0> <0, 15.52, 0> 0.16 texture { T_Alu } }
}

// ---------------------------------------------------------------- cameras ----
// Pinholes looking straight up. With direction 1.475 and up 1 an image 480
// pixels high has a focal length of 1.475*480 = 708 pixels, so the mirror's rim,
// 0.06 m out and 0.18 m up, is a circle of 708*0.06/0.18 = 236 pixels.
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
// View from the north-east of the arena. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location <16, 25, 25>
  right <4/3, 0, 0>
  up <0, 1, 0>
  sky <0, 1, 0>
  angle 82
  look_at <-2.4, 9.5, -4.4>
}
