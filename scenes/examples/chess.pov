// SPDX-License-Identifier: Apache-2.0
//
// chess.pov : the robot between the armies of POV-Ray's example chess2.pov (Debian's package povray-examples).
//
// SCALE  1 POV-Ray unit = 7.5 cm: a square of the board is 0.6 m, a king 1.0 m high, and the board's top the floor.
// The example is unchanged; its own camera is not used, because another one follows.

#version 3.7;
global_settings { assumed_gamma 2.2 }    // as in the example, which sets it later than POV-Ray expects
#include "/usr/share/doc/povray/examples/advanced/chess2.pov"
#include "../parts/robot.inc"

#declare Robot_Scale = 0.05/0.075;

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
  scale Robot_Scale
  translate <4, 0, -4>
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <4, 0, -4>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <4, 0, -4>
}
// View from above the right corner of the silver side. The last camera is the default.
camera {
  //*PMName outside
  perspective location <40, 30, -42> right x*image_width/image_height up y angle 55 look_at <0, 3, 0>
}
