#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Python: the cost of a controller beside the same one in C++, a run beside the command's, wrong arguments, stubs.
also=(python tests/python tests/evidence/python)
. "$(dirname "$0")/common.sh"
export PYTHONPATH=$PWD/build/release/python TWOCONE=$twocone
python=/usr/bin/python3

build() {
  cmake --install build/release --prefix "$work/installed" >/dev/null &&
    PKG_CONFIG_PATH=$(dirname "$(find "$work/installed" -name twocone.pc)") &&
    export PKG_CONFIG_PATH &&
    # shellcheck disable=SC2046
    g++ -O2 -std=c++20 tests/evidence/python/controller.cpp -o "$work/controller" $(pkg-config --cflags --libs twocone) \
      -Wl,-rpath,"$(dirname "$PKG_CONFIG_PATH")"
}
step build build
# Rounds of both by turns, so that what else the machine does reaches both.
loops() {
  for _ in 1 2 3 4 5; do
    echo "cpp $("$work/controller" robots/lab_sim.yaml 464)"
    echo "python $($python tests/evidence/python/controller.py robots/lab_sim.yaml 464)"
  done
}
step loops loops
median() { awk -v who="$1" -v key="$2" '$1 == who { for (i = 2; i < NF; ++i) if ($i == key) print $(i + 1) }' "$work/loops.log" | sort -n | sed -n 3p; }
cpp=$(median cpp cpu)
py=$(median python cpu)
row "a controller at 15 Hz in the lab, 640x480, by the wall clock: cores in use, C++ and Python (medians of 5 times 30 s), frames a second" \
  "$cpp, $py, $(median python rate)" "at most 0.05 more" "$(holds "$py <= $cpp + 0.05 && $(median python rate) > 14.9")"
row "frames whose image was at one address at each call, of 464" "$(median python same_address)" "464" "$(holds "$(median python same_address) == 464")"

same_run() {
  rm -rf "$work/command" "$work/python"
  $twocone run --robot robots/lab_sim.yaml --frames 450 --seed 5 --behaviour waypoints --renderer native --out "$work/command" >/dev/null &&
    $python -c "import twocone; twocone.run('robots/lab_sim.yaml', out='$work/python', frames=450, seed=5, behaviour='waypoints', renderer='native')" &&
    for table in drive.csv ranges.csv fixes.csv sightings.csv track.csv truth.tum odometry.tum estimate.tum; do
      cmp "$work/command/$table" "$work/python/$table" && echo "same $table"
    done
  for view in lower upper; do
    for image in "$work/command/$view"/*.png; do
      [ "$(convert "$image" rgb:- | sha256sum)" = "$(convert "$work/python/$view/$(basename "$image")" rgb:- | sha256sum)" ] && echo "same pixels"
    done
  done
}
step same_run same_run
row "a run of 450 frames driven from Python: tables with the command's bytes, images with its pixels" \
  "$(grep -c 'same .*\.' "$work/same_run.log") of 8, $(grep -c 'same pixels' "$work/same_run.log") of 900" "all" \
  "$([ "$(grep -c 'same .*\.' "$work/same_run.log")" = 8 ] && [ "$(grep -c 'same pixels' "$work/same_run.log")" = 900 ] && echo yes || echo no)"

step wrong_arguments $python tests/python/wrong_arguments.py 1000000 1
row "a million calls with wrong arguments" "$(tail -n 1 "$work/wrong_arguments.log")" "the interpreter does not crash" "$(passed wrong_arguments)"
for test in robot tools interface; do step "$test" $python "tests/python/${test}_test.py"; done
row "robots closed in any order, forks, threads, Ctrl-C; tools; the promised interface" "$(grep -h '^Ran' "$work"/{robot,tools,interface}.log | paste -sd';' | sed 's/;/; /g')" "all pass" \
  "$([ "$(passed robot)$(passed tools)$(passed interface)" = yesyesyes ] && echo yes || echo no)"
step documentation $python -m doctest docs/python.md
row "the examples of docs/python.md" "$(status_of documentation)" "0" "$(passed documentation)"
# What pybind11 makes otherwise than the stubs say, of all modules: metaclasses, enumerations, classes without a constructor; and the
# stubs' own names of types.
artefacts='metaclass differs|does not have \*args argument|variable differs from runtime type twocone._native\.|_native.(Image|Matrix|PathLike) is not present'
stubs() { (cd build/release/python && stubtest twocone --ignore-missing-stub) | grep -E '^error|^Found|^Success' || true; }
step stubs stubs
differences=$(grep '^error' "$work/stubs.log" | grep -cvE "$artefacts" || true)
row "differences of the type stubs from the compiled module, by mypy's stubtest, beyond pybind11's own" "$differences" "0" \
  "$(holds "$differences == 0 && $(grep -c . "$work/stubs.log") > 0")"
page "Python"
