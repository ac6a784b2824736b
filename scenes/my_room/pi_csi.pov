// SPDX-License-Identifier: Apache-2.0
//
// pi_csi.pov : the robot of robots/pi_csi.yaml in the room of my_room.map.yaml.
//
// Two Camera Modules 2 with wide lenses, so that the mirrors are small and low: R 0.05 m, d 0.062 m, s 0.25 m.
//
// NAMES  robot, lower, upper and outside, as in lab.pov; the robot stands at the world's origin, heading along x.

#version 3.7;
#include "room.inc"
#include "../parts/robot.inc"

// The head in metres, as in `rig:` of the robot file. Direction is the focal length divided by the image's height.
#declare Lens_Height = 0.22;
#declare Rim = 0.05;
#declare Lens_To_Tip = 0.062;
#declare Separation = 0.25;
#declare Direction = 1.102;

union {
  //*PMName robot
  object { Robot_Body scale <0.75, 1, 0.75> }
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
