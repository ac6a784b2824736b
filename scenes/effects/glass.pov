// SPDX-License-Identifier: Apache-2.0
//
// glass.pov : plain.pov with a glass ball and a tinted pane.

#version 3.7;
global_settings { assumed_gamma 1.0 max_trace_level 4 }
#include "parts.inc"

background { color rgb 0.75 }
light_source { W(-1.0,  0.6, 2.1) color rgb 0.57 shadowless }
light_source { W( 1.1, -0.6, 2.1) color rgb 0.57 shadowless }
object { Room }
object { Pillars }
object { Post }

sphere { W(0.9, -0.6, 0.60) 0.20*M
  pigment { color rgb 0.95 transmit 0.9 } finish { ambient 0 diffuse 0.1 } interior { ior 1.5 } }
box { W(-0.9, 0.5, 0.1) W(-0.3, 0.52, 0.7) pigment { color rgb <0.7, 0.8, 0.8> filter 0.6 } finish { F_Matt } }

union {
  //*PMName robot
  object { Body }
  object { Mirror translate 7.4*y }
  object { Upper_Camera }
  object { Mirror translate 13.4*y }
  object { Mast }
}
camera {
  //*PMName lower
  perspective location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
