#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The two example programs, built from an installed package and nothing else, and driven in its lab.
also=(examples)
. "$(dirname "$0")/common.sh"
installed=$work/installed

build_from_package() {
  rm -rf "$installed"
  cmake --install build/release --prefix "$installed" >/dev/null || return 1
  for example in controller waypoints; do
    cmake -S "examples/$example" -B "$work/$example" -G Ninja -D CMAKE_PREFIX_PATH="$installed" -D CMAKE_BUILD_TYPE=Release &&
      cmake --build "$work/$example" || return 1
  done
}
step build build_from_package
# Lines of code between the braces of main: neither blank nor a comment alone.
lines=$(sed -n '/^int main/,/^} catch/p' examples/controller/controller.cpp | sed '1d;$d' | grep -cvE '^ *(//.*)?$')
row "code lines of the controller's main, with ranges, fixes and the drive" "$lines" "about 15" "$(holds "$lines <= 17")"
step controller "$work/controller/controller" "$installed/share/twocone/robots/lab_sim.yaml"
frames=$(grep -c ' m, at (' "$work/controller.log" || true)
row "controller: frames with ranges and a position, of 60" "$frames" "at least 57" "$(holds "$frames >= 57")"
step waypoints "$work/waypoints/waypoints" "$installed/share/twocone/robots/lab_sim.yaml" 300
off=$(sed -n 's/^off the path: rms \([0-9.]*\) mm.*/\1/p' "$work/waypoints.log")
row "waypoint follower by its own track, 300 frames: path error" "$(paste -sd';' "$work/waypoints.log" | sed 's/;/; /g')" "rms at most 20 mm" "$(holds "${off:-999} <= 20")"
block "The controller's first frames" "$(head -n 5 "$work/controller.log")"
page "programs built from the installed package"
