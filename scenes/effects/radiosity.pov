// SPDX-License-Identifier: Apache-2.0
//
// radiosity.pov : plain.pov with diffuse light between surfaces.

#version 3.7;
global_settings {
  assumed_gamma 1.0
  max_trace_level 4
  radiosity { pretrace_start 0.08 pretrace_end 0.04 count 12 nearest_count 3 error_bound 1.5 recursion_limit 1 }
}
#include "parts.inc"

background { color rgb 0.75 }
light_source { W(-1.0,  0.6, 2.1) color rgb 0.57 shadowless }
light_source { W( 1.1, -0.6, 2.1) color rgb 0.57 shadowless }
object { Room }
object { Pillars }
object { Post }

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
