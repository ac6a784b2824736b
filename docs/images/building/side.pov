// SPDX-License-Identifier: Apache-2.0
// The USB-camera robot from its right side, with what `rig:` calls its lengths.
#version 3.7;
#include "my_room/usb_camera.pov"

#declare Ink = texture { pigment { color rgb 0 } finish { ambient 1 diffuse 0 } }
// Instead of the room
box { <-40, 0.001, 7> <40, 60, 7.2> pigment { color rgb 0.93 } finish { ambient 0.9 diffuse 0 } no_shadow no_reflection }
#declare Near = -2.2;    // the drawing stands before the robot, towards the onlooker
#macro At(X, Z) <(X)*M, (Z)*M, Near> #end
#macro Line(X1, Z1, X2, Z2) cylinder { At(X1, Z1) At(X2, Z2) 0.03 texture { Ink } no_shadow } #end
// From the axis out to where the measure stands
#macro Level(Z, To) Line(0, Z, To, Z) #end
#macro Tick(X, Z) Line(X - 0.008, Z - 0.008, X + 0.008, Z + 0.008) #end
#macro Word(Text, X, Z)
  text { ttf "cyrvetic.ttf" Text 0.01 0 texture { Ink } no_shadow scale 0.62 translate At(X, Z) }
#end
#macro Height(X, Z1, Z2, Text)
  Line(X, Z1, X, Z2) Tick(X, Z1) Tick(X, Z2)
  Word(Text, X + 0.015, (Z1 + Z2)/2 - 0.012)
#end

Level(0.25, 0.37) Level(0.37, 0.37) Level(0.67, 0.28) Level(0.43, 0.16)
Line(0.27, 0.0, 0.37, 0.0)
Height(0.27, 0.37, 0.67, "s")
Height(0.36, 0.25, 0.37, "d")
Height(0.36, 0.0, 0.25, "lens height")
Line(0, 0.43, 0, 0.475) Line(0.06, 0.43, 0.06, 0.475) Line(0, 0.468, 0.06, 0.468) Tick(0, 0.468) Tick(0.06, 0.468)
Word("R", 0.022, 0.478)
// What comes in level leaves towards the lens: the axis as the mirrors have it
Word("upper cone", -0.42, 0.70) Line(-0.21, 0.705, -0.07, 0.705)
Word("upper camera", -0.46, 0.51) Line(-0.21, 0.515, -0.03, 0.515)
Word("lower cone", -0.42, 0.40) Line(-0.21, 0.405, -0.055, 0.405)
Word("lower camera", -0.46, 0.225) Line(-0.21, 0.23, -0.03, 0.23)
Word("mast", -0.32, 0.60) Line(-0.235, 0.605, -0.135, 0.605)

camera {
  orthographic
  location <-0.4, 7.9, -30>
  right 22.4*x
  up 16.8*y
  look_at <-0.4, 7.9, 0>
}
