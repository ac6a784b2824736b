#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The simulator: speed against plain use of POV-Ray, embedded against served, killing, effects, physics, broken input.
. "$(dirname "$0")/common.sh"

bench=build/release/bench/render_bench
# Plain use of POV-Ray (one povray after another) is timed on every third frame and scaled, because it takes half an hour.
obvious_frames=${TWOCONE_OBVIOUS_FRAMES:-150}
step render_bench "$bench" --frames 450 --obvious-frames "$obvious_frames" --json "$work/render_bench.json"
of() { jq -r "$1" "$work/render_bench.json"; }
log=$work/render_bench.log
timed_on=$(sed -n 's/.*timed on \([0-9]*\) of them.*/\1/p' "$log")
recorded=$(sed -n 's/^ *povray, one after another *[0-9.]* *\([0-9.]*\) x/\1/p' "$log" | sed -n 1p)
twice=$(sed -n 's/^ *povray, two at once *[0-9.]* *\([0-9.]*\) x/\1/p' "$log" | sed -n 1p)
loop=$(sed -n 's/^ *povray, one after another *[0-9.]* *\([0-9.]*\) x/\1/p' "$log" | sed -n 2p)
loop_twice=$(sed -n 's/^ *povray, two at once *[0-9.]* *\([0-9.]*\) x/\1/p' "$log" | sed -n 2p)
row "450 recorded stereo frames, 640x480, against one povray after another (timed on $timed_on of them)" "$recorded times faster; against two at once $twice" "at least 6 times" "$(holds "${recorded:-0} >= 6")"
row "closed loop, 320x240, against one povray after another: median latency of a frame" "$loop times lower; against two at once $loop_twice" "at least 6 times" "$(holds "${loop:-0} >= 6")"
plain=$(sed -n 's/.*differ, in [0-9]* images: \([0-9]*\) from.*/\1/p' "$log")
bm2=$(sed -n 's/.* \([0-9]*\) from povray +BM2.*/\1/p' "$log")
images=$(sed -n 's/.*differ, in \([0-9]*\) images.*/\1/p' "$log")
row "pixels inside the mirrors that differ from plain use of POV-Ray, of $images images" "$bm2 with the same bounding (+BM2); $plain with POV-Ray's default bounding, which chooses differently among surfaces in one place (docs/renderers.md)" "0" "$(holds "${bm2:-1} == 0 && ${plain:-1} == 0")"
memory=$(sed -n 's/^most memory.*: \([0-9]*\) MiB.*/\1/p' "$log")
row "memory of all processes together" "$memory MiB" "below 1024 MiB" "$(holds "${memory:-9999} < 1024")"

if [ ! -f "$work/demo.status" ]; then rm -rf "$work/demo"; fi
step demo ./demo.sh --frames 450 --out "$work/demo"
wall=$(jq -r '.wall_s | round' "$work/demo/summary.json" 2>/dev/null || echo 9999)
row "the demo's 450 frames" "$wall s" "at most 150 s on two cores" "$(holds "$wall <= 150")"

step served tests/end_to_end/served.sh "$twocone" "$PWD" robots/lab_sim.yaml scenes/lab.map.yaml 60
row "embedded and served, 60 frames of the lab at 640x480" "$(grep '^byte-equal' "$work/served.log" || tail -n 1 "$work/served.log")" "byte-equal" "$(passed served)"
step pair tests/end_to_end/pair.sh "$twocone" "$PWD" 30
row "two programs, two robots, one world" "$(grep '^each robot sees' "$work/pair.log" || tail -n 1 "$work/pair.log")" "each sees the other move" "$(passed pair)"
step serve_kill tests/end_to_end/serve_kill.sh "$twocone" "$PWD" 50 1
row "killing server or client (kill -9) at random times" "$(grep ' killed, noticed within .* at most' "$work/serve_kill.log" || tail -n 1 "$work/serve_kill.log")" "50 times; no hang over 2 s, nothing remains, the server continues" "$(passed serve_kill)"

for name in plain shadows glass area_light radiosity noisy; do
  step "effects_$name" "$twocone" effects --robot "robots/effects/$name.yaml" --verify
  on=$(awk '{ for (i = 1; i < NF; ++i) if ($i == "on" && $(i + 1) ~ /:/) print }' "$work/effects_$name.log" | sed 's/^\(rendering\|camera\|motion\)//; s/  *on  .*//; s/^ *//' | paste -sd, | sed 's/,/, /g')
  differ=$(awk '/^(lower|upper) /{ print $1 ": " $3 " of " $2 " pixels differ" }' "$work/effects_$name.log" | paste -sd';')
  none=$(awk '/^(lower|upper) / && $3 != 0 { bad = 1 } /^(lower|upper) / { n++ } END { print (n == 2 && !bad) ? "yes" : "no" }' "$work/effects_$name.log")
  row "effects of $name" "on: $on; $differ" "the table is right, --verify agrees" "$none"
done

for name in chess wineglass patio; do
  if [ ! -f "$work/example_$name.status" ]; then rm -rf "$work/example_$name"; fi
  step "example_$name" "$twocone" run --robot "robots/examples/$name.yaml" --frames 3 --behaviour still --out "$work/example_$name"
  row "POV-Ray's own example $name, with the robot in it" "$(find "$work/example_$name" -name '0*.png' 2>/dev/null | wc -l) images" "renders and runs" "$(passed "example_$name")"
done

step physics build/release/tests/sim_povray/sim_povray_test --gtest_filter='*Physics*:*Friction*:*Contact*:*Moving*'
row "momentum and friction against closed-form answers, contact, a robot that leaves a wall" "$(grep -E '^\[  PASSED' "$work/physics.log") ($(grep -c '^\[       OK' "$work/physics.log") listed below)" "all pass" "$(passed physics)"

step scene_fuzz build/release/tests/fuzz/scene_fuzz 1000000 1 scenes/lab.pov scenes/effects/glass.pov scenes/effects/parts.inc tests/sim_povray/scenes/tiny.pov
row "truncated and garbage scenes" "$(tail -n 1 "$work/scene_fuzz.log")" "a million inputs, no crash" "$(passed scene_fuzz)"
step link_fuzz build/release/tests/fuzz/link_fuzz 20000 1
row "messages with wrong lengths and garbage" "$(tail -n 1 "$work/link_fuzz.log")" "refused, no crash" "$(passed link_fuzz)"
step broken tests/end_to_end/broken_world.sh "$twocone" "$PWD"
row "a full /dev/shm, an unreadable include" "$(grep -c '^ok' "$work/broken.log") cases, listed below" "one clear line, no loss" "$(passed broken)"

block "Rendering against plain use of POV-Ray" "$(cat "$log")"
block "Effects of the lab" "$("$twocone" effects --robot robots/lab_sim.yaml)"
block "Effects of a noisy, moving camera, verified" "$(cat "$work/effects_noisy.log")"
block "Physics and contact" "$(grep -E '^\[       OK' "$work/physics.log" | sed 's/^\[       OK \] //')"
block "Broken worlds" "$(cat "$work/broken.log")"
page "the simulator"
