#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The native renderer against POV-Ray: pixels at random poses, processor time, and what falls back.
. "$(dirname "$0")/common.sh"

bench=build/release/bench/native_bench
poses=${TWOCONE_RENDERER_POSES:-100}

# of JSON ROBOT KEY: a figure of native_bench
of() { jq -r --arg robot "$2" ".[] | select(.robot == \$robot) | .$3" "$1" 2>/dev/null; }
fixed() { LC_ALL=C printf "%.$1f" "${2:-0}"; }

step plain "$bench" --poses "$poses" --frames 20 --json "$work/plain.json" robots/{lab,hall,workshop,create2,pi_csi,usb_camera}_sim.yaml \
  robots/pair/{one,two}.yaml robots/mirrors/{cone120,hyperboloid,three_cameras}.yaml robots/effects/{plain,shadows,noisy}.yaml
for robot in $(jq -r '.[].robot' "$work/plain.json" 2>/dev/null); do
  off=$(of "$work/plain.json" "$robot" different_worst)
  row "$robot, 640x480 plain: mirror pixels off by more than one level in $(of "$work/plain.json" "$robot" images) images at random poses" \
    "mean $(fixed 4 "$(jq -n "100 * $(of "$work/plain.json" "$robot" different_mean)")") %, worst $(fixed 4 "$(jq -n "100 * $off")") %" "at most 0.1 %" "$(holds "$off <= 0.001")"
done
for name in lab:15 hall:12 workshop:12; do
  robot=robots/${name%:*}_sim.yaml
  ratio=$(of "$work/plain.json" "$robot" ratio)
  row "$robot, 640x480 plain: processor time of a stereo frame against POV-Ray's, program's own pool, medians of five" \
    "$(fixed 1 "$ratio") times less: $(fixed 1 "$(of "$work/plain.json" "$robot" native_ms)") ms, POV-Ray $(fixed 0 "$(of "$work/plain.json" "$robot" povray_ms)") ms" \
    "at least ${name#*:} times" "$(holds "${ratio:-0} >= ${name#*:}")"
done

step smoothed "$bench" --antialias 3 --poses $((poses / 5)) --frames 3 --json "$work/smoothed.json" robots/{lab,hall,workshop}_sim.yaml
for robot in robots/{lab,hall,workshop}_sim.yaml; do
  off=$(of "$work/smoothed.json" "$robot" different_worst)
  row "$robot, 640x480, 3x3 rays: mirror pixels off by more than one level" \
    "worst image $(fixed 4 "$(jq -n "100 * ${off:-1}")") %; $(fixed 1 "$(of "$work/smoothed.json" "$robot" ratio)") times less processor time" "at most 0.5 %" "$(holds "${off:-1} <= 0.005")"
done

for scene in effects/area_light effects/radiosity effects/glass examples/chess examples/patio examples/wineglass; do
  name=${scene#*/}
  step "falls_back_$name" "$bench" --poses 1 --frames 1 --repeats 1 "robots/$scene.yaml"
  why=$(sed -n 's/^robots.*POV-Ray: //p' "$work/falls_back_$name.log")
  row "$scene is rendered by POV-Ray" "${why:-it is not}" "a construct that the tracer does not know" "$([ -n "$why" ] && echo yes || echo no)"
done

for renderer in auto povray; do
  if [ ! -f "$work/run_$renderer.status" ]; then rm -rf "$work/run_$renderer"; fi
  step "run_$renderer" "$twocone" run --robot robots/lab_sim.yaml --frames 450 --renderer "$renderer" --out "$work/run_$renderer"
done
wall() { jq -r .wall_s "$work/run_$1/summary.json" 2>/dev/null || echo 0; }
ratio=$(jq -n "$(wall povray) / $(wall auto)" 2>/dev/null || echo 0)
row "the demo's run of 450 frames, against --renderer povray" "$(fixed 1 "$ratio") times shorter: $(fixed 0 "$(wall auto)") s, $(fixed 0 "$(wall povray)") s" "at least 4 times" "$(holds "$ratio >= 4")"

step fuzz build/release/tests/fuzz/scene_fuzz 500000 7 scenes/lab.pov scenes/hall.pov scenes/workshop.pov tests/sim_povray/scenes/tiny.pov
row "mutated scenes, evaluated" "$(tail -n 1 "$work/fuzz.log")" "half a million, no crash" "$(passed fuzz)"

block "Plain" "$(cat "$work/plain.log")"
block "Smoothed" "$(cat "$work/smoothed.log")"
page "the native renderer"
