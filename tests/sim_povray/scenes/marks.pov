// SPDX-License-Identifier: Apache-2.0
// Marks at known places, each of its own colour, without light or shadow. Tests of geometry look for them.
// 1 unit = 0.05 m; world (x, y, z) in metres is <x, z, y> * 20. The robot stands at (0.31, -0.47), heading 0.83 rad.
#version 3.7;
global_settings { assumed_gamma 1 }
#default { finish { ambient 1 diffuse 0 } }
#include "marks.inc"
#declare Heading = 0.83;
#declare Ahead = <cos(Heading), 0, sin(Heading)>;
#declare Right = <sin(Heading), 0, -cos(Heading)>;

// A mark on the robot, 0.9 m ahead of its origin and 0.25 m above the camera.
#if (1)
merge {
  //*PMName robot
  sphere { W(0.31, -0.47, 0.5) + Ahead * 18, 0.6 pigment { color rgb <0, 0, 1> } }
}
#end

// A pinhole that looks along the robot's heading.
camera {
  //*PMName lower
  location W(0.31, -0.47, 0.25)
  direction Ahead
  up y
  right Right * 4/3
  // the matrix must not land in here }
}

// Marks in the room.
sphere { W(2.1, 1.4, 0.4), 2.0 pigment { color rgb <1, 0, 0> } }
box { W(-2.2, -1.3, 0) W(-1.8, -1.1, 0.5) pigment { color rgb <0, 1, 0> } }
box { W(-2.2, 1.1, 1.2) W(-1.8, 1.3, 1.3) pigment { color rgb <1, 1, 0> } }
box { W(1.0, -1.5, 0) W(1.2, -0.9, 0.5) pigment { color rgb <1, 0, 1> } }

// Another camera, which tests must not use although it is the last in the file.
camera { location <0, 100, 0> look_at <0, 101, 1> } // and a comment without a line end