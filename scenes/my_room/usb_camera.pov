// SPDX-License-Identifier: Apache-2.0
//
// usb_camera.pov : the robot of robots/usb_camera.yaml in the room of my_room.map.yaml.
//
// Two USB cameras, the lab's head and wheels: R 0.06 m, d 0.12 m, s 0.30 m.
//
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.

#version 3.7;
#include "room.inc"
#include "../parts/robot.inc"

// The head in metres, as in `rig:` of the robot file. Direction is the focal length divided by the image's height.
#declare Lens_Height = 0.25;
#declare Rim = 0.06;
#declare Lens_To_Tip = 0.12;
#declare Separation = 0.30;
#declare Direction = 1.475;

union {
  //*PMName robot
  object { Robot_Body }
  cylinder { Robot_Up(0.179) Robot_Up(0.20) 1.0 texture { Robot_Dark } }
  object { Robot_Camera translate Robot_Up(Lens_Height - 0.005) }
  object { Robot_Cone(Rim, 90) translate Robot_Up(Lens_Height + Lens_To_Tip) }
  object { Robot_Camera translate Robot_Up(Lens_Height + Separation - 0.005) }
  object { Robot_Cone(Rim, 90) translate Robot_Up(Lens_Height + Separation + Lens_To_Tip) }
  object { Robot_Arm(Lens_Height + Lens_To_Tip + Rim + 0.03) }
  object { Robot_Arm(Lens_Height + Separation + Lens_To_Tip + Rim + 0.02) }
  cylinder { <-2.6, 0.179*M, 0> <-2.6, (Lens_Height + Separation + Lens_To_Tip + Rim + 0.03)*M, 0> 0.08
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
