// SPDX-License-Identifier: Apache-2.0
//
// fisheye.pov : the room of parts/room.inc seen by two fisheye lenses that look up, 0.37 m and 0.67 m above the floor:
// no mirror.
//
// The image radius is proportional to the angle from the vertical: 100 degrees, which is 10 below the horizon, at the
// edge of the circle, which fills the image's height. POV-Ray leaves the outside of the circle black.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

union {
  //*PMName robot
  object { Robot_Body }
  object { Robot_Camera translate Robot_Up(0.369) }
  object { Robot_Camera translate Robot_Up(0.669) }
  object { Robot_Mast(0.60) }
  object { Robot_Arm(0.29) }
  object { Robot_Arm(0.59) }
}
camera {
  //*PMName lower
  fisheye location Robot_Up(0.37) direction y up <0, 0, -1> right <4/3, 0, 0> angle 200
}
camera {
  //*PMName upper
  fisheye location Robot_Up(0.67) direction y up <0, 0, -1> right <4/3, 0, 0> angle 200
}
