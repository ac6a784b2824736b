#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The native renderer against POV-Ray: pixels at random poses, processor time, and what falls back. Robots in scenes of other authors.
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

for threads in 2 4; do
  read -r one many <<<"$(jq -r ".[0].wall_ms | [.\"1\", .\"$threads\"] | @tsv" "$work/plain_lab_sim.json" 2>/dev/null || echo "0 0")"
  exponent=$(awk -v one="$one" -v many="$many" -v n="$threads" 'BEGIN { if (many > 0) printf "%.2f", log(many / one) / log(n) }')
  if [ "$threads" -le "$(nproc)" ]; then
    row "lab, 640x480 plain: wall time of a stereo frame with $threads threads against one" \
      "$(fixed 1 "$many") ms against $(fixed 1 "$one") ms, exponent ${exponent:-not run}" "exponent at most -0.8" "$(holds "${exponent:-0} <= -0.8")"
  fi
done

for robot in lab hall workshop; do
  name=smoothed_$robot
  step "$name" "$bench" --antialias 3 --poses $((poses / 5)) --frames 2 --json "$work/$name.json" "robots/${robot}_sim.yaml"
  off=$(of "$name" different_worst)
  row "$robot, 640x480, 3x3 rays: mirror pixels off by more than one level" \
    "worst of $(of "$name" images) images $(percent "$off") %; $(fixed 1 "$(of "$name" ratio)") times less processor time" "at most 0.5 %" "$(holds "${off:-1} <= 0.005")"
done

for scene in effects/area_light effects/radiosity effects/glass mirrors/fisheye mirrors/panoramic examples/chess examples/patio examples/wineglass; do
  name=${scene#*/}
  step "falls_back_$name" "$bench" --poses 1 --frames 1 --repeats 1 "robots/$scene.yaml"
  why=$(sed -n 's/^robots.*POV-Ray: //p' "$work/falls_back_$name.log")
  row "$scene is rendered by POV-Ray" "${why:-it is not}" "a construct that the tracer does not know" "$([ -n "$why" ] && echo yes || echo no)"
done

# No shipped scene has photons.
mkdir -p "$work/photons"
cp scenes/effects/parts.inc scenes/effects/plain.map.yaml "$work/photons"
sed 's/^global_settings {/& photons { count 1000 }/' scenes/effects/plain.pov >"$work/photons/plain.pov"
sed "s|\.\./\.\./scenes/effects/plain.map.yaml|$work/photons/plain.map.yaml|" robots/effects/plain.yaml >"$work/photons/plain.yaml"
step falls_back_photons "$bench" --poses 1 --frames 1 --repeats 1 "$work/photons/plain.yaml"
why=$(sed -n 's/^.*yaml *POV-Ray: //p' "$work/falls_back_photons.log")
row "the plain scene with photons is rendered by POV-Ray" "${why:-it is not}" "a construct that the tracer does not know" "$([ -n "$why" ] && echo yes || echo no)"
# bounded NAME: the scenes of docs/renderers.md with two surfaces in one place, by the three ways of bounding: prints the numbers of pixels
# that differ from those without bounding, with +BM2 and with the default.
bounded() {
  local how
  for how in +BM2 +BM1 -MB; do povray "+I$work/$1.pov" "+O$work/$1$how.ppm" +FP8 +W64 +H48 -A -D -V -GA $how 2>"$work/$1.errors" || return 1; done
  python3 - "$work/$1"{+BM2,+BM1,-MB}.ppm <<'PYTHON'
import sys
bm2, default, none = (open(f, "rb").read()[-64 * 48 * 3:] for f in sys.argv[1:])
print(*(sum(a[i:i + 3] != none[i:i + 3] for i in range(0, len(none), 3)) for a in (bm2, default)))
PYTHON
}
first='#version 3.7; global_settings { assumed_gamma 1 } #default { pigment { rgb 0.5 } finish { ambient 1 diffuse 0 } }'
cat >"$work/tree.pov" <<SCENE
$first
camera { location <37, 6, 0> direction z look_at <42, 8.6, 11> }
box { <40, 8, 11> <45, 9, 32> pigment { rgb <1, 0, 0> } } box { <40, 0, 11> <45, 25, 12> pigment { rgb <0, 0, 1> } }
box { <-45, -1, -35> <45, 0, 35> } box { <-45, 0, 10.4> <-42, 28, 12.4> } box { <-45, 0, 12.6> <-42, 28, 14.6> } cylinder { <42, 9, 14> <42, 12, 14> 1 }
SCENE
cat >"$work/boxes.pov" <<SCENE
$first
camera { location <1.5, 1, -8> look_at <1.5, 1, 0> }
box { <1, 0, 0> <3, 2, 1> pigment { rgb <0, 0, 1> } } box { 0 <2, 2, 1> pigment { rgb <1, 0, 0> } } sphere { <-3, 0, 0>, 0.5 }
SCENE
step bounded_tree bounded tree
row "POV-Ray's choice among surfaces in one place, six objects: pixels that differ from no bounding, with +BM2 and with the default" \
  "$(tail -n 1 "$work/bounded_tree.log")" "some with +BM2" "$(holds "$(sed -n 's/^\([0-9]*\) .*/\1/p' "$work/bounded_tree.log" | tail -n 1)+0 > 0")"
step bounded_boxes bounded boxes
row "the same, three objects" "$(tail -n 1 "$work/bounded_boxes.log")" "none with +BM2, some with the default" "$(holds "\"$(tail -n 1 "$work/bounded_boxes.log")\" ~ /^0 [1-9]/")"
step known_otherwise build/release/tests/sim_povray/sim_povray_test --gtest_filter='NativeRendererTest.AKnownConstructThatIsRenderedOtherwiseIsFound'
row "scenes of known constructs that POV-Ray shades otherwise: bounds that cut, the distance limit, coincident edges" "$(tail -n 1 "$work/known_otherwise.log")" "three, found by the check" "$(passed known_otherwise)"
step keywords build/release/tests/sim_povray/sim_povray_test --gtest_filter='*NativeKeywords*'
row "small scenes for each keyword, rendered by both" "$(grep -o '[0-9]* tests* from .* ran' "$work/keywords.log" || echo "not run")" "all agree" "$(passed keywords)"

# drive NAME RENDERER FRAMES OPTION...: drives a robot in $work/NAME_RENDERER. An interrupted run starts again, because its duration is a result.
drive() {
  local name=$1_$2 renderer=$2 frames=$3
  shift 3
  if [ ! -f "$work/$name.status" ]; then rm -rf "${work:?}/$name"; fi
  step "$name" "$twocone" run --renderer "$renderer" --frames "$frames" --out "$work/$name" "$@"
}
# compared NAME FILE KEYS COLUMN_A COLUMN_B: prints the number of rows that both runs have, the mean distance of the two points, and the greatest
compared() {
  python3 - "$work/$1_auto/$2" "$work/$1_povray/$2" "$3" "$4" "$5" <<'PYTHON' 2>/dev/null || echo "0 0 0" # not run
import csv, math, sys
files, keys, columns = sys.argv[1:3], sys.argv[3].split(","), sys.argv[4:6]
a, b = ({tuple(r[k] for k in keys): [float(r[c]) for c in columns] for r in csv.DictReader(open(f)) if r[columns[0]]} for f in files)
d = [math.dist(a[k], b[k]) for k in a if k in b]
print(len(d), sum(d) / len(d), max(d))
PYTHON
}
# agreement NAME WHAT: writes the rows on what the runs of both renderers found
agreement() {
  local name=$1 what=$2 fixes mean_m worst_m seen mean_px worst_px used
  used=$(sed -n 's/^renderer: //p' "$work/${name}_auto/run.yaml" 2>/dev/null || true)
  read -r fixes mean_m worst_m <<<"$(compared "$name" fixes.csv frame x_m y_m)"
  row "$what: distance of the fixes of both renderers (auto chose ${used:-nothing yet})" \
    "mean $(fixed 4 "$(jq -n "1e3 * $mean_m")") mm, greatest $(fixed 4 "$(jq -n "1e3 * $worst_m")") mm, of $fixes fixes" "native, mean at most 0.05 mm" \
    "$([ "$used" = native ] && holds "$fixes > 0 && $mean_m <= 5e-5" || echo no)"
  read -r seen mean_px worst_px <<<"$(compared "$name" sightings.csv frame,landmark,view column_px row_px)"
  row "$what: distance of the landmarks' fitted tops in the images of both renderers" \
    "mean $(fixed 4 "$mean_px") px, greatest $(fixed 4 "$worst_px") px, of $seen sightings" "at most 0.05 px" \
    "$([ "$used" = native ] && holds "$seen > 0 && $worst_px <= 0.05" || echo no)"
}
smooth=(--set cameras.lower.antialias=3 --set cameras.upper.antialias=3)
for renderer in auto povray; do
  drive run "$renderer" 450 --robot robots/lab_sim.yaml
  for robot in hall workshop; do drive "$robot" "$renderer" 100 --robot "robots/${robot}_sim.yaml"; done
  for robot in lab hall workshop; do drive "smooth_$robot" "$renderer" 60 --robot "robots/${robot}_sim.yaml" "${smooth[@]}"; done
done
wall() { jq -r .wall_s "$work/run_$1/summary.json" 2>/dev/null || echo 0; } # 0 if it was not run
ratio=$(jq -n "$(wall povray) / $(wall auto)" 2>/dev/null || echo 0)
row "the demo's run of 450 frames, against --renderer povray" "$(fixed 1 "$ratio") times shorter: $(fixed 0 "$(wall auto)") s, $(fixed 0 "$(wall povray)") s" "at least 4 times" "$(holds "$ratio >= 4")"
agreement run "the lab, plain"
for robot in hall workshop; do agreement "$robot" "the $robot, plain"; done
for robot in lab hall workshop; do agreement "smooth_$robot" "the $robot, 3x3 rays"; done

# sweep RENDERER: a sweep of the default size. An interrupted one starts again, because its duration is a result.
sweep() {
  if [ ! -f "$work/sweep_$1.status" ]; then rm -rf "$work/sweep_$1"; fi
  timed_sweep() {
    local begin=$SECONDS
    "$twocone" tradeoff --robot robots/lab_sim.yaml --renderer "$1" --out "$work/sweep_$1" || return 1
    echo $((SECONDS - begin)) >"$work/sweep_$1.seconds"
  }
  step "sweep_$1" timed_sweep "$1"
}
sweep auto
sweep povray
taken() { cat "$work/sweep_$1.seconds" 2>/dev/null || echo 0; } # 0 if it was not run
ratio=$(jq -n "$(taken povray) / $(taken auto)" 2>/dev/null || echo 0)
row "twocone tradeoff of the lab with its defaults, against --renderer povray" "$(fixed 1 "$ratio") times shorter: $(taken auto) s, $(taken povray) s" "at least 2.5 times" "$(holds "$ratio >= 2.5")"

# What the ground truth costs: the same run with it and without, by turns.
truth_times() {
  local what
  for what in without with without with without with; do
    rm -rf "$work/truth_run"
    local option=(--renderer native)
    [ "$what" = without ] || option+=(--truth)
    "$twocone" run --robot robots/lab_sim.yaml --frames 60 --out "$work/truth_run" "${option[@]}" || return 1
    echo "$what $(jq '.own_cpu_s, .wall_s' "$work/truth_run/summary.json" | paste -sd' ')" | tee -a "$work/truth.turns"
  done
  rm -rf "$work/truth_run"
}
[ -f "$work/truth.status" ] || rm -f "$work/truth.turns"
step truth truth_times
middle() { sed -n "s/^$1 //p" "$work/truth.turns" 2>/dev/null | cut -d' ' -f"$2" | sort -g | sed -n 2p; }
row "60 frames of the lab with --truth and without it: processor time, wall time, medians of three" \
  "$(fixed 2 "$(middle with 1)") s against $(fixed 2 "$(middle without 1)") s, $(fixed 2 "$(middle with 2)") s against $(fixed 2 "$(middle without 2)") s" "a figure" "$(passed truth)"

# Frames at independent poses. An interrupted step continues with the frames that it had.
many=build/release/bench/many_frames
for kind in "plain 100000 1" "smooth 10000 3"; do
  read -r name frames rays <<<"$kind"
  step "many_$name" "$many" --frames "$frames" --antialias "$rays" --rows "$work/many_$name.csv" --json "$work/many_$name.json" robots/lab_sim.yaml
  many_of() { jq -r "$1 // empty" "$work/many_$name.json" 2>/dev/null || true; } # nothing if it was not run
  if [ "$(passed "many_$name")" = no ]; then
    row "$frames frames of the lab, $name" "$(tail -n 1 "$work/many_$name.log")" "the statistics" no
    continue
  fi
  row "$frames frames of the lab, $name: time" "$(many_of .taken_now) frames in $(fixed 0 "$(many_of .wall_s)") s, $(fixed 1 "$(many_of '.taken_now / .wall_s')") a second" \
    "$([ "$name" = plain ] && echo "27.8 a second, which is 100,000 in an hour" || echo "a figure")" "$([ "$name" != plain ] && echo yes || holds "$(many_of '.taken_now / .wall_s') >= 27.8")"
  row "the same frames: position error" "mean $(fixed 4 "$(many_of '1e3 * .mean_m')") +- $(fixed 4 "$(many_of '1e3 * .mean_half_width_m')") mm, rmse $(fixed 3 "$(many_of '1e3 * .rmse_m')") mm, 95 % $(fixed 2 "$(many_of '1e3 * .quantiles_m["95"]')") mm, 99.9 % $(fixed 1 "$(many_of '1e3 * .quantiles_m["99.9"]')") mm, greatest $(fixed 1 "$(many_of '1e3 * .max_m')") mm, of $(many_of .with_fix) fixes" "a figure" yes
  row "the same frames: 95 % ellipses that hold the truth" "$(percent "$(many_of .coverage)") % ($(percent "$(many_of .coverage_low)") to $(percent "$(many_of .coverage_high)"))" "92 to 98 %" "$(holds "$(many_of .coverage) >= 0.92 && $(many_of .coverage) <= 0.98")"
  row "the same frames: rmse against the bound" "$(fixed 3 "$(many_of '.rmse_of_bounded_m / .bound_rms_m')") times $(fixed 3 "$(many_of '1e3 * .bound_rms_m')") mm" "a figure" yes
done

# The answer to an image steers the robot before the next image.
sed "s/^latency_frames: .*/latency_frames: 0/; s|\.\./|$PWD/|" robots/lab_sim.yaml >"$work/latency_0.yaml"
if [ ! -f "$work/real_time.status" ]; then rm -rf "$work/run_real_time"; fi
step real_time "$twocone" run --robot "$work/latency_0.yaml" --frames 450 --real-time --out "$work/run_real_time"
paced=$(sed -n 's/^ *- .*\(real time, a frame.*\)/\1/p' "$work/run_real_time/run.yaml" 2>/dev/null | tr -d '"' || true)
late=$(sed -n 's/.*: \([0-9]*\) of [0-9]* late.*only sleeps.*/\1/p' <<<"$paced")
row "the lab at 640x480 and 15 Hz in real time, latency_frames: 0, with vision, fix and storing" "${paced:-not run}" "at most 1 % late, with a bare sleeper's lateness beside it" "$(holds "${late:-450} <= 4")"

step growth build/release/bench/growth_bench --parts pixels,objects
row "growth by pixels and objects, with exponents; threads are in the table of plain images" "$(grep -c exponent "$work/growth.log" 2>/dev/null || true) tables" "10 to 10,000 objects" "$(passed growth)"

. tests/evidence/new_scenes.sh

step asan_build bash -c 'cmake --preset asan -D TWOCONE_BUILD_FUZZERS=ON && cmake --build --preset asan --target scene_fuzz'
step fuzz build/asan/tests/fuzz/scene_fuzz 500000 7 scenes/lab.pov scenes/hall.pov tests/fuzz/keywords.pov tests/sim_povray/scenes/tiny.pov
row "mutated scenes, read, evaluated and traced; AddressSanitizer and UndefinedBehaviorSanitizer" "$(tail -n 1 "$work/fuzz.log")" "half a million, no crash" "$(passed fuzz)"

block "Plain, and the wall time of a stereo frame by threads" "$(tail -qn 2 "$work"/plain_*.log)"
block "Growth" "$(cat "$work/growth.log" 2>/dev/null || echo "not run")"
block "Smoothed" "$(tail -qn 2 "$work"/smoothed_*.log)"
block "Many frames" "$(cat "$work"/many_plain.log "$work"/many_smooth.log 2>/dev/null | tr '\r' '\n' | grep -v ' frames$' || echo "not run")"
page "the native renderer"
