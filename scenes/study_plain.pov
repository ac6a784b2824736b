// SPDX-License-Identifier: Apache-2.0
//
// study_plain.pov : the study of study.pov in plain paint, where a robot that ranges what has texture sees little.
// study/room.inc describes the room.
//
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.

#version 3.7;
#include "parts/robot.inc"
#declare Study_Texture = 0;
#include "study/room.inc"

// ----------------------------------------------------------------- robot ----
// A flat body under two cones of 112 degrees: they show elevations from -22 degrees at the tip to 8.8 at the rim, the
// floor among them. robots/scout_plain_sim.yaml contains the same numbers.
#declare Rim = 0.08;                                           // R, metres
#declare Lens_To_Tip = 0.08;                                   // d, metres
#declare Rim_Height = Lens_To_Tip + Rim/tan(radians(56));      // above the lens
// The rim's circle has a radius of 236 of the image's 480 rows.
#declare Up_Look = <0, 236/480*Rim_Height/Rim, 0>;

union {
  //*PMName robot
  cylinder { 0.5*y, 1.3*y, 3.5 texture { Robot_Deck } }
  object { Robot_Wheel scale <0.7, 0.7, 1> translate <0, 0.7, 2.6> }
  object { Robot_Wheel scale <0.7, 0.7, 1> translate <0, 0.7, -2.6> }
  sphere { <2.9, 0.25, 0>, 0.25 texture { Robot_Alu } }
  sphere { <-2.9, 0.25, 0>, 0.25 texture { Robot_Alu } }
  object { Robot_Camera translate Robot_Up(0.139) }
  object { Robot_Cone(Rim, 112) translate Robot_Up(0.22) }
  object { Robot_Camera translate Robot_Up(0.379) }
  object { Robot_Cone(Rim, 112) translate Robot_Up(0.46) }
  cylinder { <-2.6, 1.3, 0> <-2.6, 10.8, 0> 0.08 texture { Robot_Alu } }
  object { Robot_Arm(0.29) }
  object { Robot_Arm(0.53) }
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.14) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.38) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
// The whole room from its south-east corner; the last camera is the default
camera {
  //*PMName outside
  perspective location W(2.9, -2.4, 2.3) right <4/3, 0, 0> up y sky y angle 84 look_at W(-0.6, 0.5, 0.2)
}
