// SPDX-License-Identifier: Apache-2.0
// Plan of the laboratory, orthographic, from just under the lamp fittings:
// world x to the right, world y upwards. Render with +Lscenes.
// The image is 5.4 m high, so at 4:3 one metre is 1/5.4 of its height.
#version 3.7;
#include "lab.pov"
camera {
  orthographic
  location <0, 50.9, 0>
  direction <0, -1, 0>
  up <0, 0, 108>
  right <108*image_width/image_height, 0, 0>
}
