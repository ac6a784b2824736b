// SPDX-License-Identifier: Apache-2.0
// What the lower camera of the USB-camera robot sees, and what it sees where something is not right:
//   Declare=Shift=M    the lens off the cone's axis, metres
//   Declare=Tilt=DEG   the camera turned about its lens
//   Declare=Focus=M    in focus at so many metres from the lens, with an aperture of 3 mm; 0: a pinhole
//   Declare=Ring=1     a cross on the tip, and about it a ring where the rim would be seen if all were right
//   Declare=Light=X    times the light that suits the exposure
#version 3.7;
#ifndef (Shift) #declare Shift = 0; #end
#ifndef (Tilt) #declare Tilt = 0; #end
#ifndef (Focus) #declare Focus = 0; #end
#ifndef (Ring) #declare Ring = 0; #end
#ifndef (Light) #declare Light = 1; #end
#include "my_room/usb_camera.pov"

#if (Light != 1)
  global_settings { ambient_light rgb Light }
  light_source { W(-0.7,  0.5, 2.25) color rgb 0.57*(Light - 1) }
  light_source { W( 1.1, -0.5, 2.25) color rgb 0.57*(Light - 1) }
#end
#if (Ring)
  // 0.10 m above the lens, on its line to the tip
  union {
    torus { 0.1*M*Rim/(Rim + Lens_To_Tip), 0.008 }
    cylinder { -0.1*x, 0.1*x, 0.006 }
    cylinder { -0.1*z, 0.1*z, 0.006 }
    pigment { color rgb 0 }
    finish { ambient 0 diffuse 0 }
    no_shadow no_reflection
    translate <Shift*(1 - 0.1/Lens_To_Tip)*M, (Lens_Height + 0.1)*M, 0>
  }
#end
camera {
  perspective
  location <0, 0, 0> direction <0, Direction, 0> up <0, 0, -1> right <4/3, 0, 0>
  #if (Focus)
    aperture 0.003*M
    focal_point <0, Focus*M, 0>
    blur_samples 120
    variance 0
  #end
  rotate Tilt*z
  translate <Shift*M, Lens_Height*M, 0>
}
