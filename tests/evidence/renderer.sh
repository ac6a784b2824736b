#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The native renderer against POV-Ray: pixels at random poses, processor time, and what falls back.
. "$(dirname "$0")/common.sh"

bench=build/release/bench/native_bench
poses=${TWOCONE_RENDERER_POSES:-100}

# of STEP KEY: a figure of native_bench
of() { jq -r ".[0].$2 // empty" "$work/$1.json" 2>/dev/null || true; } # nothing if it was not run
fixed() { LC_ALL=C printf "%.$1f" "${2:-0}"; }
percent() { if [ -n "$1" ]; then fixed 4 "$(jq -n "100 * $1")"; else echo "not run,"; fi; }

for robot in {lab,hall,workshop,create2,pi_csi,usb_camera}_sim pair/{one,two} mirrors/{cone120,hyperboloid,three_cameras} effects/{plain,shadows,noisy}; do
  name=plain_${robot//\//_}
  step "$name" "$bench" --poses "$poses" --frames 8 --json "$work/$name.json" "robots/$robot.yaml"
  off=$(of "$name" different_worst)
  row "$robot, 640x480 plain: mirror pixels off by more than one level, in $(of "$name" images) images at random poses" \
    "mean $(percent "$(of "$name" different_mean)") %, worst $(percent "$off") %" "at most 0.1 %" "$(holds "${off:-1} <= 0.001")"
done
for target in lab:15 hall:12 workshop:12; do
  name=plain_${target%:*}_sim
  ratio=$(of "$name" ratio)
  row "${target%:*}, 640x480 plain: processor time of a stereo frame against POV-Ray's with the program's own pool, medians of five" \
    "$(fixed 1 "$ratio") times less: $(fixed 1 "$(of "$name" native_ms)") ms, POV-Ray $(fixed 0 "$(of "$name" povray_ms)") ms" \
    "at least ${target#*:} times" "$(holds "${ratio:-0} >= ${target#*:}")"
done

for robot in lab hall workshop; do
  name=smoothed_$robot
  step "$name" "$bench" --antialias 3 --poses $((poses / 5)) --frames 2 --json "$work/$name.json" "robots/${robot}_sim.yaml"
  off=$(of "$name" different_worst)
  row "$robot, 640x480, 3x3 rays: mirror pixels off by more than one level" \
    "worst of $(of "$name" images) images $(percent "$off") %; $(fixed 1 "$(of "$name" ratio)") times less processor time" "at most 0.5 %" "$(holds "${off:-1} <= 0.005")"
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
wall() { jq -r .wall_s "$work/run_$1/summary.json" 2>/dev/null || echo 0; } # 0 if it was not run
ratio=$(jq -n "$(wall povray) / $(wall auto)" 2>/dev/null || echo 0)
row "the demo's run of 450 frames, against --renderer povray" "$(fixed 1 "$ratio") times shorter: $(fixed 0 "$(wall auto)") s, $(fixed 0 "$(wall povray)") s" "at least 4 times" "$(holds "$ratio >= 4")"

step asan_build bash -c 'cmake --preset asan -D TWOCONE_BUILD_FUZZERS=ON && cmake --build --preset asan --target scene_fuzz'
step fuzz build/asan/tests/fuzz/scene_fuzz 500000 7 scenes/lab.pov scenes/hall.pov tests/fuzz/keywords.pov tests/sim_povray/scenes/tiny.pov
row "mutated scenes, read, evaluated and traced; AddressSanitizer and UndefinedBehaviorSanitizer" "$(tail -n 1 "$work/fuzz.log")" "half a million, no crash" "$(passed fuzz)"

block "Plain" "$(tail -qn 1 "$work"/plain_*.log)"
block "Smoothed" "$(tail -qn 1 "$work"/smoothed_*.log)"
page "the native renderer"
