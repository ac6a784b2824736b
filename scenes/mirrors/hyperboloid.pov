// SPDX-License-Identifier: Apache-2.0
//
// hyperboloid.pov : the room of parts/room.inc seen with hyperbolic mirrors, each with its lens in the mirror's focus.
//
// The mirror has a single viewpoint: before its reflection every ray points to the other focus, 0.10 m above the lens.
// The image extends from straight down, where the robot sees itself, to 12 degrees above the horizon at the rim.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

#declare Rim = 0.08;                                           // metres, as the following
#declare Half_Axis = 0.03;                                     // a of y^2/a^2 - r^2/b^2 = 1
#declare Half_Focal = 0.05;                                    // c, half the distance of the foci; b = 0.04
#declare Rim_Height = Half_Focal + Half_Axis*sqrt(1 + Rim*Rim/(Half_Focal*Half_Focal - Half_Axis*Half_Axis));
// The rim's circle fills 236/240 of the image's height.
#declare Up_Look = <0, 118/240*Rim_Height/Rim, 0>;

union {
  //*PMName robot
  object { Robot_Body }
  object { Robot_Camera translate Robot_Up(0.249) }
  object { Robot_Hyperboloid(Half_Axis, Half_Focal, Rim) translate Robot_Up(0.25) }
  cylinder { Robot_Up(0.37) Robot_Up(0.46) 0.16 texture { Robot_Alu } }
  object { Robot_Camera translate Robot_Up(0.549) }
  object { Robot_Hyperboloid(Half_Axis, Half_Focal, Rim) translate Robot_Up(0.55) }
  cylinder { Robot_Up(0.67) Robot_Up(0.73) 0.16 texture { Robot_Alu } }
  object { Robot_Mast(0.74) }
  object { Robot_Arm(0.42) }
  object { Robot_Arm(0.73) }
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
