// SPDX-License-Identifier: Apache-2.0
// A scene with a mistake in line 10.
#version 3.7;
union {
  //*PMName robot
  sphere { 0, 1 pigment { color rgb 1 } }
}
camera {
  //*PMName lower
  location <0, 5, Bogus> look_at 0
}
