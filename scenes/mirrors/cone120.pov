// SPDX-License-Identifier: Apache-2.0
//
// cone120.pov : the room of parts/room.inc seen with 120 degree cones, which show the floor as well as the walls.
//
// The tip of a cone of half angle a reflects the lens's rays to the elevation 90 - 2a, here -30 degrees; points farther
// out reflect them higher. The rim, 0.09 m in radius and 0.092 m above the lens, sees 14.4 degrees.
// robots/mirrors/cone120.yaml contains the same numbers.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

#declare Rim = 0.09;                                           // R, metres
#declare Lens_To_Tip = 0.04;                                   // d, metres
#declare Rim_Height = Lens_To_Tip + Rim/tan(radians(60));      // above the lens
// The rim's circle fills 236/240 of the image's height.
#declare Up_Look = <0, 118/240*Rim_Height/Rim, 0>;

union {
  //*PMName robot
  object { Robot_Body }
  object { Robot_Camera translate Robot_Up(0.249) }
  object { Robot_Cone(Rim, 120) translate Robot_Up(0.29) }
  cylinder { Robot_Up(0.35) Robot_Up(0.46) 0.16 texture { Robot_Alu } }
  object { Robot_Camera translate Robot_Up(0.549) }
  object { Robot_Cone(Rim, 120) translate Robot_Up(0.59) }
  cylinder { Robot_Up(0.65) Robot_Up(0.72) 0.16 texture { Robot_Alu } }
  object { Robot_Mast(0.73) }
  object { Robot_Arm(0.40) }
  object { Robot_Arm(0.72) }
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction Up_Look up <0, 0, -1> right <4/3, 0, 0>
}
