// SPDX-License-Identifier: Apache-2.0
//
// wineglass.pov : the robot before the glasses of POV-Ray's example wineglass.pov (Debian's package povray-examples).
//
// SCALE  1 POV-Ray unit = 3 cm: the standing glass is 1.1 m high.
// The example is unchanged; its own camera is not used, because another one follows.

#version 3.7;
#include "/usr/share/doc/povray/examples/advanced/wineglass.pov"
#include "../parts/robot.inc"
global_settings { max_trace_level 10 }   // a mirror, a glass and its wine need more than the example's 5

#declare Robot_Scale = 0.05/0.03;

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
  translate <-60, 0, -80>
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <-60, 0, -80>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <-60, 0, -80>
}
// View from the right, of the glass and the robot. The last camera is the default.
camera {
  //*PMName outside
  perspective location <40, 60, -120> right x*image_width/image_height up y angle 65 look_at <-25, 6, -40>
}
