#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# povray_examples.bash TWOCONE FOLDER [JOBS]: renders every scene of Debian's package povray-examples by itself and through a wrapper
# with a robot in it, at 80 x 60 pixels, for at most 60 s each. Finished scenes are not rendered again, so the same command resumes.
# FOLDER/list.tsv has a line for each scene: the result by itself, the result through the wrapper, and the reason where this fails.
# TWOCONE_EXAMPLES=REGEX: only these scenes.
set -euo pipefail
program=$(realpath "$1")
folder=$2
jobs=${3:-2}
examples=/usr/share/doc/povray/examples
limit=60
[ -d "$examples" ] || { echo "no $examples: apt install povray-examples" >&2; exit 1; }
mkdir -p "$folder/done" "$folder/trials"
folder=$(realpath "$folder")
# Scenes that write files write them to this folder when they are rendered by themselves.
[ -d "$folder/alone" ] || { cp -r "$examples" "$folder/alone.part" && mv "$folder/alone.part" "$folder/alone"; }
snapshot() { find "$examples" -printf '%p %s %T@\n' | sort; }
snapshot >"$folder/before.txt"

wrapper() { # wrapper SCENE FOLDER: writes a wrapper with a robot of two mirrors at the scene's origin
  cat >"$2/scene.pov" <<POV
#include "$1"
#version 3.7;
#default { normal { bumps 0 } } // one scene leaves a default without a kind of bumps
#declare Wrapper_Mirror = texture { pigment { color rgb 0 } finish { ambient 0 diffuse 0 reflection 0.9 } }
union {
  //*PMName robot
  cone { <0, 7.4, 0>, 0, <0, 8.6, 0>, 1.2 texture { Wrapper_Mirror } }
  cone { <0, 13.4, 0>, 0, <0, 14.6, 0>, 1.2 texture { Wrapper_Mirror } }
}
camera {
  //*PMName lower
  perspective location <0, 5, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
camera {
  //*PMName upper
  perspective location <0, 11, 0> direction <0, 1.475, 0> up <0, 0, -1> right <4/3, 0, 0>
}
POV
  cat >"$2/map.yaml" <<YAML
scene: scene.pov
scene_paths: [$examples]
unit_m: 0.05
bounds_m: {x: [-50, 50], y: [-50, 50]}
landmarks:
  - {name: red, colour: [1, 0, 0], x_m: 40, y_m: 40, radius_m: 0.1, top_m: 1}
YAML
  cat >"$2/robot.yaml" <<YAML
name: wrapped
map: map.yaml
start: {x_m: 0, y_m: 0, heading_rad: 0}
body: {radius_m: 0.2}
drive: {driver: sim_povray, wheel_separation_m: 0.3, wheel_radius_m: 0.05, max_speed_mps: 0.5}
cameras:
  lower: {driver: sim_povray, width_px: 80, height_px: 60, rate_hz: 15}
  upper: {driver: sim_povray, width_px: 80, height_px: 60, rate_hz: 15}
rig:
  mirror: {type: cone, apex_rad: 1.5708}
  mirror_radius_m: 0.06
  lens_to_tip_m: 0.12
  lens_height_m: 0.25
  mirror_separation_m: 0.30
  lower: {centre_px: [39.5, 29.5], rim_radius_px: 29.5, azimuth_rad: 0}
  upper: {centre_px: [39.5, 29.5], rim_radius_px: 29.5, azimuth_rad: 0}
YAML
}

seconds() { awk -v a="$1" -v b="$2" 'BEGIN { printf "%.1f", b - a }'; }

one() { # one SCENE: renders a scene and writes its line
  local name=${1#"$examples/"} key begin status alone wrapped reason=""
  key=${name//\//__}
  local into=$folder/done/$key.tsv dir=$folder/trials/$key
  [ ! -s "$into" ] || return 0
  rm -rf "$dir" && mkdir -p "$dir"
  begin=$EPOCHREALTIME status=0
  (cd "$folder/alone/$(dirname "$name")" &&
    timeout -k 5 $limit povray "+I$(basename "$name")" +W80 +H60 -D -V +WT1 +FP "+O$dir/alone.ppm") >"$dir/alone.log" 2>&1 </dev/null || status=$?
  alone="$(seconds "$begin" "$EPOCHREALTIME") s"
  [ $status != 124 ] || alone="no: more than $limit s"
  [ $status = 0 ] || [ $status = 124 ] || alone="no: $(grep -m1 -E 'Error|error' "$dir/alone.log" | tr '\t' ' ' | cut -c1-100)"
  wrapper "$1" "$dir"
  begin=$EPOCHREALTIME status=0
  timeout -k 5 $limit "$program" run --robot "$dir/robot.yaml" --frames 1 --behaviour still --out "$dir/run" >"$dir/run.log" 2>&1 </dev/null || status=$?
  wrapped="$(seconds "$begin" "$EPOCHREALTIME") s"
  if [ $status = 124 ] || [ $status = 137 ]; then
    wrapped=no reason="more than $limit s for the mirrors and the images of both cameras"
  elif [ $status != 0 ]; then
    wrapped=no reason=$(grep '^twocone: ' "$dir/run.log" | tail -n 1 | sed "s|^twocone: ||; s|$dir/||g" | tr '\t' ' ')
    [ -n "$reason" ] || reason="status $status: $(tail -n 1 "$dir/run.log" | tr '\t' ' ')"
  fi
  # Files other than those written above and the run folder.
  local extra
  extra=$(cd "$dir" && find . -type f ! -path './run/*' ! -name 'alone.*' ! -name '*.log' ! -name 'scene.pov' ! -name '*.yaml' | tr '\n' ' ')
  rm -rf "$dir/run"
  printf '%s\t%s\t%s\t%s\t%s\n' "$name" "$alone" "$wrapped" "$reason" "${extra:+wrote $extra}" >"$into.part"
  mv "$into.part" "$into"
}
export -f one wrapper seconds
export program folder examples limit
find "$examples" -name '*.pov' | LC_ALL=C sort | grep -E "${TWOCONE_EXAMPLES:-.}" | xargs -d '\n' -P "$jobs" -I{} bash -c 'set -euo pipefail; one "$1"' _ {}

LC_ALL=C sort "$folder"/done/*.tsv >"$folder/list.tsv"
snapshot >"$folder/after.txt"
awk -F'\t' '
  $2 !~ /^no/ { alone++ }
  $2 !~ /^no/ && $3 != "no" { both++ }
  $2 !~ /^no/ && $3 == "no" { failed++; if ($4 == "") unnamed++; print "fails through the wrapper: " $1 ": " $4 }
  $2 ~ /^no/ { never++ }
  $5 != "" { wrote++ }
  END {
    printf "scenes %d\nalone %d\nwrapped %d\nfailed %d\nunnamed %d\nnot_alone %d\nwrote %d\n", NR, alone, both, failed, unnamed, never, wrote
  }' "$folder/list.tsv"
if cmp -s "$folder/before.txt" "$folder/after.txt"; then echo "examples unchanged"; else echo "examples changed"; fi
