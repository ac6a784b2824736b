// SPDX-License-Identifier: Apache-2.0
//
// three_cameras.pov : the room of parts/room.inc and a robot with the lab's two 90 degree cones and a third camera,
// `front`, that looks ahead as ordinary cameras do.

#version 3.7;
#include "../parts/room.inc"
#include "../parts/robot.inc"

union {
  //*PMName robot
  object { Robot_Body }
  object { Robot_Camera translate Robot_Up(0.245) }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.37) }
  object { Robot_Camera translate Robot_Up(0.545) }
  object { Robot_Cone(0.06, 90) translate Robot_Up(0.67) }
  object { Robot_Mast(0.79) }
  object { Robot_Arm(0.49) }
  object { Robot_Arm(0.775) }
  cylinder { Robot_Up(0.74) Robot_Up(0.775) 0.16 texture { Robot_Alu } }
  object { Robot_Camera rotate -90*z translate <3.5, 4.2, 0> }     // looks ahead, its lens 0.21 m above the floor
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName front
  perspective location <3.51, 4.2, 0> direction x up y right -4/3*z angle 75
}
