#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Simulated against real: planted differences together and each alone, no planted difference, the robot files that are written, a
# recording of devices, broken runs, ten minutes of frames. Takes about an hour of two cores.
. "$(dirname "$0")/common.sh"

# TWOCONE_COMPARE_FRAMES=40 runs all rows with short runs and few seeds, and writes the page to a separate folder; such a page is no
# evidence.
frames=450 few_frames=120 long_frames=300 null_frames=80 seeds=20 times=20
rig_frames=150  # number of frames from which a rig is determined
image_frames=40 # number of frames where only images are compared
if [ -n "${TWOCONE_COMPARE_FRAMES:-}" ]; then
  frames=$TWOCONE_COMPARE_FRAMES few_frames=$TWOCONE_COMPARE_FRAMES long_frames=$TWOCONE_COMPARE_FRAMES null_frames=$TWOCONE_COMPARE_FRAMES
  seeds=2 times=4 rig_frames=30 image_frames=20
  work+=_$TWOCONE_COMPARE_FRAMES
  pages=$work
  mkdir -p "$work"
fi
short=60 # frames of the broken runs
if [ "$frames" -lt $((short + 10)) ]; then short=$((frames / 2)); fi
last_seed=$((seeds + 1))
export RATE_HZ=5 # a minute is 300 frames

both() { if [ "$1$2" = yesyes ]; then echo yes; else echo no; fi; }
last() { tail -n 1 "$work/$1.log"; }
joined() { paste -sd, | sed 's/,/, /g'; }
# once NAME COMMAND...: a step that makes the folder $work/NAME; it first removes the folder of an interrupted call
once() {
  local name=$1
  shift
  step "$name" in_new_folder "$name" "$@"
}
in_new_folder() {
  rm -rf "${work:?}/$1"
  shift
  "$@"
}

# --------------------------------------------------------------------- planted errors ----
errors=(rim centre tilt noise gain wheel_radius skew lost)
of_plant() { case $1 in tilt) echo tilt=0.4 ;; noise) echo noise=4 ;; gain) echo gain=1.2 ;; wheel_radius) echo wheel_radius=2 ;; skew) echo skew=8 ;; lost) echo lost=2 ;; *) echo "$1" ;; esac; }
# The numbers that compare must find: KIND|WHERE|COMPONENT|REAL LESS SIMULATED|UNIT
of_error() {
  case $1 in
    rim) echo 'focal length|upper|upper.rim_radius_px|2|px' ;;
    centre) printf '%s\n' 'centre|lower|lower.centre_px.column|1.8|px' 'centre|lower|lower.centre_px.row|-2.4|px' ;;
    tilt) printf '%s\n' 'tilt|upper|upper.tilt_rad.x|-0.24|deg' 'tilt|upper|upper.tilt_rad.y|0.32|deg' ;;
    noise) printf 'noise|%s|noise|4|grey\n' lower upper ;;
    gain) printf 'exposure and colour|%s|gain.%s|0.2|1\n' lower red lower green lower blue upper red upper green upper blue ;;
    wheel_radius) echo 'wheel radius||wheel_radius_m|1|mm' ;;
    skew) echo 'skew||upper.skew_s|-8|ms' ;;
    lost) printf 'frames lost|%s|lost|2|%%\n' lower upper ;;
  esac
}
names_of() { of_error "$1" | awk -F'|' '{ name = ($2 == "" ? "" : $2 " ") $1; if (!(name in seen)) print name; seen[name] }'; }

# world NAME ERROR...: makes the lab with these errors in $work/worlds/NAME
world() {
  local name=$1
  shift
  tests/evidence/plant.sh "$work/worlds/$name" "$@"
}
# drive NAME WORLD SEED FRAMES: makes a run in $work/NAME/run; as_real NAME makes a copy without truth in $work/NAME/real
drive() { "$twocone" run --robot "$work/worlds/$2/robot.yaml" --behaviour waypoints --frames "$4" --seed "$3" --out "$work/$1/run"; }
as_real() { tests/evidence/as_real.sh "$work/$1/run" "$work/$1/real"; }
# compared NAME SIM REAL OPTION...: compares two runs and writes to $work/NAME/compare
compared() {
  local name=$1 simulated=$2 real=$3
  shift 3
  "$twocone" compare "$simulated" "$real" --out "$work/$name/compare" --frames "$rig_frames" "$@"
}
json_of() { echo "$work/$1/compare/compare.json"; }
named_by() { jq -r '.sources[] | select(.verdict == "differs") | .name' "$(json_of "$1")" 2>/dev/null || true; }

simulated_run() { world none none && drive sim none 1 "$frames"; }
once sim simulated_run

# ------------------------------------------------------------------------- all together ----
all_planted() {
  local plants=() error
  for error in "${errors[@]}"; do plants+=("$(of_plant "$error")"); done
  world all "${plants[@]}" && drive all all 41 "$frames" && as_real all &&
    compared all "$work/sim/run" "$work/all/real" --write-robot "$work/all/F.yaml"
}
once all all_planted

# found RUN ERROR: sets `figure`, and sets `met` to yes if the error is named and each of its numbers lies within 3 of its sigmas
found() {
  local kind where component truth unit value verdict difference sigma z
  figure="" met=yes
  while IFS='|' read -r kind where component truth unit; do
    value=$(jq -r --arg kind "$kind" --arg where "$where" --arg name "$component" '
      .sources[] | select(.kind == $kind and .where == $where) | . as $s | .components[] | select(.name == $name)
      | [$s.verdict, .difference, .sigma] | map(tostring) | join("|")' "$(json_of "$1")" 2>/dev/null || true)
    IFS='|' read -r verdict difference sigma <<<"${value:-cannot tell||}"
    if [ -z "$difference" ]; then
      figure+="; $where $component: not reported" met=no
      continue
    fi
    z=$(awk "BEGIN { printf \"%.1f\", ($difference - ($truth)) / $sigma }")
    if [[ $component == "$where".* ]]; then where=""; fi
    figure+="; ${where:+$where }$(printf '%s %+.3f +- %.3f, %s sigma from %s' "$component" "$difference" "$sigma" "$z" "$truth")$([ "$unit" = 1 ] || echo " $unit")"
    if [ "$verdict" != differs ]; then figure+=" ($verdict)" met=no; fi
    if [ "$(holds "$z <= 3 && $z >= -3")" = no ]; then met=no; fi
  done < <(of_error "$2")
  figure=${figure#; }
}
# others RUN ERROR...: prints the other sources that are named
others() {
  local run=$1
  shift
  named_by "$run" | grep -vxF -f <(for error in "$@"; do names_of "$error"; done) || true
}
for error in "${errors[@]}"; do
  found all "$error"
  row "all eight planted: $(names_of "$error" | joined)" "$figure" "named, each within 3 of its sigmas" "$met"
done
besides=$(others all "${errors[@]}" | joined)
row "all eight planted: other sources that are named" "${besides:-none}" none "$(if [ "$(passed all)" = yes ] && [ -z "$besides" ]; then echo yes; else echo no; fi)"

# --------------------------------------------------------------------------- each alone ----
seed=30
for error in "${errors[@]}"; do
  seed=$((seed + 1))
  count=$few_frames
  case $error in lost | wheel_radius) count=$long_frames ;; esac # these need a long drive
  alone() { world "$error" "$(of_plant "$error")" && drive "alone_$error" "$error" "$seed" "$count" && as_real "alone_$error" && compared "alone_$error" "$work/sim/run" "$work/alone_$error/real" --no-page; }
  once "alone_$error" alone
  found "alone_$error" "$error"
  # Another named source counts as stated if compare states for one of the two that this drive hardly distinguishes them.
  unstated="" stated=""
  while read -r name; do
    if [ -z "$name" ]; then continue; fi
    if jq -e --arg other "$name" --arg planted "$(names_of "$error")" '
      ($planted | split("\n")) as $planted
      | [.sources[] | select((.name == $other and any(.hardly_told_from[]; IN($planted[])))
          or ((.name | IN($planted[])) and any(.hardly_told_from[]; . == $other)))] | length > 0' "$(json_of "alone_$error")" >/dev/null; then
      stated+="${stated:+, }$name"
    else
      unstated+="${unstated:+, }$name"
    fi
  done < <(others "alone_$error" "$error")
  row "planted alone: $error ($(names_of "$error" | joined))" "$figure; also named: ${unstated:-none}${stated:+; also named, and stated as hardly distinguishable: $stated}" "named, and no other source, or the confusion is stated" "$(both "$met" "$(if [ -z "$unstated" ]; then echo yes; else echo no; fi)")"
done

# ---------------------------------------------------------------------- nothing planted ----
nothing() {
  local seed=$1
  drive "nothing_$seed" none "$seed" "$null_frames" && as_real "nothing_$seed" &&
    compared "nothing_$seed" "$work/sim/run" "$work/nothing_$seed/real" --no-page --jobs 1 || return 1
  # each of them has 80 MB of images
  if [ "$seed" != 2 ]; then rm -rf "$work/nothing_$seed"/{run,real}; fi
}
two_nothings() {
  local first status=0
  rm -rf "$work/nothing_$1" "$work/nothing_$2"
  world none none
  nothing "$1" &
  first=$!
  nothing "$2" || status=1
  wait $first || status=1
  return $status
}
reports="" results=() clean=0
for ((seed = 2; seed <= last_seed; seed += 2)); do step "nothing_${seed}_$((seed + 1))" two_nothings "$seed" $((seed + 1)); done
for ((seed = 2; seed <= last_seed; seed++)); do
  [ -f "$(json_of "nothing_$seed")" ] || continue
  results+=("$(json_of "nothing_$seed")")
  reports+=$(named_by "nothing_$seed" | sed "s/^/; seed $seed: /" | tr -d '\n')
  if [ -z "$(named_by "nothing_$seed")" ]; then clean=$((clean + 1)); fi
done
least="none" sigmas="none"
if ((${#results[@]})); then
  least=$(jq -rs '[.[].sources[] | select(.verdict != "cannot tell") | {name, p_value}] | min_by(.p_value) | "\(.p_value) (\(.name))"' "${results[@]}")
  sigmas=$(jq -rs '
    [.[].sources[] | select(.verdict != "cannot tell") | .kind as $kind | .components[] | {kind: $kind, z: (.difference / .sigma)}]
    | group_by(.kind)[] | [.[0].kind, length, ((map(.z * .z) | add) / length | sqrt), (map(.z | fabs) | max)] | @tsv' "${results[@]}" |
    awk -F'\t' 'BEGIN { printf "%-24s %7s %6s %8s\n", "", "numbers", "rms z", "largest" } { printf "%-24s %7d %6.2f %8.2f\n", $1, $2, $3, $4 }')
fi
row "nothing planted: runs of other seeds in which none is named" "$clean of ${#results[@]}$reports" "$seeds of $seeds" "$(holds "$clean == $seeds")"
row "nothing planted: the smallest p-value of all sources of all runs" "$least" "above $(jq -r .level "${results[0]:-/dev/null}" 2>/dev/null || echo "the level")" "$(if [ "$least" = none ]; then echo no; else holds "${least%% *} >= $(jq -r .level "${results[0]}")"; fi)"

# ------------------------------------------------------------------------- --write-robot ----
# Another loop through the lab in the opposite direction, with the same distance from obstacles as the robot's own loop.
path_b='[[0.4, -0.6], [0.4, -1.4], [-1.0, -1.35], [-1.8, -1.1], [-1.6, 0.3], [-0.1, 0.3], [0.1, 1.4], [1.3, 1.2], [1.8, 0.2]]'
# on_path_b ROBOT COPY: makes a copy of a robot file with this path. It must be in the same folder because of its map.
on_path_b() {
  awk -v path="$path_b" '
    /^waypoints_m:/ { in_it = 1 }
    in_it { if (/\]\]/) { in_it = 0; print "waypoints_m: " path; n++ } next }
    { print }
    END { if (n != 1) print "waypoints_m: " path }' "$1" >"$2"
}
# Runs the real robot on path B with its own parameters, localises the same frames with F.yaml, and runs the robot of F_sim.yaml on
# path B in the world without differences. `localise` takes only rig, wheels and estimator from a file, so F.yaml brings in no truth.
path_b_runs() {
  local b=$work/path_b
  mkdir -p "$b"
  on_path_b "$work/worlds/all/robot.yaml" "$work/worlds/all/robot_b.yaml"
  on_path_b "$work/all/F_sim.yaml" "$work/all/F_sim_b.yaml"
  "$twocone" run --robot "$work/worlds/all/robot_b.yaml" --behaviour waypoints --frames "$few_frames" --seed 51 --out "$b/real" &&
    "$twocone" localise "$b/real" --robot "$work/all/F.yaml" --method outline --out "$b/corrected" &&
    "$twocone" run --robot "$work/all/F_sim_b.yaml" --behaviour waypoints --frames "$few_frames" --seed 52 --out "$b/sim"
}
once path_b path_b_runs
# range_rmse RUN [VERDICT]: prints the rmse against truth in mm, and the number, of ranges with this verdict or of all with a number
range_rmse() {
  awk -F, -v verdict="${2:-.*}" 'NR == 1 { for (i = 1; i <= NF; i++) c[$i] = i; next }
    $c["verdict"] ~ "^" verdict "$" && $c["range_m"] != "" && $c["true_range_m"] != "" { n++; s += ($c["range_m"] - $c["true_range_m"]) ^ 2 }
    END { if (n) printf "%.3f %d\n", 1e3 * sqrt(s / n), n; else print "none 0" }' "$work/path_b/$1/ranges.csv" 2>/dev/null || echo none 0
}
read -r before before_count <<<"$(range_rmse real)" # with wrong mirrors few ranges are consistent
read -r after after_count <<<"$(range_rmse corrected ok)"
read -r floor floor_count <<<"$(range_rmse sim ok)"
ratio=none
if [[ "$after $floor" != *none* ]]; then ratio=$(awk "BEGIN { printf \"%.2f\", $after / $floor }"); fi
row "--write-robot, on a path that was not used: rmse of ranges of the real robot by F.yaml over that of the simulation by F_sim.yaml" "$ratio: $after mm of $after_count ranges, $floor mm of $floor_count; before the correction $before mm of all $before_count" "at most 1.2" "$(if [ "$ratio" = none ]; then echo no; else holds "$ratio <= 1.2"; fi)"

# ---------------------------------------------------------------- a recording of devices ----
recorded=${TWOCONE_WHOLE_RUN_OUT:-}
if [ -z "$recorded" ]; then
  recorded=$(find "$PWD"/evidence-runs -maxdepth 3 -path '*/drivers/whole_run' -exec test -f '{}/run/frames.csv' ';' -printf '%T@ %p\n' 2>/dev/null | sort -n | tail -n 1 | cut -d' ' -f2-)
fi
if [ -z "$recorded" ]; then
  recorded=$work/whole_run
  export TWOCONE_WHOLE_RUN_OUT=$recorded
  step record tests/vm/whole_run.sh
fi
devices() { compared devices "$recorded/sim" "$recorded/run"; }
devices_again() { "$twocone" compare "$recorded/run" --scene scenes/lab.map.yaml --out "$work/devices_again/compare"; }
once devices devices
once devices_again devices_again
# of_devices STEP WHAT: writes a row. These devices change only times, so no source of mirrors, colours or map may be named.
of_devices() {
  local named lights unexpected
  named=$(named_by "$1" | joined)
  unexpected=$(jq -r '[.sources[] | select(.verdict == "differs" and (.kind | IN("skew", "latency", "stamped skew", "frame rate", "frames lost", "slip") | not)) | .name] | join(", ")' "$(json_of "$1")" 2>/dev/null || true)
  lights=$(jq -r '[.rows[] | .light] | group_by(.) | map("\(length) \(.[0])") | join(", ")' "$(json_of "$1")" 2>/dev/null || true)
  row "$2" "$(if [ "$(passed "$1")" = yes ]; then echo "named: ${named:-none}; lights: $lights"; else last "$1"; fi)" "a comparison that names only times and slip" "$(both "$(passed "$1")" "$(if [ -z "$unexpected" ]; then echo yes; else echo no; fi)")"
}
of_devices devices "a run through the kernel's cameras and a serial port, with its simulation"
of_devices devices_again "the same run, its poses rendered again (--scene)"
# The world of tests/vm measured how old the images were when the cameras received them.
delay_ms=$(awk '$1 == "mean_delay_s" { print 1e3 * $2 }' "$recorded/run.figures" 2>/dev/null || true)
latency=$(jq -r '.sources[] | select(.kind == "latency") | .components[] | "\(.difference) \(.sigma)"' "$(json_of devices)" 2>/dev/null || true)
read -r latency_ms latency_sigma_ms <<<"${latency:-none none}"
if [ -n "$delay_ms" ] && [ "$latency_ms" != none ]; then
  row "the same run: age of the images beyond their stamps, against the age that the world measured" "$(printf '%.1f +- %.1f ms against %.1f ms' "$latency_ms" "$latency_sigma_ms" "$delay_ms")" "within 3 sigma" "$(holds "($latency_ms - $delay_ms) ^ 2 <= (3 * $latency_sigma_ms) ^ 2")"
else
  row "the same run: age of the images beyond their stamps, against the age that the world measured" none "within 3 sigma" no
fi

# --------------------------------------------------------------------------- broken runs ----
# cut_run FROM TO COUNT: makes a copy with only the first frames
cut_run() {
  local from=$1 to=$2 count=$3 table number
  rm -rf "$to"
  cp -rl "$from" "$to"
  find "$to" -name '*.csv' -o -name '*.tum' | while read -r table; do
    awk -F, -v count="$count" 'NR == 1 && /,/ { header = 1; by_frame = $1 == "frame"; print; next } by_frame ? $1 < count : NR - header <= count' "$table" >"$table.part"
    mv "$table.part" "$table"
  done
  for number in "$to"/{lower,upper}/*.png; do
    if ((10#$(basename "$number" .png) >= count)); then rm "$number"; fi
  done
}
# half FILE: replaces a file by its first half
half() {
  head -c $(($(stat -c %s "$1") / 2)) "$1" >"$1.part"
  mv "$1.part" "$1"
}
broken=$work/broken tree=$PWD
# case_of NAME COMMAND...: makes a copy of the short real run, runs COMMAND in its folder, compares it, and prints a line on the result
case_of() {
  local name=$1 out=$broken/out status=0
  shift
  rm -rf "$broken/case" "$out"
  cp -rl "$broken/short" "$broken/case"
  (cd "$broken/case" && "$@")
  timeout 600 "$twocone" compare "$broken/sim" "$broken/case" --out "$out" --frames 20 --no-page >"$broken/stdout" 2>"$broken/stderr" </dev/null || status=$?
  print_case "$name" "$status"
}
print_case() { # NAME STATUS
  local lines message good=no
  lines=$(wc -l <"$broken/stderr")
  if [ "$2" = 0 ]; then
    message=$(grep -E '^(real|note:|No difference)' "$broken/stdout" | sed 's/^real .* (\(.*\))$/\1/; s/^No difference found\.$/nothing named/' | paste -sd';' | sed 's/;/; /g' | cut -c 1-300 || true)
    if [ -f "$broken/out/compare.json" ]; then good=yes; fi
  else
    message=$(head -n 1 "$broken/stderr")
    if [ "$2" = 1 ] && [ "$lines" = 1 ]; then good=yes; fi
  fi
  printf '%-34s exit %d  %-3s  %s\n' "$1" "$2" "$good" "${message//$broken\//}"
}
broken_runs() {
  rm -rf "$broken"
  mkdir -p "$broken"
  cut_run "$work/sim/run" "$broken/sim" "$short"
  cut_run "$work/nothing_2/real" "$broken/short" "$short"
  case_of "unchanged" true
  case_of "a third of the length" cut_here $((short / 3))
  case_of "3 frames" cut_here 3
  case_of "no frame" cut_here 0
  for file in run.yaml frames.csv sightings.csv ranges.csv fixes.csv drive.csv odometry.tum estimate.tum; do
    case_of "no $file" bash -c "find . -name $file -delete"
    case_of "$file ends in half a line" half_of "$file"
  done
  case_of "no images at all" rm -rf lower upper
  case_of "no upper images" rm -rf upper
  case_of "an image missing in the middle" rm "lower/$(printf '%06d' $((short / 2))).png"
  case_of "half an image in the middle" half "lower/$(printf '%06d' $((short / 2))).png"
  case_of "last frame half written" half "upper/$(printf '%06d' $((short - 1))).png"
  case_of "last frame empty" truncate_new "upper/$(printf '%06d' $((short - 1))).png"
  case_of "an image that is text" text_of "lower/000003.png"
  case_of "truth present" cp "$work/nothing_2/run/truth.tum" .
  case_of "truth of half the run" bash -c "head -n $((short / 2)) '$work/nothing_2/run/truth.tum' >truth.tum"
  # Other robots have twice the rate or half the size.
  local other=$work/worlds/none
  sed "s/rate_hz: 5/rate_hz: 10/" "$other/robot.yaml" >"$other/fast.yaml"
  sed 's/width_px: 640, height_px: 480/width_px: 320, height_px: 240/; s/319\.5, 239\.5/159.5, 119.5/; s/rim_radius_px: 236\.0/rim_radius_px: 118.0/' "$other/robot.yaml" >"$other/small.yaml"
  local kind
  for kind in fast small; do
    "$twocone" run --robot "$other/$kind.yaml" --behaviour waypoints --frames "$short" --seed 61 --out "$broken/$kind" >/dev/null
    case_of "$(if [ $kind = fast ]; then echo "twice the rate"; else echo "half the size"; fi)" swap_for "$broken/$kind"
  done
}
cut_here() { cut_run "$broken/short" "$broken/case" "$1"; }
half_of() {
  local file
  find . -name "$1" | while read -r file; do
    head -c -7 "$file" >"$file.part"
    mv "$file.part" "$file"
  done
}
truncate_new() { rm "$1" && : >"$1"; }
text_of() { rm "$1" && echo "no image" >"$1"; }
swap_for() { "$tree"/tests/evidence/as_real.sh "$1" "$broken/case"; }
step broken broken_runs
cases=$(grep -E ' exit [0-9]+ ' "$work/broken.log" || true)
wrong=$(grep -cE ' exit [0-9]+  no ' <<<"$cases" || true)
row "runs of other length, rate and size, files missing, truth absent, half-written frames" "$(grep -c . <<<"$cases" || true) cases, $(grep -c ' exit 0 ' <<<"$cases" || true) compared, $(grep -c ' exit 1 ' <<<"$cases" || true) refused, $wrong neither" "each compared, or one line and exit status 1" "$(both "$(passed broken)" "$(holds "$wrong == 0")")"

# ------------------------------------------------------------------------------- limits ----
limits() {
  local status=0 short_runs=("$broken/sim" "$broken/short" --out "$work/limits" --frames 20 --no-page)
  "$twocone" compare "${short_runs[@]}" --max-range-mm 1000 --max-rim-px 100 >/dev/null || return 1
  echo "within: exit status 0"
  "$twocone" compare "${short_runs[@]}" --max-range-mm 0.001 >/dev/null || status=$?
  echo "beyond: exit status $status"
  [ "$status" = 1 ]
}
once limits limits
row "--max-range-mm: exit status within and beyond the limit" "$(grep -hE '^(within|beyond|twocone)' "$work/limits.log" | paste -sd';' | sed 's/;/; /g')" "0; 1 with the limit named" "$(both "$(passed limits)" "$(if grep -q 'beyond its limit: range' "$work/limits.log"; then echo yes; else echo no; fi)")"

# --------------------------------------------------------------------------- ten minutes ----
many=$((frames * times))
measured_compare() { # NAME SIM REAL: in a terminal; writes peak memory in KiB and seconds to NAME.cost, and the terminal's text to NAME.bar
  script -qefc "/usr/bin/time -f '%M %e' -o $work/$1.cost $twocone compare $2 $3 --out $work/$1/compare --frames $image_frames --no-page" "$work/$1.bar" </dev/null
}
short_compare() { measured_compare short_memory "$work/sim/run" "$work/all/real"; }
once short_memory short_compare
long_runs() {
  tests/evidence/repeat_run.sh "$work/sim/run" "$work/long_runs/sim" "$times" && tests/evidence/repeat_run.sh "$work/all/real" "$work/long_runs/real" "$times"
}
once long_runs long_runs
long_compare() { measured_compare long_memory "$work/long_runs/sim" "$work/long_runs/real"; }
once long_memory long_compare
killed_compare() {
  local begin half pid out=$work/killed/compare settings=("$work/sim/run" "$work/all/real" --out "$work/killed/compare" --frames "$image_frames" --no-page)
  half=$(($(find "$work/short_memory/compare/parts" -type f | wc -l) / 2))
  "$twocone" compare "${settings[@]}" &
  pid=$!
  while kill -0 $pid 2>/dev/null && [ "$(find "$out/parts" -type f 2>/dev/null | wc -l)" -lt "$half" ]; do sleep 0.2; done
  kill -9 $pid || { echo "it had ended before it was killed"; return 1; }
  wait $pid || true
  echo "killed with $(find "$out/parts" -type f | wc -l) of $((2 * half)) parts done"
  begin=$(date +%s%N)
  "$twocone" compare "${settings[@]}" >/dev/null
  awk "BEGIN { printf \"again: %.0f s\n\", $(($(date +%s%N) - begin)) / 1e9 }"
  cmp "$out/compare.json" "$work/short_memory/compare/compare.json" && echo "byte-equal"
}
once killed killed_compare
read -r short_kib short_s <<<"$(tail -n 1 "$work/short_memory.cost" 2>/dev/null || echo 0 0)"
read -r long_kib long_s <<<"$(tail -n 1 "$work/long_memory.cost" 2>/dev/null || echo 0 0)"
row "peak memory for $many frames over that for $frames" "$(awk "BEGIN { printf \"%.3f: %.1f and %.1f MiB\", $short_kib ? $long_kib / $short_kib : 0, $long_kib / 1024, $short_kib / 1024 }"); $long_s and $short_s s" "at most 1.10" "$(both "$(both "$(passed short_memory)" "$(passed long_memory)")" "$(holds "$short_kib > 0 && $long_kib <= 1.1 * $short_kib")")"
bars=$(tr '\r' '\n' <"$work/long_memory.bar" 2>/dev/null | grep -c 'compare.*%' || true)
row "progress bar in a terminal, $many frames" "printed $bars times" "at least 10 times" "$(holds "$bars >= 10")"
again_s=$(sed -n 's/^again: \([0-9]*\) s$/\1/p' "$work/killed.log")
row "killed (kill -9) half-way and run again, $frames frames" "$(grep -E '^(killed|again|byte)' "$work/killed.log" | paste -sd';' | sed 's/;/; /g'); uninterrupted: $short_s s" "compare.json byte-equal to that of an uninterrupted comparison, in less time" "$(both "$(passed killed)" "$(holds "${again_s:-1e9} < $short_s")")"

block "All eight planted" "$(cat "$work/all.log")"
block "Nothing planted: differences over their sigmas, root mean square of each kind of source, $clean runs" "$sigmas"
block "A run through the kernel's cameras and a serial port" "$(cat "$work/devices.log")"
block "The same run, rendered again" "$(cat "$work/devices_again.log")"
block "Broken runs" "${cases:-none}"
page "simulated against real"
