#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Renders the images of docs/building-a-robot.md again.
set -euo pipefail
cd "$(dirname "$0")/../.."
render() { # render VIEW OUT WIDTH HEIGHT OPTION...
  local view=$1 out=$2 width=$3 height=$4
  shift 4
  povray +I"docs/images/building/$view.pov" +Lscenes +Lscenes/my_room +Ldocs/images/building "$@" \
    +W"$width" +H"$height" +FJ88 -D -GA +O"docs/images/building/$out.jpg" 2>/dev/null
}
smooth=(+A0.1 +AM2 +R3)
render side side 960 720 "${smooth[@]}"
render pi_csi pi_csi 480 480 "${smooth[@]}"
render create2 create2 480 480 "${smooth[@]}"
render mirror good 480 360 "${smooth[@]}" Declare=Ring=1
render mirror off_axis 480 360 "${smooth[@]}" Declare=Ring=1 Declare=Shift=0.008
render mirror tilted 480 360 "${smooth[@]}" Declare=Ring=1 Declare=Tilt=3
# Blur takes its samples itself.
render mirror focused_near 480 360 -A Declare=Focus=0.13
render mirror focused_right 480 360 -A Declare=Focus=0.4
render mirror dark 480 360 "${smooth[@]}" Declare=Light=0.06
render mirror bright 480 360 "${smooth[@]}" Declare=Light=4
