#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# twocone new: the files that it writes for a small scene and for the lab run as they are, and give fixes.
#   new_scene.sh TWOCONE SOURCE_DIR
. "$(dirname "$0")/common.sh"

mkdir "$work/theirs"
cp "$source_dir/scenes/lab.pov" "$work/theirs/lab.pov" # without its map
cat >"$work/theirs/yard.inc" <<'POV'
#declare Stone = superellipsoid { <0.3, 0.3> pigment { granite } }
POV
cat >"$work/theirs/yard.pov" <<'POV'
#version 3.7;
global_settings { assumed_gamma 1 }
#include "yard.inc"
camera { location <0, 1, -9> look_at <0, -2, 0> }
light_source { <20, 40, -10> rgb 1 }
background { rgb 0.6 }
plane { y, -2 pigment { checker rgb 0.3 rgb 0.5 } }
object { Stone translate <4, -1, 3> }
sphere { <-3, -1, 4>, 1 pigment { rgb <0.8, 0.1, 0.1> } }
POV

# makes SCENE FIXES [OPTION...]: makes a robot in the scene and requires that number of fixes in its first frames
makes() {
  local name=$1 fixes=$2
  shift 2
  "$twocone" new "$work/theirs/$name.pov" --out "$work/new" "$@" >"$work/$name.found" || fail "new $name: exit $?"
  "$twocone" run --robot "$work/new/$name.yaml" --frames 2 --out "$work/run-$name" >"$work/$name.log" 2>&1 || fail "run $name: $(cat "$work/$name.log")"
  local ok
  ok=$(grep -c ',ok,' "$work/run-$name/fixes.csv")
  [ "$ok" -eq "$fixes" ] || fail "$name: $ok fixes, wanted $fixes: $(cat "$work/run-$name/fixes.csv")"
}
makes lab 2
grep -q 'red .*-2.4500  -0.3500 .*lab.pov:163' "$work/lab.found" || fail "lab: $(cat "$work/lab.found")"
grep -q added "$work/lab.found" && fail "landmarks were added to the lab: $(cat "$work/lab.found")"
makes yard 2 --unit-m 0.5
grep -q '^floor  *y = -2 units' "$work/yard.found" || fail "yard: $(cat "$work/yard.found")"
grep -q ' red ' "$work/yard.found" && fail "a red landmark was added beside a red sphere"
grep -q 'yard.inc:1: superellipsoid' "$work/yard.found" || fail "the stone's bounds are not named: $(cat "$work/yard.found")"
[ "$(find "$work/theirs" -type f | wc -l)" -eq 3 ] || fail "the folder of the scenes was changed"
finish
