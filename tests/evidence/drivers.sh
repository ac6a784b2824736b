#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Drivers of real devices with the kernel's virtual devices in a virtual machine (tests/vm), fuzzers, deployment. Takes about
# two hours. Each script prints its rows as `row | WHAT | FIGURE | TARGET | yes|no`.
. "$(dirname "$0")/common.sh"
export TWOCONE_WHOLE_RUN_OUT=$work/whole_run

# try NAME COMMAND...: runs a step and collects its rows
try() {
  export SCRATCH=$work/scratch/$1
  mkdir -p "$SCRATCH"
  step "$@"
  rows "$1"
}

try vivid tests/vm/vivid.sh
try vimc tests/vm/vimc.sh
try capture_cost tests/vm/capture_cost.sh
try serial tests/vm/serial.sh
for protocol in ros_arduino_bridge roboclaw create2; do
  for deed in kill halt unplug watchdog; do
    try "stop_${protocol}_$deed" env PROTOCOLS=$protocol DEEDS=$deed tests/vm/stop.sh build/release 20
  done
done
try whole_run tests/vm/whole_run.sh

step asan_build bash -c 'cmake --preset asan -D TWOCONE_BUILD_FUZZERS=ON && cmake --build --preset asan --target serial_fuzz frame_fuzz'
for protocol in ros_arduino_bridge roboclaw create2; do
  step "fuzz_$protocol" build/asan/tests/fuzz/serial_fuzz "$protocol" 1000000 1
  row "decoder of $protocol: a million broken streams, ASan and UBSan" "$(tail -n 1 "$work/fuzz_$protocol.log")" "no crash" "$(passed "fuzz_$protocol")"
done
step fuzz_frames build/asan/tests/fuzz/frame_fuzz 1000000 1
row "MJPG and raw frames: a million broken images, ASan and UBSan" "$(tail -n 1 "$work/fuzz_frames.log")" "no crash" "$(passed fuzz_frames)"

step image_bench build/release/bench/image_bench --benchmark_repetitions=5 --benchmark_report_aggregates_only=true
try without tests/evidence/without.sh

block "Two V4L2 cameras and their faults" "$(log vivid | grep -v '^row |')"
block "A camera through libcamera" "$(log vimc | grep -v '^row |')"
block "Motor controllers on emulated ports" "$(log serial | grep -v '^row |')"
block "Stops" "$(for part in "$work"/stop_*.log; do log "$(basename "$part" .log)" | grep -aE '^[a-z0-9_]+, [a-z]+, [0-9]+:|tried again'; done)"
block "A whole run" "$(log whole_run | grep -v '^row |')"
block "Conversion against OpenCV" "$(grep -E 'median|^Benchmark|^---' "$work/image_bench.log" || cat "$work/image_bench.log")"
page "drivers of real devices"
