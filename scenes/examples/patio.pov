// SPDX-License-Identifier: Apache-2.0
//
// patio.pov : the robot in the courtyard of POV-Ray's example patio-radio_37.pov (Debian's package povray-examples),
// which is lit by the sun and, through radiosity, by all sunlit surfaces.
//
// SCALE  1 POV-Ray unit = 1 cm: the courtyard is 9.8 m wide, its columns 3 m high.
// The example is unchanged; its own camera is not used, because another one follows.

#version 3.7;
#include "/usr/share/doc/povray/examples/radiosity/patio-radio_37.pov"
#include "../parts/robot.inc"

#declare Robot_Scale = 0.05/0.01;

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
  translate <-200, 0, 100>
}
camera {
  //*PMName lower
  perspective location Robot_Up(0.25) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <-200, 0, 100>
}
camera {
  //*PMName upper
  perspective location Robot_Up(0.55) direction 1.475*y up <0, 0, -1> right <4/3, 0, 0>
  scale Robot_Scale
  translate <-200, 0, 100>
}
// View from under the eastern arches. The last camera is the default.
camera {
  //*PMName outside
  perspective location <150, 140, -150> right x*image_width/image_height up y angle 70 look_at <-220, 70, 120>
}
