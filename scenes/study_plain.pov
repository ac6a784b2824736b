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
#include "study/scout.inc"

union {
  //*PMName robot
  object { Scout }
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
