// SPDX-License-Identifier: Apache-2.0
// Renders fast: a floor, three coloured cylinders, and a robot that is little more than two cone mirrors.
// 1 unit = 0.05 m; world (x, y, z) in metres is <x, z, y> * 20.
#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 3 }
#default { finish { ambient 0.4 diffuse 0.6 } }
background { color rgb <0.5, 0.6, 0.7> }
light_source { <10, 60, -20> color rgb 1 shadowless }
plane { y, 0 pigment { checker color rgb 0.3 color rgb 0.6 scale 10 } }
cylinder { <40, 0, 10> <40, 20, 10> 2 pigment { color rgb <1, 0, 0> } }
cylinder { <-30, 0, 30> <-30, 20, 30> 2 pigment { color rgb <0, 1, 0> } }
cylinder { <5, 0, -45> <5, 20, -45> 2 pigment { color rgb <0, 0, 1> } }
#declare Mirror = cone {
  <0, 0, 0>, 0 <0, 1.2, 0>, 1.2
  pigment { color rgb 0 } finish { ambient 0 diffuse 0 reflection 1 }
}
union {
  //*PMName robot
  cylinder { <0, 0.2, 0> <0, 3, 0> 3 pigment { color rgb 0.2 } }
  object { Mirror translate <0, 7.4, 0> }
  object { Mirror translate <0, 13.4, 0> }
}
camera {
  //*PMName lower
  location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
