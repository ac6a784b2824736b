// SPDX-License-Identifier: Apache-2.0
//
// create2.pov : the robot of robots/create2.yaml in the room of my_room.map.yaml.
//
// An iRobot Create 2 with a mast: a disc of 0.34 m, 0.09 m high; above it the lab's head, 0.05 m lower.
//
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.

#version 3.7;
#include "room.inc"
#include "../parts/robot.inc"

// The head in metres, as in `rig:` of the robot file. Direction is the focal length divided by the image's height.
#declare Lens_Height = 0.20;
#declare Rim = 0.06;
#declare Lens_To_Tip = 0.12;
#declare Separation = 0.30;
#declare Direction = 1.475;

union {
  //*PMName robot
  union {
    cylinder { 0.4*y, 1.75*y, 3.35 texture { Robot_Dark } }
    torus { 3.20, 0.14 translate 1.72*y texture { Robot_Alu } }
    cylinder { 1.75*y, 1.84*y, 1.1 texture { Robot_Alu } }
    prism { 1.83, 1.86, 4, <3.0, 0> <2.1, 0.6> <2.1, -0.6> <3.0, 0> texture { Robot_Mark } }
    box { <-2.9, 1.75, -1.2> <-1.5, 2.25, 1.2> texture { Robot_Bumper } }
    bounded_by { box { <-3.4, 0.3, -3.4>, <3.4, 2.3, 3.4> } }
  }
  object { Robot_Camera translate Robot_Up(Lens_Height - 0.005) }
  object { Robot_Cone(Rim, 90) translate Robot_Up(Lens_Height + Lens_To_Tip) }
  object { Robot_Camera translate Robot_Up(Lens_Height + Separation - 0.005) }
  object { Robot_Cone(Rim, 90) translate Robot_Up(Lens_Height + Separation + Lens_To_Tip) }
  object { Robot_Arm(Lens_Height + Lens_To_Tip + Rim + 0.03) }
  object { Robot_Arm(Lens_Height + Separation + Lens_To_Tip + Rim + 0.02) }
  cylinder { <-2.6, 0.09*M, 0> <-2.6, (Lens_Height + Separation + Lens_To_Tip + Rim + 0.03)*M, 0> 0.08
    texture { Robot_Alu } }
}
camera {
  //*PMName lower
  perspective
  location <0, Lens_Height*M, 0> direction <0, Direction, 0> up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective
  location <0, (Lens_Height + Separation)*M, 0> direction <0, Direction, 0> up <0, 0, -1> right <4/3, 0, 0>
}
// View from the east wall. The last camera is the default.
camera {
  //*PMName outside
  perspective
  location W(2.2, -0.1, 1.5)
  right x*image_width/image_height
  up y
  angle 75
  look_at W(-0.4, 0.1, 0.35)
}
