// SPDX-License-Identifier: Apache-2.0
// Radiosity, grainy surfaces and random numbers: state that a process could carry from one image to the next.
#version 3.7;
global_settings {
  assumed_gamma 1
  radiosity { pretrace_start 0.08 pretrace_end 0.02 count 60 error_bound 1 recursion_limit 2 }
}
#declare RandomDraws = seed(5);
light_source { <10, 20, -10> color rgb 0.6 }
plane { y, 0 pigment { checker color rgb 0.3 color rgb 0.8 scale 3 } finish { crand 0.2 } }
sphere { <4 + rand(RandomDraws), 3, 6 + rand(RandomDraws)>, 3 pigment { color rgb <0.9, 0.2, 0.1> } normal { bumps 0.5 } }
union {
  //*PMName robot
  sphere { <0, 3, 0>, 2 pigment { color rgb <0.9, 0.4, 0.2> } }
}
camera {
  //*PMName lower
  location <0, 12, -14> look_at <0, 1, 0>
}
