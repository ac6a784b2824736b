// SPDX-License-Identifier: Apache-2.0
// An area light with jitter. Only one thread renders the same pixels every time.
#version 3.7;
global_settings { assumed_gamma 1 }
light_source { <10, 20, -10> color rgb 1 area_light <6, 0, 0>, <0, 0, 6>, 5, 5 adaptive 1 jitter }
plane { y, 0 pigment { color rgb 0.8 } }
union {
  //*PMName robot
  sphere { <0, 3, 0>, 2 pigment { color rgb <0.9, 0.4, 0.2> } }
}
camera {
  //*PMName lower
  location <0, 12, -14> look_at <0, 1, 0>
}
