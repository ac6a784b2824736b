#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The viewer in real browsers while a robot drives: its controls, what serving costs, how soon wheels stop, stored pages, attacks,
# lines of code. Takes about an hour. Nothing else should run meanwhile: most figures are times. The scripts print rows as
# `row | WHAT | FIGURE | TARGET | yes|no`.
also=(tests/web tests/evidence/viewer)
. "$(dirname "$0")/common.sh"
scratch=$work/scratch
scripts=tests/evidence/viewer
mkdir -p "$scratch"

# try NAME COMMAND...: runs a step and collects its rows
try() {
  step "$@"
  rows "$1"
}

try controls_chromium node $scripts/controls.mjs "$scratch" chromium pointer
try controls_keys node $scripts/controls.mjs "$scratch" chromium keys
# Keys press no buttons in a headless Firefox, whose window is never active.
try controls_firefox node $scripts/controls.mjs "$scratch" firefox pointer
try serving node $scripts/serving.mjs "$scratch"
for deed in tab kill cut; do try "stops_$deed" node $scripts/stops.mjs "$scratch" "$deed" "${TWOCONE_VIEWER_STOPS:-20}"; done

rm -rf "$scratch"/{wander,manual,program,browser,slow,stops_*} # gigabytes of images

# stored FRAMES: a run, and its report
stored() {
  rm -rf "$scratch/run_$1"
  "$twocone" run --robot robots/lab_sim.yaml --frames "$1" --out "$scratch/run_$1" && "$twocone" report "$scratch/run_$1"
}
for frames in 450 9000; do
  step "report_$frames" stored "$frames"
  try "opened_$frames" node $scripts/stored.mjs "$scratch/run_$frames/report.html" "report of a run of $frames frames"
done
step compare "$twocone" compare "$scratch/run_450" "$scratch/alone" --out "$scratch/compare"
step sweep "$twocone" tradeoff --robot robots/lab_sim.yaml --episodes 6 --validation-episodes 6 --out "$scratch/sweep"
try opened_compare node $scripts/stored.mjs "$scratch/compare/compare.html" "page of a comparison"
try opened_sweep node $scripts/stored.mjs "$scratch/sweep/index.html" "page of a sweep"
try access node $scripts/access.mjs "$scratch" "$scratch"/{run_450/report,compare/compare,sweep/index}.html

# The images of the docs, with few colours because they are small so.
images() {
  local name
  node $scripts/stored.mjs "$scratch/run_450/report.html" "" "$scratch/viewer-report.png" 1200 1500 || return 1
  for name in live report phone; do
    convert "$scratch/viewer-$name.png" +dither -colors 256 "PNG8:docs/images/viewer-$name.png" || return 1
    stat -c "%n %s" "docs/images/viewer-$name.png"
  done
}
step images images
largest=$(awk '{ if ($2 > most) most = $2 } END { print most + 0 }' "$work/images.log")
row "images of the docs: the largest of $(grep -c . "$work/images.log")" "$((largest / 1000)) kB" "at most 300 kB" "$(holds "$largest > 0 && $largest <= 300000")"

# The robot drives with the optimised program, for the frames that begin late, and with AddressSanitizer.
step release_build cmake --build --preset release --target web_attack
try attacks node $scripts/attacks.mjs "$scratch" "$twocone" build/release/tests/web/web_attack 100000
step asan_build bash -c 'cmake --preset asan && cmake --build --preset asan --target twocone web_attack'
try attacks_asan node $scripts/attacks.mjs "$scratch" build/asan/twocone build/asan/tests/web/web_attack 100000
rm -rf "$scratch"/attacked

before_commit=d3e9837d
rm -rf "$work/before"
mkdir "$work/before"
git archive "$before_commit" | tar -x -C "$work/before"
lines_of() { cloc --quiet --csv --include-lang="$1" "${@:2}" | sed -n 's/.*,SUM,.*,\([0-9]*\)$/\1/p'; }
folders=(include base hal vision localisation drivers apps)
before=$(lines_of 'C++,C/C++ Header' "${folders[@]/#/$work/before/}")
now=$(lines_of 'C++,C/C++ Header' "${folders[@]}")
row "lines of C++ of ${folders[*]}" "$before before ($before_commit), $now now: $((before - now)) fewer" "at least 2,500 fewer" "$(holds "$before - $now >= 2500")"
page_lines=$(lines_of 'JavaScript,CSS,HTML' apps/web/page)
row "lines of JavaScript, CSS and HTML of the viewer" "$page_lines" "at most 3,500" "$(holds "$page_lines <= 3500")"
step node_tests node --test --test-reporter=tap tests/web/*.test.mjs
row "its logic, tested by node's runner ($(node --version))" "$(sed -n 's/^# \(tests\|pass\|fail\) \(.*\)/\1 \2/p' "$work/node_tests.log" | paste -sd, | sed 's/,/, /g')" "all pass" "$(passed node_tests)"

for name in controls_chromium controls_keys controls_firefox access attacks attacks_asan; do
  found=$(grep -av '^row |' "$work/$name.log" | head -n 60 || true)
  [ -z "$found" ] || block "Found by $name" "$found"
done
block "Old and new stored pages, judged by eye and not by this script" "On 2026-11-28 the pages of $before_commit and of 26e0caba, made of the same data, were laid side by side at 1200 and 400 px:
report    of the lab, 450 frames: every headline, sentence, tile, table, column and figure is there. The 12 panoramas with a slider
          are the player of all frames. The scripts of gnuplot beside the figures are gone; each figure is saved as SVG or PNG.
          Small errors, which one axis with the paper's mean pressed onto its zero, are readable, because that axis is logarithmic.
compare   of two runs that differ: everything is there. The stage is a column of the table, which can be sorted, and no longer a
          heading in it.
tradeoff  of 186 settings: everything is there. Dominated settings are small marks and no longer faint ones.
A floor is a cross and no longer a dotted line; every reason for a missing range has a row with its sign, and not only its colour."
block "Seconds until the wheels stand, each time" "$(grep -av '^row |' "$work"/stops_*.log | sed 's|.*/||; s|\.log:|: |')"
page "the viewer"
