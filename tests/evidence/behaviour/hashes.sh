#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the program in all its main uses and prints one line for each result: sha256, use and file. Two programs behave
# alike if these lines are equal.
#
#   hashes.sh TWOCONE SOURCE_DIR WORK_DIR [USE...]      USE: one of those at the end of this file; default: all
#
# Left out is what belongs to the machine or the moment: measured times, versions, paths. Pixels are hashed, not PNG files.
# Names that were changed since the hashes were recorded are translated back by renamed.txt, so that a renamed column
# leaves its hash as it was. POV-Ray renders all images, because the hashes are older than the native renderer.
set -euo pipefail
twocone=$1 source_dir=$(realpath "$2") work=$3
shift 3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "$work"
work=$(realpath "$work")
frames=60

# One sed expression for each line "NEW OLD" of renamed.txt; whole words only.
translation=$(awk '!/^#/ && NF == 2 { printf "s/\\b%s\\b/%s/g\n", $1, $2 }' "$here/renamed.txt")
translated() { sed -e "$translation"; }

# table FILE: a CSV without its measured times
table() {
  awk -F, -v OFS=, '
    NR == 1 { for (i = 1; i <= NF; i++) drop[i] = $i ~ /^(host_t_s|vision_s|localisation_s|wall_s)$/ }
    { line = ""; for (i = 1; i <= NF; i++) if (!drop[i]) line = line OFS $i; print line }' "$1"
}
# numbers FILE: a JSON without what is of the machine
numbers() {
  jq -S '
    def moment: test("^(twocone|commit|compiler|finished|wall_s|render_wait_s|own_cpu_s|render_cpu_s|vision.*_s|localisation.*_s|both.*_s|effort|seconds)$");
    walk(if type == "object" then with_entries(select(.key | moment | not)) elif type == "string" and contains("/") then "" else . end)' "$1"
}
print_hash() { printf '%s  %s\n' "$(sha256sum | cut -d' ' -f1)" "$(translated <<<"$1")"; }

# tables NAME FOLDER: every table and pixel of a run folder
tables() {
  local name=$1 folder=$2 file
  (cd "$folder" && find . -name '*.csv' -o -name '*.tum') | sed 's|^\./||' | LC_ALL=C sort | while read -r file; do
    if [[ $file == *.tum ]]; then translated <"$folder/$file"; else table "$folder/$file" | translated; fi |
      print_hash "$name/$file"
  done
  (cd "$folder" && find . -name summary.json) | sed 's|^\./||' | LC_ALL=C sort | while read -r file; do
    numbers "$folder/$file" | translated | print_hash "$name/$file"
  done
  for view in lower upper; do
    find "$folder/$view" -name '*.png' | LC_ALL=C sort | xargs identify -format '%wx%h %z %#\n' | print_hash "$name/$view pixels"
  done
}
quiet() { "$@" >"$work/last.out" 2>"$work/last.err" || { echo "hashes.sh: failed: $*" >&2; cat "$work/last.err" >&2; exit 1; }; }
# drive NAME ROBOT [SEED]
drive() {
  [ -e "$work/$1/summary.json" ] || quiet "$twocone" run --renderer povray --robot "$2" --frames "$frames" --seed "${3:-1}" --out "$work/$1" --force
}
driven() { drive "$@" && tables "$1" "$work/$1"; }

# A robot of the repository, changed by a sed expression, with an absolute path of its map.
changed() { # changed ROBOT EXPRESSION NAME
  local map
  map=$(sed -n 's/^map: *//p' "$1")
  sed "s|^map:.*|map: $(realpath "$(dirname "$1")/$map")|; $2" "$1" >"$work/$3.yaml"
}

use_lab1() { driven lab1 "$source_dir/robots/lab_sim.yaml" 1; }
use_lab2() { driven lab2 "$source_dir/robots/lab_sim.yaml" 2; }
use_lab3() { driven lab3 "$source_dir/robots/lab_sim.yaml" 3; }
use_hall() { driven hall "$source_dir/robots/hall_sim.yaml"; }
use_workshop() { driven workshop "$source_dir/robots/workshop_sim.yaml"; }
use_glass() { driven glass "$source_dir/robots/effects/glass.yaml"; }
use_noisy() { driven noisy "$source_dir/robots/effects/noisy.yaml"; }
use_physics() {
  changed "$source_dir/robots/lab_sim.yaml" 's/^  slip: .*/  slip: 0.01\n  mass_kg: 4\n  wheel_friction: 0.8/' physics
  driven physics "$work/physics.yaml"
}
use_pair_embedded() {
  changed "$source_dir/robots/pair/one.yaml" '/^attach:/d' pair_embedded
  driven pair_embedded "$work/pair_embedded.yaml"
}
use_pair_served() {
  local server robot pids=()
  for robot in one two; do changed "$source_dir/robots/pair/$robot.yaml" 's/^attach:.*/attach: behaviour-check/' "pair_$robot"; done
  "$twocone" serve --renderer povray --scene "$source_dir/scenes/pair/pair.map.yaml" --name behaviour-check >"$work/serve.log" 2>&1 &
  server=$!
  # Both robots must attach before the first step. One that finds no server yet tries again later than the other.
  for _ in $(seq 100); do
    if grep -q '^serving' "$work/serve.log"; then break; fi
    sleep 0.1
  done
  for robot in one two; do
    rm -rf "$work/pair_$robot"
    "$twocone" run --robot "$work/pair_$robot.yaml" --frames "$frames" --out "$work/pair_$robot" >/dev/null 2>&1 &
    pids+=($!)
  done
  wait "${pids[@]}"
  kill "$server"
  wait "$server" || true
  # Whichever robot attaches second reads other digits of the world's clock: places only.
  for robot in one two; do
    cut -d' ' -f2- "$work/pair_$robot/truth.tum" | print_hash "pair_$robot/truth.tum places"
    for view in lower upper; do
      find "$work/pair_$robot/$view" -name '*.png' | LC_ALL=C sort | xargs identify -format '%wx%h %z %#\n' | print_hash "pair_$robot/$view pixels"
    done
  done
}
use_localise() {
  local method
  drive lab1 "$source_dir/robots/lab_sim.yaml" 1
  for method in paper "$(cd "$work/lab1/methods" && find . -mindepth 1 -maxdepth 1 ! -name paper | cut -c3-)"; do
    rm -rf "$work/localised"
    cp -r "$work/lab1" "$work/localised"
    rm -rf "$work/localised/methods" "$work"/localised/{ranges,fixes,track,sightings}.csv
    quiet "$twocone" localise "$work/localised" --method "$method"
    tables "localise_$method" "$work/localised" | grep -v pixels
  done
}
use_calibrate() {
  drive lab1 "$source_dir/robots/lab_sim.yaml" 1
  mkdir -p "$work/calibrated"
  quiet "$twocone" calibrate "$work/lab1" --out "$work/calibrated/found.yaml" --force
  numbers "$work/calibrated/found.calibration.json" | translated | print_hash calibrate/calibration.json
  sed '/^#/d; /^map:/d' "$work/calibrated/found.yaml" | translated | print_hash calibrate/robot.yaml
}
use_compare() {
  drive lab1 "$source_dir/robots/lab_sim.yaml" 1
  drive lab2 "$source_dir/robots/lab_sim.yaml" 2
  rm -rf "$work/compared"
  quiet "$twocone" compare "$work/lab1" "$work/lab2" --out "$work/compared" --write-robot "$work/corrected.yaml" --force
  # Its sentences for people may be reworded: numbers alone.
  numbers "$work/compared/compare.json" | jq 'walk(if type == "string" then "" else . end)' | translated | print_hash compare/compare.json
  for file in corrected corrected_sim; do
    [ ! -e "$work/$file.yaml" ] || sed '/^#/d; /^map:/d' "$work/$file.yaml" | translated | print_hash "compare/$file.yaml"
  done
}
use_tradeoff() {
  local episodes
  episodes=$("$twocone" tradeoff --help | grep -oE -- '--(legs|episodes)' | head -n 1)
  local sweep=("$twocone" tradeoff --renderer povray --robot "$source_dir/robots/lab_sim.yaml" "$episodes" 3)
  seq 0 $(($("${sweep[@]}" --shards) - 1)) | quiet xargs -P 2 -I{} "${sweep[@]}" --out "$work/sweep" --shard {}
  quiet "${sweep[@]}" --out "$work/sweep" --merge
  (cd "$work/sweep" && find . -name errors.csv -o -name ranges.csv) | sed 's|^\./||' | LC_ALL=C sort | while read -r file; do
    table "$work/sweep/$file" | translated | print_hash "tradeoff/$file"
  done
}

uses=(lab1 lab2 lab3 hall workshop glass noisy physics pair_embedded pair_served localise calibrate compare tradeoff)
(($#)) || set -- "${uses[@]}"
for use; do "use_$use"; done
