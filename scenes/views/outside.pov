// SPDX-License-Identifier: Apache-2.0
// The robot in its laboratory, seen by a person in the arena.
// Render with +Lscenes; POV-Ray uses the last camera.
#version 3.7;
#include "lab.pov"
camera {
  perspective
  location <16, 25, 25>          // world (0.80, 1.25, 1.25) m
  right x*image_width/image_height
  up y
  angle 82
  look_at <-2.4, 9.5, -4.4>
}
