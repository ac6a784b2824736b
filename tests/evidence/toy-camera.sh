#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Adds a camera driver as CONTRIBUTING.md says, in a copy of the repository: a folder, and a row with its #include. The page holds
# the whole difference. The robot file of the check names the driver for both cameras.
also=(tests/evidence/toy_camera)
. "$(dirname "$0")/common.sh"
tree=$work/tree
add_driver() {
  rm -rf "$tree"
  git clone -q . "$tree"
  cp -r tests/evidence/toy_camera "$tree/drivers/toy_camera"
  sed -i 's|^#include "drivers/v4l2_camera/v4l2_camera.h"|#include "drivers/toy_camera/toy_camera.h"\n&|
          s|^    Row{.backend = {kSerialDiffDrive, |    Row{.backend = {"toy_camera", true, false, ""}, .open_camera = [](Shared\&, const char*, const CameraPart\&) -> OpenedCamera { return std::unique_ptr<Camera>(new toy_camera::ToyCamera); }},\n&|' "$tree/drivers/backends.cpp"
  git -C "$tree" add -A
  git -C "$tree" diff --cached --stat
  git -C "$tree" diff --cached drivers/backends.cpp
}
step added add_driver
block "what a new camera changes" "$(cat "$work/added.log")"
row "files changed outside the driver's own folder" "$(git -C "$tree" diff --cached --name-only | grep -vc '^drivers/toy_camera/')" 1 \
  "$(holds "$(git -C "$tree" diff --cached --name-only | grep -vc '^drivers/toy_camera/') == 1")"
lines=$(git -C "$tree" diff --cached --numstat drivers/backends.cpp | cut -f1)
row "lines added to the table of drivers: the row and its #include" "$lines" 2 "$(holds "$lines == 2")"
build_and_run() {
  cmake -S "$tree" -B "$tree/build" --preset release -D TWOCONE_BUILD_TESTS=OFF -D TWOCONE_BUILD_BENCHMARKS=OFF -D TWOCONE_BUILD_FUZZERS=OFF -D TWOCONE_BUILD_VM_PROGRAMS=OFF &&
    cmake --build "$tree/build" --target twocone || return 1
  sed 's/driver: sim_povray, width_px/driver: toy_camera, width_px/; s/drive: {driver: sim_povray/drive: {driver: memory/; /^effects:/,$d
       s|^map:.*|map: '"$PWD"'/scenes/lab.map.yaml|' tests/end_to_end/data/small.yaml >"$work/toy.yaml"
  rm -rf "$work/run"
  "$tree/build/twocone" run --robot "$work/toy.yaml" --frames 5 --behaviour still --out "$work/run" &&
    [ "$(wc -l <"$work/run/frames.csv")" = 6 ]
}
step run build_and_run
row "a robot with two toy cameras runs: five frames" "$(passed run)" yes "$(passed run)"
page "a new camera driver"
