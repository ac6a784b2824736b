#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Drivers of real devices against the kernel's virtual ones, in a virtual machine (tests/guest), fuzzers, deployment. About
# two hours. Each script prints its rows as `row | WHAT | FIGURE | TARGET | yes|no`.
. "$(dirname "$0")/common.sh"
export TWOCONE_WHOLE_RUN_OUT=$work/whole_run

trim() { sed 's/^ *//; s/ *$//' <<<"$1"; }
# rows NAME: those of a step's log; a step without any is not met.
rows() {
  local what figure target met found=no
  while IFS='|' read -r _ what figure target met; do
    found=yes
    row "$(trim "$what")" "$(trim "$figure")" "$(trim "$target")" "$(trim "$met")"
  done < <(grep '^row |' "$work/$1.log")
  [ $found = yes ] || row "$1" "$(tail -n 1 "$work/$1.log")" "figures" no
}
# try NAME COMMAND...: a step and its rows
try() {
  export SCRATCH=$work/scratch/$1
  mkdir -p "$SCRATCH"
  step "$@"
  rows "$1"
}

try vivid tests/guest/vivid.sh
try vimc tests/guest/vimc.sh
try capture_cost tests/guest/capture_cost.sh
try serial tests/guest/serial.sh
try stop tests/guest/stop.sh build/release 20
try whole_run tests/guest/whole_run.sh

step asan_build bash -c 'cmake --preset asan && cmake --build --preset asan --target serial_fuzz frame_fuzz'
for protocol in ros_arduino_bridge roboclaw create2; do
  step "fuzz_$protocol" build/asan/tests/fuzz/serial_fuzz "$protocol" 1000000 1
  row "decoder of $protocol: a million broken streams, ASan and UBSan" "$(tail -n 1 "$work/fuzz_$protocol.log")" "no crash" "$(passed "fuzz_$protocol")"
done
step fuzz_frames build/asan/tests/fuzz/frame_fuzz 1000000 1
row "MJPG and raw frames: a million broken pictures, ASan and UBSan" "$(tail -n 1 "$work/fuzz_frames.log")" "no crash" "$(passed fuzz_frames)"

step image_bench build/release/bench/image_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
try deb tests/evidence/deb.sh
try without tests/evidence/without.sh

block "Two V4L2 cameras and their faults" "$(cat "$work/vivid.log")"
block "A camera through libcamera" "$(cat "$work/vimc.log")"
block "Motor controllers on emulated ports" "$(cat "$work/serial.log")"
block "Stops" "$(cat "$work/stop.log")"
block "A whole run" "$(cat "$work/whole_run.log")"
block "Conversion beside OpenCV" "$(grep -E 'median|^Benchmark|^---' "$work/image_bench.log" || cat "$work/image_bench.log")"
page "drivers of real devices"
