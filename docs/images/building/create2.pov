// SPDX-License-Identifier: Apache-2.0
#version 3.7;
#include "my_room/create2.pov"
#include "robots.inc"
