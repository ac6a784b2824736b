// SPDX-License-Identifier: Apache-2.0
//
// pair.pov : two robots in a small room, and a trolley that moves along its own path.
//
// SCALE  1 POV-Ray unit = 5 cm; world (x, y, z) metres is POV-Ray <x, z, y> / 0.05. A heading h is `rotate -h*y` in
//        degrees, since POV-Ray is left-handed.
// NAMES  robot.1, robot.2        the robots, at their start poses (robots/pair/one.yaml, two.yaml)
//        lower.1 ... upper.2     their cameras
//        moving.trolley          at the beginning of its path (pair.map.yaml), facing along it
// The robots look like the lab's, but have drums on their heads and necks. The other robot's mirrors see them, their
// own do not: robot 1 has rings, robot 2 a chequer. All are grey, because a coloured part would be taken for a pillar.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

// The head of both robots: two 90 degree cones, their cameras, the mast; drums with Bands and Sectors
#macro Head(Bands, Sectors)
  object { Robot_Camera translate Robot_Up(0.245) }
  cylinder { Robot_Up(0.179) Robot_Up(0.20) 1.0 texture { Robot_Dark } }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.37) }
  object { Robot_Drum(0.455, 0.530, 0.065, 2, Sectors) }
  object { Robot_Camera translate Robot_Up(0.545) }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.67) }
  object { Robot_Drum(0.77, 1.07, 0.11, Bands, Sectors) }
  object { Robot_Mast(0.79) }
  object { Robot_Arm(0.49) }
  object { Robot_Arm(0.775) }
#end

union {
  //*PMName robot.1
  object { Robot_Body }
  Head(4, 1)
  rotate -17*y
  translate W(-0.80, -0.45, 0)
}
camera {
  //*PMName lower.1
  perspective location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
  rotate -17*y
  translate W(-0.80, -0.45, 0)
}
camera {
  //*PMName upper.1
  perspective location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
  rotate -17*y
  translate W(-0.80, -0.45, 0)
}

union {
  //*PMName robot.2
  object { Robot_Body }
  Head(3, 3)
  rotate -131*y
  translate W(0.85, -0.35, 0)
}
camera {
  //*PMName lower.2
  perspective location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
  rotate -131*y
  translate W(0.85, -0.35, 0)
}
camera {
  //*PMName upper.2
  perspective location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
  rotate -131*y
  translate W(0.85, -0.35, 0)
}

// A laundry trolley, 0.95 m high: dark frame, pale bag; defined about its middle, facing along x
union {
  //*PMName moving.trolley
  box { <-3.0, 1.2, -2.4> <3.0, 1.8, 2.4> texture { Robot_Deck } }
  sphere { < 2.4, 0.6,  1.8>, 0.6 texture { Robot_Tyre } }
  sphere { < 2.4, 0.6, -1.8>, 0.6 texture { Robot_Tyre } }
  sphere { <-2.4, 0.6,  1.8>, 0.6 texture { Robot_Tyre } }
  sphere { <-2.4, 0.6, -1.8>, 0.6 texture { Robot_Tyre } }
  box { <-2.8, 1.8, -2.2> <2.8, 15.0, 2.2>
    pigment { gradient y color_map { [0.5 rgb <0.58, 0.55, 0.50>] [0.5 rgb <0.20, 0.21, 0.23>] } scale 4 }
    finish { Robot_Matt } }
  cylinder { <-2.8, 15.0, -2.2> <-2.8, 19.0, -2.2> 0.15 texture { Robot_Alu } }
  cylinder { <-2.8, 15.0,  2.2> <-2.8, 19.0,  2.2> 0.15 texture { Robot_Alu } }
  cylinder { <-2.8, 19.0, -2.2> <-2.8, 19.0,  2.2> 0.20 texture { Robot_Tyre } }
  translate W(-0.90, 1.10, 0)
}

// View from a corner, under the ceiling. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(2.2, -1.85, 2.1)
  right x*image_width/image_height
  up y
  angle 80
  look_at W(-0.3, 0.2, 0.35)
}
