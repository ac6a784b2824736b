// SPDX-License-Identifier: Apache-2.0
//
// panoramic.pov : the room of parts/room.inc unrolled: two cylindrical panoramas, 0.37 m and 0.67 m above the floor.
//
// The columns cover a full circle, clockwise from the robot's back over its left; the middle column looks ahead. Rows
// are tangents of elevation, to 38 degrees above and below the horizon, which is the middle row; pixels are square in
// an image four times as wide as high. A third camera, `front`, is POV-Ray's own panoramic one, 150 degrees wide.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

union {
  //*PMName robot
  object { Robot_Body }
  cylinder { Robot_Up(0.18) Robot_Up(0.365) 0.20 texture { Robot_Alu } }
  object { Robot_Mast(0.60) }
  object { Robot_Arm(0.60) }
  cylinder { Robot_Up(0.60) Robot_Up(0.665) 0.20 texture { Robot_Alu } }
}
camera {
  //*PMName lower
  cylinder 1 location Robot_Up(0.37) direction x up pi/2*y right -z angle 360
}
camera {
  //*PMName upper
  cylinder 1 location Robot_Up(0.67) direction x up pi/2*y right -z angle 360
}
camera {
  //*PMName front
  panoramic location Robot_Up(0.52) direction x up y right -4/3*z angle 150
}
