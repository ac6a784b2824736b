// SPDX-License-Identifier: Apache-2.0
// Portrait of the robot: two decks, and above them the two cone mirrors,
// each over the camera that looks up into it. Render with +Lscenes.
#version 3.7;
#include "lab.pov"
camera {
  perspective
  location <20, 10.5, -11>       // world (1.00, -0.55, 0.525) m
  right x*image_width/image_height
  up y
  angle 54
  look_at <0, 7.3, 0>
}
